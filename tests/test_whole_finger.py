"""Whole fingers on the simulated hand: steps, loads, contact with a wall and release, a palm that turns."""

from __future__ import annotations

import numpy as np
import pytest
from commands import complaint

pytest.importorskip("scipy")

from awiwi_gen.compare import finger as command
from awiwi_gen.tick.moving_base import Points
from awiwi_gen.tick.status import LAWS
from awiwi_gen.tick.whole_finger import BEFORE, PLANTS, SETTING, STEP, Plant, Run

WORST, HEAVY = "friction x0.7, damping x0.5", "links x3"


@pytest.fixture(scope="module")
def shown(lib):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "PLANTS", {name: PLANTS[name] for name in (WORST, HEAVY)})
        return command.whole_fingers(None, "", "all")


def test_every_finger_reaches_the_goal_with_less_friction_and_damping_and_with_heavy_links(shown, hand):
    assert list(shown.data["fingers"]) == list(hand.fingers)
    for each in shown.data["fingers"].values():
        assert all(score["goal"] and score["slack"] == 0 and not score["faults"] for score in each.values())
        assert all(25 < score["force"] < shown.data["force_limit"] for score in each.values())
        assert 0 < each[WORST]["turning"] < 0.02 * STEP < 3 * each[HEAVY]["turning"]
        assert each[HEAVY]["settling"] > each[WORST]["settling"]
        assert max(score["pressing"] for score in each.values()) < 0.02


def test_the_table_has_a_row_for_each_finger_and_plant_and_the_worst_of_all(shown, hand):
    rows = shown.tables[0].rows

    assert [row[0] for row in rows] == [*(name for name in hand.fingers for _ in range(2)), "worst"]
    assert all(row[-1] == "reached" for row in rows[:-1])
    assert len(rows[0]) == len(shown.tables[0].columns)


def test_co_contractions_tell_what_springs_that_differ_do_to_joints(lib, hand):
    run = Run(lib, hand, LAWS.index("backstepping"), SETTING, Plant(apart=0.1))

    assert np.abs(run._q[BEFORE] - run.goal).max() > 0.2
    assert np.abs(run.loop.hand.world.q - run.goal).max() < 0.02


@pytest.mark.parametrize("finger", ["thumb", "index", "middle", "ring"])
def test_a_palm_that_turns_about_the_first_axis_is_a_motion_of_the_first_joint(lib, hand, finger):
    random = np.random.default_rng(0)
    points, n = Points(lib, finger, hand.fingers[finger]), len(hand.fingers[finger].joints)
    q, qd, first = random.uniform(0.1, 0.4, n), random.uniform(-3, 3, n), np.eye(n)[0]
    axis = lib[f"{finger}_link_poses"](q)[0, :3, 2]

    def torque(omega, alpha):
        return lib[f"{finger}_inverse_dynamics"](q, qd + omega * first, alpha * first, np.zeros(3))

    expected = torque(0, 0) - torque(0.8, 10)
    assert points.torques(q, qd, 0.8 * axis, 10 * axis) == pytest.approx(expected, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--finger", "indx"], "did you mean index"),
        (["lqr", "--finger", "index"], "there are motor_impedance, cascade, backstepping"),
        (["--finger", "index", "--gains", "K_p=1"], "--finger runs all scenarios with the gains of the tick"),
    ],
)
def test_what_no_whole_finger_has_is_refused(arguments, told):
    assert told in complaint("simulate", *arguments)
