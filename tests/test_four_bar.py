"""The four-bar behind the fifth finger's metacarpal (section 5.5): its ratio, its closing, its locking."""

from __future__ import annotations

import math

import numpy as np
import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.kernels.four_bars import four_bar_kernels

FOLDED, IN_LINE = 15.066, 114.166  # crank angles [deg] at which coupler and rocker lie along one line


@pytest.fixture(scope="module")
def bar(hand):
    return hand.fingers["fifth"].links[0].four_bar


@pytest.fixture(scope="module")
def turn(lib, bar):
    """The kernel as a function of the crank's angle [deg]."""
    return lambda crank: lib.fifth_hmc_four_bar(np.radians(crank) - float(bar.reference))


def towards(angle):
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def test_crank_coupler_and_rocker_close_the_loop(bar, turn):
    crank = np.linspace(FOLDED + 0.01, IN_LINE - 0.01, 500)
    found = turn(crank)

    gap = (
        float(bar.crank) * towards(np.radians(crank))
        + float(bar.coupler) * towards(found.coupler)
        - float(bar.rocker) * towards(found.rocker)
        - [float(bar.ground), 0]
    )
    assert (found.status == 0).all()
    assert np.abs(gap).max() < 2e-16 / np.min(found.transmission)
    assert np.abs(gap[20:-20]).max() < 1e-16


def test_the_ratios_are_those_of_the_velocities_and_the_derivatives_of_the_angles(bar, turn):
    crank = np.linspace(30.0, 100.0, 141)
    found, step = turn(crank), 1e-4
    ahead, behind = turn(crank + step), turn(crank - step)
    t2, t3, t4 = np.radians(crank), found.coupler, found.rocker
    r2, r3, r4 = (float(side) for side in (bar.crank, bar.coupler, bar.rocker))

    np.testing.assert_allclose(found.coupler_ratio, r2 * np.sin(t4 - t2) / (r3 * np.sin(t3 - t4)), rtol=1e-13)
    np.testing.assert_allclose(found.rocker_ratio, r2 * np.sin(t2 - t3) / (r4 * np.sin(t4 - t3)), rtol=1e-13)
    for name in ("coupler", "rocker"):
        rate = (getattr(ahead, name) - getattr(behind, name)) / np.radians(2 * step)
        np.testing.assert_allclose(getattr(found, f"{name}_ratio"), rate, rtol=0, atol=1e-8)


def test_the_linkage_closes_from_15_to_114_deg_of_crank_angle_and_tells_where_it_does_not(turn):
    outside = [FOLDED - 0.001, IN_LINE + 0.001, 0.0, 180.0, math.nan, math.inf]
    inside = [FOLDED + 0.001, 30.0, 60.0, 100.0, IN_LINE - 0.001]

    assert (turn(np.array(outside)).status == 1).all()
    assert (turn(np.array(inside)).status == 0).all()


def test_it_locks_where_coupler_and_rocker_come_into_line(turn):
    """Towards either end the transmission vanishes and the ratios grow beyond bounds, as the inverse of its size."""
    for end, sign, folded in ((FOLDED, 1, True), (IN_LINE, -1, False)):
        near, nearer = turn(end + sign * 0.01), turn(end + sign * 0.005)
        between = math.cos(nearer.coupler - nearer.rocker)

        assert 0 < nearer.transmission < near.transmission < 0.05
        assert abs(nearer.coupler_ratio) > abs(near.coupler_ratio) > 10
        assert nearer.transmission * nearer.coupler_ratio == pytest.approx(
            near.transmission * near.coupler_ratio, rel=0.05
        )
        # Stretched, coupler and rocker point towards each other's ends; folded, they point the same way.
        assert between == pytest.approx(1 if folded else -1, abs=1e-3)


def test_the_fingers_range_stays_away_from_locking(lib, hand):
    link = hand.fingers["fifth"].links[0]
    found = lib.fifth_hmc_four_bar(np.linspace(float(link.low), float(link.high), 200))

    assert found.transmission.min() > 0.4
    assert np.abs(found.coupler_ratio).max() < 2.5


def test_it_is_a_double_rocker_since_its_coupler_is_the_shortest_bar(bar, turn):
    sides = sorted(float(side) for side in (bar.ground, bar.crank, bar.coupler, bar.rocker))

    assert sides[0] == float(bar.coupler)
    assert sides[0] + sides[3] < sides[1] + sides[2]  # Grashof: some bar turns fully, and it is the coupler
    assert (turn(np.array([-10.0, 10.0, 150.0, 210.0])).status == 1).all()  # so the crank does not


def test_the_metacarpal_turns_as_the_coupler_does(lib, hand):
    """The finger's chain closes the same linkage by its own formulas."""
    q = np.linspace(-0.5, 0.65, 24)
    joints = np.zeros((24, 4))
    joints[:, 0] = q
    metacarpal = lib.fifth_link_poses(joints).T[:, 0, :3, :3]
    at_rest = lib.fifth_link_poses(np.zeros(4)).T[0, :3, :3]
    turned = np.einsum("ij,sik->sjk", at_rest, metacarpal)  # about the joint's z

    angle = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
    expected = lib.fifth_hmc_four_bar(q).coupler - lib.fifth_hmc_four_bar(0.0).coupler
    np.testing.assert_allclose(angle, expected, rtol=0, atol=1e-14)


def test_every_link_on_a_four_bar_has_a_kernel_and_no_other_link_has(hand):
    names = [kernel.name for name, finger in hand.fingers.items() for kernel in four_bar_kernels(name, finger)]

    assert names == ["fifth_hmc_four_bar"]


def test_a_range_that_locks_is_refused_with_the_joint_angle_that_fails(root):
    text = (root / "awiwi_gen" / "hand.toml").read_text(encoding="utf-8")
    assert 'high = "40 deg"\noffset = ["4 mm", "-6 mm", "0 mm"]' in text
    beyond = text.replace(
        'high = "40 deg"\noffset = ["4 mm", "-6 mm", "0 mm"]', 'high = "55 deg"\noffset = ["4 mm", "-6 mm", "0 mm"]'
    )

    with pytest.raises(InputError, match=r"does not close at a joint angle of 54\.\d+ deg \(crank at 114\.\d+ deg\)"):
        Hand.parse(beyond)
