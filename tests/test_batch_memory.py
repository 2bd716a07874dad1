"""Arrays of many samples in memory: what is copied, how results lie, where they are written."""

from __future__ import annotations

import numpy as np
import pytest
from samples import fields, points, same_bits, tree, vectorised

from awiwi_gen.arrays import as_samples
from awiwi_gen.build import load
from awiwi_gen.errors import InputError


@pytest.fixture(scope="module")
def jaw():
    return vectorised(tree())


@pytest.mark.parametrize(
    "view",
    [
        lambda x: x,
        lambda x: x[::2],
        lambda x: x[::-1],
        lambda x: x[3:4],
        lambda x: np.asfortranarray(x),
        lambda x: np.asfortranarray(x)[::-1, ::-1],
        lambda x: np.repeat(np.asfortranarray(x), 2, axis=0)[::2],
        lambda x: np.repeat(x, 3, axis=1)[:, ::3],
        lambda x: np.concatenate([x, x], axis=1)[:, : x.shape[1]],
        lambda x: x.reshape(8, -1, x.shape[1])[:, 1:],
        lambda x: x.reshape(8, -1, x.shape[1]).transpose(1, 0, 2),
        lambda x: np.broadcast_to(x[0], x.shape),
        lambda x: np.frombuffer(b"\0" + x.tobytes(), x.dtype, offset=1).reshape(x.shape),
    ],
)
def test_the_layout_of_an_input_does_not_matter(jaw, view):
    given = [view(array) for array in points(jaw.jaw_inverse_dynamics, 64)]
    packed = [np.array(array, order="C") for array in given]

    assert same_bits(jaw.jaw_inverse_dynamics(*given), jaw.jaw_inverse_dynamics(*packed))


@pytest.mark.parametrize(
    ("array", "lead", "step", "element"),
    [
        (np.zeros((6, 4)), (6,), 4, 1),
        (np.zeros((6, 9))[:, 2:6], (6,), 9, 1),
        (np.zeros((6, 4))[::-1], (6,), -4, 1),
        (np.zeros(4), (1000,), 0, 1),
        (np.zeros((1, 1, 4)), (30, 1000), 0, 1),
        (np.zeros((12, 4)).reshape(3, 4, 4), (3, 4), 4, 1),
        (np.zeros((4, 6)).T, (6,), 1, 6),
        (np.zeros((9, 6))[::2][:4].T, (6,), 1, 12),
        (np.zeros((6, 4))[:, ::-1], (6,), 4, -1),
        (np.zeros((4, 3, 5)).transpose(1, 2, 0), (3, 5), 1, 15),
    ],
)
def test_inputs_whose_samples_are_evenly_apart_are_not_copied(array, lead, step, element):
    rows, *found = as_samples(array, array.shape[:-1], lead, (4,))

    assert found == [step, element]
    assert np.shares_memory(rows, array)


@pytest.mark.parametrize("vectorise_after", [0, np.inf], ids=["vectors", "plain"])
def test_results_lie_in_memory_as_the_inputs_do(vectorise_after):
    loaded = load(tree())
    loaded.vectorise_after = vectorise_after
    given = points(loaded.jaw_dynamics, 5, 12)
    by_element = [np.moveaxis(np.moveaxis(x, -1, 0).copy(), 0, -1) for x in given]

    for one, other in zip(loaded.jaw_dynamics(*given), loaded.jaw_dynamics(*by_element), strict=True):
        assert same_bits(one, other)
        assert one.flags.c_contiguous
        assert np.moveaxis(other, (0, 1), (-2, -1)).flags.c_contiguous
    assert loaded.jaw_dynamics(by_element[0], given[1], by_element[2]).M.flags.c_contiguous
    assert not loaded.jaw_dynamics(*by_element[:2], given[2][0, 0]).M.flags.c_contiguous


@pytest.mark.parametrize("vectorise_after", [0, np.inf], ids=["vectors", "plain"])
@pytest.mark.parametrize("lay", [np.ascontiguousarray, np.asfortranarray])
def test_results_can_be_written_where_earlier_ones_are(vectorise_after, lay):
    loaded = load(tree())
    loaded.vectorise_after = vectorise_after
    for function in (loaded.jaw_mass_matrix, loaded.jaw_dynamics, loaded.jaw_tendon_stiffness):
        first, second = ([lay(x) for x in points(function, 70)] for _ in range(2))
        expected, place = function(*second), function(*first)
        written = function(*second, out=place)

        assert same_bits(written, expected)
        assert same_bits(place, expected)
        assert written is place


def test_results_are_written_to_nothing_else(jaw):
    q = points(jaw.jaw_mass_matrix, 70)[0]
    read_only = jaw.jaw_mass_matrix(q)
    read_only.flags.writeable = False
    shape, lies = (
        r"out is .*; expected \(70, 2, 2\) of float64",
        "out is not writeable with its samples one after another",
    )
    for place, told in (
        (np.zeros((69, 2, 2)), shape),
        (np.zeros((70, 2, 2), np.float32), shape),
        ("somewhere", "out is or holds a str; expected one array of NumPy"),
        ((), shape),
        (np.zeros((70, 2, 4))[..., ::2], lies),
        (jaw.jaw_mass_matrix(np.asfortranarray(q)), lies),
        (read_only, lies),
    ):
        with pytest.raises(InputError, match=f"jaw_mass_matrix: {told}"):
            jaw.jaw_mass_matrix(q, out=place)
    both = np.zeros(500)
    with pytest.raises(InputError, match="jaw_mass_matrix: out overlaps an input"):
        jaw.jaw_mass_matrix(both[:140].reshape(70, 2), out=both[100:380].reshape(70, 2, 2))


@pytest.mark.parametrize("n", [*range(35), 512, 1000])
def test_arrays_by_element_have_the_bits_of_samples_one_after_another(jaw, n):
    for name in ("jaw_inverse_dynamics", "jaw_tendon_stiffness"):
        given = points(jaw[name], n)

        assert same_bits(jaw[name](*(np.asfortranarray(x) for x in given)), jaw[name](*given))


def test_inputs_with_different_leading_dimensions_meet_in_vectors(jaw):
    q, qd, qdd, g = points(jaw.jaw_inverse_dynamics, 60)
    q, qd, g = q[:20, None], qd[:3], g[0]
    tau = jaw.jaw_inverse_dynamics(q, qd, qdd.reshape(20, 3, 2), g)

    assert tau.shape == (20, 3, 2)
    for index in np.ndindex(20, 3):
        one = jaw.jaw_inverse_dynamics(q[index[0], 0], qd[index[1]], qdd.reshape(20, 3, 2)[index], g)
        assert same_bits(tau[index], one)


@pytest.mark.parametrize("lead", [(0,), (3, 0), (0, 5)])
def test_empty_batches_give_empty_results(jaw, lead):
    for function in jaw.values():
        for result in fields(function(*points(function, *lead))):
            assert result.shape[: len(lead)] == lead
