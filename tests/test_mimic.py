"""Joints that follow others by a ratio and an offset of their own, apart from pulleys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.pose import Chain
from awiwi_gen.kernels.fingers_control import antagonists
from awiwi_gen.pipeline import Job, cached_tree, verify
from awiwi_gen.structure import groups

ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")
COUPLING = '{ follower = "end", leader = "mid" }'
RATIO, OFFSET = -0.8, np.radians(10)


def coupled(more: str) -> str:
    """The small hand with more keys in its coupling, and a tendon over the follower."""
    text = ONE_FINGER.replace(COUPLING, COUPLING.replace(" }", f", {more} }}"))
    return text.replace('over = ["-mid"]', 'over = ["-mid", "+end"], arms = { end = "2 mm" }')


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(coupled('ratio = "-0.8", offset = "10 deg"'))


@pytest.fixture(scope="module")
def job(hand) -> Job:
    return Job(hand, only="jaw_[lctm][iaoe][nus]*[hgsx]")  # link poses, coupling, tendon lengths, mass matrix


@pytest.fixture(scope="module")
def lib(job):
    return load(cached_tree(job), job.store)


def test_a_follower_turns_by_ratio_and_offset(lib):
    q = np.array([0.2, 0.5])
    _, mid, end = lib.jaw_link_poses(q).T[:, :3, :3]
    turned = mid.T @ end

    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(RATIO * 0.5 + OFFSET, rel=1e-13)


def test_a_tendon_over_a_follower_has_its_arm_times_the_ratio(lib):
    q = np.array([0.2, 0.5])
    follower = RATIO * 0.5 + OFFSET

    np.testing.assert_allclose(lib.jaw_coupling(q)[2] * 1e3, [0, -6 + 9 * RATIO], rtol=1e-13)
    np.testing.assert_allclose(lib.jaw_tendon_lengths(q)[2] * 1e3, -6 * 0.5 + 9 * follower, rtol=1e-13)


def test_the_checks_have_the_arms_of_the_kernel(hand, lib):
    chain = Chain(hand.fingers["jaw"])

    np.testing.assert_allclose(
        [chain.coupling(q) for q in chain.poses()[:3]], [lib.jaw_coupling([0, 0])] * 3, atol=1e-15
    )


def test_both_derivations_agree(job):
    assert verify(job, cached_tree(job)).passed


def test_tendons_over_such_a_follower_are_no_antagonists_by_their_senses():
    rolling, geared = (
        Hand.parse(text.replace('["+root", "+mid"]', '["+end"]').replace('["-root", "+mid"]', '["+root"]')).fingers[
            "jaw"
        ]
        for text in (ONE_FINGER, ONE_FINGER.replace(COUPLING, COUPLING.replace(" }", ', ratio = "0.5" }')))
    )

    assert [antagonists(rolling, group) for group in groups(rolling) if 0 in group] == [[(0, 2)]]
    assert [antagonists(geared, group) for group in groups(geared) if 0 in group] == [[]]


def test_a_ratio_needs_no_pulleys_and_must_not_be_zero():
    without = '    { joint = "end", radius = "7 mm", source = "drawing 7" },\n'
    assert without in ONE_FINGER
    assert Hand.parse(ONE_FINGER.replace(without, "").replace(COUPLING, COUPLING.replace(" }", ', ratio = "0.5" }')))
    with pytest.raises(InputError, match=r'couplings\[0\].follower = "end" names no pulley'):
        Hand.parse(ONE_FINGER.replace(without, ""))
    with pytest.raises(InputError, match=r'couplings\[0\].ratio = "0" holds the follower; expected another number'):
        Hand.parse(coupled('ratio = "0"'))
