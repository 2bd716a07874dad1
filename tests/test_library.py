"""Compiled kernels as NumPy functions: shapes, types, errors, results."""

from __future__ import annotations

import copy
import inspect
import pickle
from datetime import date
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from samples import fields

import awiwi_gen
from awiwi_gen.errors import InputError

ONE_FINGER = Path(__file__).with_name("one_finger.toml")
RANDOM = np.random.default_rng(11)


def points(function, *lead: int) -> dict[str, np.ndarray]:
    """Random inputs of a kernel inside its ranges, with leading dimensions."""
    return {
        port["name"]: RANDOM.uniform(
            np.reshape(port["low"], port["shape"]), np.reshape(port["high"], port["shape"]), (*lead, *port["shape"])
        )
        for port in function.inputs
    }


# ------------------------------------------------------------------------------------------------- shapes


def test_a_kernel_maps_one_point_to_one_result(lib):
    assert lib.index_mass_matrix([0.1, 0.2, 0.3, 0.4]).shape == (4, 4)
    assert lib.wrist_points(0.6, 1.0).A.shape == (3,)


@pytest.mark.parametrize("lead", [(1,), (7,), (2, 3), (2, 1, 3)])
def test_leading_dimensions_are_kept(lib, lead):
    assert lib.index_mass_matrix(np.zeros((*lead, 4))).shape == (*lead, 4, 4)
    assert lib.wrist_points(np.full(lead, 0.6), np.full(lead, 1.0)).C.shape == (*lead, 3)


def test_a_scalar_port_takes_and_gives_scalars(lib):
    assert lib.motor_friction(1.5).shape == ()
    assert lib.motor_friction([1.5]).shape == (1,)
    assert lib.motor_friction(np.zeros((2, 3))).shape == (2, 3)
    assert lib.motor_friction(-1.5) == -lib.motor_friction(1.5)


@pytest.mark.parametrize(
    ("q", "qd", "qdd", "g", "lead"),
    [
        ((), (), (), (), ()),
        ((5,), (), (), (), (5,)),
        ((), (), (5,), (), (5,)),
        ((3, 1), (1, 4), (), (4,), (3, 4)),
        ((2, 1, 1), (3, 1), (4,), (), (2, 3, 4)),
        ((1,), (1, 1), (), (), (1, 1)),
        ((1,), (6,), (6,), (1,), (6,)),
        ((0,), (), (1,), (), (0,)),
        ((3, 0), (1, 1), (3, 1), (), (3, 0)),
    ],
)
def test_leading_dimensions_of_inputs_broadcast_against_each_other(lib, q, qd, qdd, g, lead):
    given = {"q": (*q, 4), "qd": (*qd, 4), "qdd": (*qdd, 4), "g": (*g, 3)}
    given = {name: RANDOM.uniform(-0.1, 0.1, shape) for name, shape in given.items()}
    tau = lib.index_inverse_dynamics(**given)

    assert tau.shape == (*lead, 4)
    spread = {name: np.broadcast_to(array, (*lead, array.shape[-1])) for name, array in given.items()}
    for index in np.ndindex(*lead):
        expected = lib.index_inverse_dynamics(**{name: array[index] for name, array in spread.items()})
        assert np.array_equal(tau[index], expected)


def test_no_points_give_no_results(lib):
    result = lib.index_dynamics(np.empty((0, 4)), np.empty((0, 4)), np.empty((0, 3)))

    assert [array.shape for array in result] == [(0, 4, 4), (0, 4, 4), (0, 4)]
    assert lib.wrist_points(np.empty(0), np.empty(0)).status.shape == (0,)


def test_arrays_need_not_be_contiguous(lib):
    q = RANDOM.uniform(0, 0.3, (6, 8))
    expected = lib.index_mass_matrix(q[:, :4].copy())

    assert np.array_equal(lib.index_mass_matrix(q[:, :4]), expected)
    assert np.array_equal(lib.index_mass_matrix(q[::-1, :4]), expected[::-1])
    assert np.array_equal(lib.index_mass_matrix(np.asfortranarray(q[:, :4])), expected)
    assert np.array_equal(lib.index_mass_matrix(q[:, ::2]), lib.index_mass_matrix(q[:, ::2].copy()))
    assert np.array_equal(lib.index_mass_matrix(np.broadcast_to(q[0, :4], (3, 4))), expected[[0, 0, 0]])


def test_lists_integers_and_other_byte_orders_are_numbers_too(lib):
    expected = lib.index_mass_matrix(np.array([0.0, 1.0, 1.0, 0.0]))

    assert np.array_equal(lib.index_mass_matrix([0, 1, 1, 0]), expected)
    assert np.array_equal(lib.index_mass_matrix(np.array([0, 1, 1, 0], dtype=">f8")), expected)
    assert np.array_equal(lib.index_mass_matrix(np.array([0, 1, 1, 0], dtype=bool)), expected)


def test_numbers_of_python_are_numbers(lib):
    expected = lib.index_mass_matrix([0.5, 0.25, 0.0, 1.0])

    assert np.array_equal(lib.index_mass_matrix([Fraction(1, 2), Decimal("0.25"), False, 1]), expected)
    assert np.array_equal(lib.index_mass_matrix(np.array([0.5, 0.25, 0, 1], np.float16)), expected)


def test_inputs_are_left_as_they_are(lib):
    given = points(lib.index_forward_dynamics, 5)
    before = copy.deepcopy(given)
    for array in given.values():
        array.flags.writeable = False
    lib.index_forward_dynamics(**given)

    assert all(np.array_equal(given[name], before[name]) for name in given)


def test_results_are_arrays_of_their_own(lib):
    first, second = lib.index_mass_matrix(np.zeros(4)), lib.index_mass_matrix(np.zeros(4))
    first[...] = 7

    assert not np.any(second == 7)


# ------------------------------------------------------------------------------------------------- all kernels


def test_a_batch_equals_a_loop_in_every_bit(lib):
    for name, function in lib.items():
        given = points(function, 9)
        batch = fields(function(**given))
        for i in range(9):
            alone = fields(function(**{port: array[i] for port, array in given.items()}))
            assert all(a[i].tobytes() == b.tobytes() for a, b in zip(batch, alone, strict=True)), name


WARM_STARTS = {"K_last"}  # a gain to begin with: one that is no number is left aside, and the gain found all the same


def test_nothing_plausible_comes_of_something_that_is_not_a_number(lib):
    for name, function in lib.items():
        here = points(function)
        for port, elsewhere in points(function).items():
            spoilt = function(**here | {port: np.full_like(elsewhere, np.nan)})
            if getattr(spoilt, "status", 0) or port in WARM_STARTS:
                continue
            usual, moved = function(**here), function(**here | {port: elsewhere})
            for a, b, c in zip(fields(usual), fields(moved), fields(spoilt), strict=True):
                assert np.isnan(c[a != b]).all(), f"{name} does not need its {port}"


def test_one_number_that_is_none_spoils_only_the_samples_that_need_it(lib):
    q = np.zeros((3, 4))
    q[1, 2] = np.nan
    M = lib.index_mass_matrix(q)

    assert np.isfinite(M[[0, 2]]).all()
    assert np.isnan(M[1]).any()


def test_outside_of_its_domain_a_kernel_says_so(lib):
    inside, outside = lib.wrist_points(0.62, 0.97), lib.wrist_points(0.62, -0.5)

    assert inside.status == 0
    assert np.isfinite(inside.A).all()
    assert outside.status == 1


def test_a_solver_says_when_its_input_is_not_a_number(lib):
    start = np.full(4, 0.1)
    h = lib.thumb_tendon_lengths(start)
    result = lib.thumb_joint_estimate(np.stack([h, np.full(8, np.nan)]), start)

    assert result.status.tolist() == [0, 3]
    assert result.q[0] == pytest.approx(start, abs=1e-9)
    assert np.isfinite(result.q[1]).all()


# ------------------------------------------------------------------------------------------------- wrong inputs


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"q": [0.1, 0.2, 0.3]}, r"index_mass_matrix: q has shape \(3,\), expected \(..., 4\)"),
        ({"q": 0.1}, r"index_mass_matrix: q has shape \(\), expected \(..., 4\)"),
        ({"q": np.zeros((4, 5))}, r"q has shape \(4, 5\), expected \(..., 4\)"),
        ({"q": "straight"}, "index_mass_matrix: q = 'straight' is not an array of real numbers: it holds text"),
        ({"q": [[1, 2], [3]]}, "is not an array of real numbers"),
        ({"q": [1j, 0, 0, 0]}, "it holds complex numbers"),
        ({"q": np.array([1e-30j, 0, 0, 0])}, "it holds complex numbers"),
        ({"q": None}, "it holds a NoneType"),
        ({"q": [0.1, None, 0.3, 0.4]}, "it holds a NoneType"),
        ({"q": ["0.1", "0.2", "0.3", "0.4"]}, "it holds text"),
        ({"q": [b"0.1", b"0.2", b"0.3", b"0.4"]}, "it holds bytes"),
        ({"q": b"1234"}, "it holds bytes"),
        ({"q": np.ma.array(np.zeros(4), mask=[0, 1, 0, 0])}, "it is masked"),
        ({"q": np.ma.zeros(4)}, "it is masked"),
        ({"q": np.zeros(4, "datetime64[s]")}, "it holds dates"),
        ({"q": np.zeros(4, "timedelta64[s]")}, "it holds durations"),
        ({"q": [date(2026, 1, 1)] * 4}, "it holds a date"),
        ({"q": np.zeros(4, [("x", float)])}, "it holds records"),
        ({"q": [10**400, 0, 0, 0]}, "is not an array of real numbers"),
        ({"q": {"q": 1}}, "it holds a dict"),
        ({}, r"index_mass_matrix takes q; missing \['q'\], unknown \[\]"),
        ({"Q": np.zeros(4)}, r"index_mass_matrix takes q; missing \['q'\], unknown \['Q'\]"),
        ({"q_": np.zeros(4)}, r"unknown \['q_'\]; did you mean q\?"),
        ({"q": np.zeros(4), "qd": np.zeros(4)}, r"missing \[\], unknown \['qd'\]"),
    ],
)
def test_inputs_that_do_not_fit_are_refused_in_words(lib, given, message):
    with pytest.raises(InputError, match=message):
        lib.index_mass_matrix(**given)


def test_an_input_is_given_once(lib):
    with pytest.raises(InputError, match="takes q"):
        lib.index_mass_matrix(np.zeros(4), q=np.zeros(4))
    with pytest.raises(InputError, match="takes q"):
        lib.index_mass_matrix(np.zeros(4), np.zeros(4))


def test_leading_dimensions_that_do_not_broadcast_are_told_with_all_shapes(lib):
    with pytest.raises(InputError) as caught:
        lib.index_gravity(np.zeros((2, 4)), np.zeros((3, 3)))

    assert str(caught.value) == "index_gravity: leading dimensions do not broadcast: q (2, 4), g (3, 3)"
    assert isinstance(caught.value, ValueError)


# ------------------------------------------------------------------------------------------------- out


@pytest.mark.parametrize(
    ("out", "message"),
    [
        ([[0.0] * 4] * 4, "out is or holds a list; expected one array of NumPy"),
        ([np.zeros((4, 4))], "out is or holds a list"),
        (np.ma.zeros((4, 4)), "out is or holds a MaskedArray"),
        (0.0, "out is or holds a float"),
        ((None,), "out is or holds a NoneType"),
        (np.zeros((4, 4), np.float32), r"out is \(4, 4\) of float32; expected \(4, 4\) of float64"),
    ],
)
def test_an_out_that_would_hold_no_result_is_refused(lib, out, message):
    with pytest.raises(InputError, match=message):
        lib.index_mass_matrix(np.zeros(4), out=out)


def test_one_array_for_two_outputs_is_refused(lib):
    q, g = np.zeros(4), np.zeros(3)
    M, gravity = np.zeros((4, 4)), np.zeros(4)
    for C in (M, M.reshape(4, 4), np.lib.stride_tricks.as_strided(M, (4, 4), M.strides)):
        with pytest.raises(InputError, match="arrays of out overlap; expected one array for each output"):
            lib.index_dynamics(q, q, g, out=(M, C, gravity))
    result = lib.index_dynamics(q, q, g, out=(M, np.zeros((4, 4)), gravity))
    assert np.array_equal(result[0], lib.index_dynamics(q, q, g).M)


# ------------------------------------------------------------------------------------------------- results


def test_several_outputs_come_as_a_named_tuple(lib):
    result = lib.index_dynamics(np.zeros(4), np.zeros(4), np.zeros(3))

    assert result._fields == ("M", "C", "gravity")
    assert type(result).__name__ == "index_dynamics"
    assert result.M is result[0]
    M = lib.index_mass_matrix(np.zeros(4))  # a kernel of its own, which may round otherwise
    assert np.abs(result.M - M).max() <= 1e-15 * M.max()


def test_a_kernel_that_can_fail_adds_its_status(lib):
    result = lib.wrist_tendon_lengths(np.full((2, 3), 0.62), 0.97)

    assert result._fields == ("h", "status")
    assert result.status.shape == (2, 3)
    assert result.status.dtype == np.intc


@pytest.mark.parametrize("duplicate", [lambda x: pickle.loads(pickle.dumps(x)), copy.copy, copy.deepcopy])
def test_results_survive_pickling_and_copying(lib, duplicate):
    result = lib.index_dynamics(np.full((2, 4), 0.1), np.zeros(4), np.zeros(3))
    again = duplicate(result)

    assert type(again) is type(result)
    assert all(np.array_equal(a, b) for a, b in zip(again, result, strict=True))


# ------------------------------------------------------------------------------------------------- what it tells


def test_a_kernel_explains_itself(lib):
    function = lib.index_mass_matrix

    assert function.__doc__.startswith("Mass matrix: the kinetic energy is half qd' M qd.\n\nParameters\n")
    assert repr(function) == "<kernel index_mass_matrix: q(4) [rad] -> M(4, 4) [kg m^2]>"
    assert str(inspect.signature(function)) == "(q, *, out=None)"
    assert str(inspect.signature(lib.index_gravity)) == "(q, g, *, out=None)"
    assert function.__name__ == "index_mass_matrix"
    assert function.cost["mul"] > 0
    assert function.inputs[0]["low"] == pytest.approx(np.deg2rad([-20, -10, -5, -5]))


def test_a_library_is_a_mapping_of_its_kernels(lib):
    assert lib["index_mass_matrix"] is lib.index_mass_matrix
    assert "index_mass_matrix" in dir(lib)
    assert len(lib) == len(list(lib)) == len(lib.manifest["kernels"])
    assert repr(lib) == f"<library {lib.manifest['hand']}: {len(lib)} kernels, double, model {lib.digest[:12]}>"
    with pytest.raises(KeyError, match="did you mean index_mass_matrix"):
        _ = lib["index_mas_matrix"]
    assert "index_mass" not in lib
    with pytest.raises(AttributeError, match=r"this hand has no kernel 'index_mass'; did you mean .*index_mass_matrix"):
        _ = lib.index_mass


def test_the_model_digest_is_that_of_the_hand(lib, hand):
    assert lib.digest == hand.digest()


def test_a_hand_can_be_built_again_and_again(lib, hand):
    assert awiwi_gen.build(hand).digest == lib.digest
    assert callable(awiwi_gen.build)
