"""The short way of one sample: the bits and shapes of a batch of one, and only for arrays as C has them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import awiwi_gen


def middle(function) -> list[np.ndarray]:
    """One sample of each input, in the middle of its range."""
    ends = ((port["low"], port["high"], port["shape"]) for port in function.inputs)
    return [np.reshape((np.array(low) + np.array(high)) / 2, shape) for low, high, shape in ends]


def arrays(result) -> tuple[np.ndarray, ...]:
    return result if isinstance(result, tuple) else (result,)


def test_every_kernel_gives_one_sample_what_it_gives_a_batch_of_one(lib):
    for function in lib.values():
        inputs = middle(function)
        alone, batch = function(*inputs), function(*(array[None] for array in inputs))
        assert type(alone) is type(batch)
        for one, several in zip(arrays(alone), arrays(batch), strict=True):
            assert (one.dtype, one.shape) == (several.dtype, several.shape[1:]), function.name
            assert one.tobytes() == several.tobytes(), function.name


def read_only(q: np.ndarray) -> np.ndarray:
    copy = q.copy()
    copy.flags.writeable = False
    return copy


def unaligned(q: np.ndarray) -> np.ndarray:
    return np.frombuffer(b"\0" + q.tobytes(), np.uint8)[1:].view(q.dtype)


@pytest.mark.parametrize(
    "change", [read_only, unaligned, list, lambda q: np.repeat(q, 2)[::2], lambda q: q.astype(">f8")]
)
def test_other_inputs_take_the_long_way_to_the_same_result(lib, change):
    q = np.array([0.1, 0.2, 0.3, 0.4])
    assert np.array_equal(np.reshape(lib.index_mass_matrix(change(q)), (4, 4)), lib.index_mass_matrix(q))


def test_threads_share_a_kernel(lib):
    poses = np.linspace(0, 1, 400).repeat(4).reshape(400, 4)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lib.index_mass_matrix, poses))
    assert np.array_equal(np.stack(found), lib.index_mass_matrix(poses))


def test_numbers_read_at_run_time_reach_the_short_way(root):
    hand = awiwi_gen.Hand.load(root / "tests" / "one_finger.toml")
    library = awiwi_gen.build(hand, params="runtime", only="jaw_tendon_lengths")
    q = np.zeros(len(hand.fingers["jaw"].joints))
    alone, batch = library.jaw_tendon_lengths(q), library.jaw_tendon_lengths(q[None])
    assert all(np.array_equal(one, several[0]) for one, several in zip(arrays(alone), arrays(batch), strict=True))
