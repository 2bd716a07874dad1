"""What Python shows of a compiled hand: documented kernels, fingers with the names of their joints and tendons."""

from __future__ import annotations

import inspect
import pickle

import numpy as np
import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.kernels.estimates import joint_limits
from awiwi_gen.views import names_in


def test_every_kernel_tells_its_ports_with_shapes_units_and_ranges_its_source_and_its_cost(lib):
    for kernel in lib.values():
        text = inspect.getdoc(kernel)
        assert text.startswith(kernel.doc)
        for port in kernel.inputs + kernel.outputs:
            shape = ", ".join(["...", *map(str, port["shape"])])
            assert f"\n{port['name']} : ({shape}) [{port['unit']}]" in text
        assert f"Source: {kernel.source}." in text
        assert f"Cost: {kernel.cost['operations']} operations" in text
        assert ("\nstatus : int" in text) == ("status" in kernel.results)


def test_a_docstring_states_one_number_where_all_elements_have_one_range(lib):
    text = lib.index_forward_dynamics.__doc__

    assert "qd : (..., 4) [rad/s]\n    From -20 to 20.\n" in text
    assert (
        "q : (..., 4) [rad]\n    From [-0.3491, -0.1745, -0.08727, -0.08727] to [0.3491, 1.484, 1.571, 1.396].\n"
        in text
    )


def test_a_finger_has_the_kernels_of_its_name_under_the_rest_of_theirs(lib):
    index = lib.finger("index")

    assert index.mass_matrix is lib.index_mass_matrix
    assert index["gravity"] is lib["index_gravity"]
    assert sorted(f"index_{name}" for name in index) == sorted(name for name in lib if name.startswith("index_"))
    assert set(index) <= set(dir(index))
    assert set(lib) <= set(dir(lib))
    assert lib.part("wrist").coupling is lib.wrist_coupling


def test_a_finger_names_its_joints_and_tendons_as_the_hand_file_does(hand, lib):
    assert list(lib.names) == list(hand.fingers)
    for name, finger in hand.fingers.items():
        view = lib.finger(name)
        assert view.joints == tuple(finger.joints)
        assert len(view.tendons) == len(finger.transmissions)
        assert np.array_equal(view.joint_limits, joint_limits(finger))
        assert view.force_limits[1].tolist() == [float(hand.limits.tendon_force)] * len(view.tendons)
        assert view.torque_limits[1].shape == view.velocity_limits[0].shape == (len(view.joints),)


def test_results_get_the_names_of_joints_and_tendons(lib):
    index = lib.finger("index")
    torques = index.gravity(np.zeros((5, 4)), [-9.81, 0.0, 0.0])
    named = index.by_joint(torques)

    assert list(named) == ["abduction", "flexion", "pip", "dip"]
    assert np.array_equal(named["pip"], torques[:, 2])
    assert list(index.by_tendon(index.tendon_lengths(np.zeros(4)))) == list(index.tendons)
    with pytest.raises(InputError, match=r"index: shape \(3,\); expected \(\.\.\., 4\), its joints"):
        index.by_joint([1.0, 2.0, 3.0])


def test_a_name_that_a_hand_lacks_is_an_error_with_those_near_it(lib):
    with pytest.raises(InputError, match="no finger 'indx'; did you mean index"):
        lib.finger("indx")
    with pytest.raises(InputError, match="no part 'wirst'; did you mean wrist"):
        lib.part("wirst")
    with pytest.raises(AttributeError, match="no kernel of index 'mass_matrx'; did you mean mass_matrix"):
        lib.finger("index").mass_matrx  # noqa: B018
    with pytest.raises(KeyError, match="did you mean mass_matrix"):
        lib.finger("index")["mass_matrx"]
    with pytest.raises(InputError, match="finger index: no kernel of this library has an input zz"):
        lib.finger("index").limits("zz")


def test_a_finger_survives_pickling(lib):
    again = pickle.loads(pickle.dumps(lib.finger("index")))

    assert again.joints == lib.finger("index").joints
    assert np.array_equal(again.coupling(np.zeros(4)), lib.index_coupling(np.zeros(4)))


def test_a_finger_shows_its_joints_and_how_much_it_has(lib):
    assert repr(lib.finger("ring")).startswith("<finger ring: joints abduction, flexion, pip; 6 tendons; ")


def test_a_directory_without_names_has_no_fingers():
    assert names_in("", "awiwi") == {}
