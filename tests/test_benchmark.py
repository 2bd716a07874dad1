"""Laws compared on one joint of the hand: what the best one reaches, what cannot run, and what bad input does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("scipy")

from awiwi_gen.compare.comparison import clocks, compare
from awiwi_gen.compare.printed_gains import printed_gains
from awiwi_gen.errors import InputError
from awiwi_gen.loops.clock import clocked, require_clocked, running_gains
from awiwi_gen.loops.hand_joint import SENSING, joint_of, loop_around, values_of
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.loops.scenarios import FAMILY, PLANTS, SCENARIOS, load_of, motions
from awiwi_gen.simulate import Scenario, simulate

BEST = LAWS["backstepping_adaptive"]
FORCE, LEVER = SENSING
SCALED = ("springs 30 % soft", "springs 30 % stiff")


@pytest.fixture(scope="module")
def joint(lib, hand):
    return joint_of(lib, hand)


@pytest.fixture(scope="module")
def rows(lib, hand):
    return compare(lib, hand)


def of(rows, law, plant=None, sensing=FORCE):
    return [row for row in rows if (row.law, row.sensing) == (law, sensing) and plant in (None, row.plant)]


# -- the goal -----------------------------------------------------------------------------------------------


def test_with_a_force_sensor_the_best_law_settles_in_47_ms_with_its_stiffness_on_every_plant(rows):
    found = of(rows, BEST.name)

    assert [row.plant for row in found] == list(PLANTS)
    for row in found:
        assert row.score.settling <= (0.040 if row.plant == "as known" else 0.047), row
        assert row.score.overshoot <= 0.04, row
        assert abs(row.score.stiffness) <= 0.01, row
        assert row.score.slack == 0, row
        assert row.score.cycle < 1e-3, row


def test_no_other_law_reaches_it_with_either_sensing(rows):
    assert not [row for row in rows if row.law != BEST.name and row.score.good]


def test_with_the_lever_alone_only_the_common_scale_of_the_springs_stays_unknown(rows):
    """Both springs and the load multiplied by one factor give the same readings, so the stiffness is off by it."""
    found = of(rows, BEST.name, sensing=LEVER)

    assert all(row.score.overshoot <= 0.04 and row.score.steady < 0.01 and row.score.slack == 0 for row in found)
    assert all(abs(row.score.stiffness) < 0.04 for row in found if row.plant not in SCALED)
    assert sum(row.score.good for row in found) == len(PLANTS) - 3
    for plant, scale in zip(SCALED, (0.7, 1.3), strict=True):
        assert of(rows, BEST.name, plant, LEVER)[0].score.stiffness == pytest.approx(scale - 1, abs=0.03)


def test_at_rest_the_springs_difference_cannot_be_told_from_a_load(lib, joint):
    """Without a co-contraction nothing is learnt, and the joint rests where an imagined load would move it."""
    gains = BEST.gains_for(joint)
    true, ticks = joint.perturbed(springs=(1.3, 0.7)), 3000
    values = values_of(true, joint.believed(), 20.0) | BEST.values(lib, joint.believed(), 20.0, gains)
    waves = np.zeros((ticks, 3))
    w, t, depth = 2 * np.pi * 8, np.arange(ticks) / 3000, 0.3 * 20.0 * joint.arm
    waves = depth * np.stack([np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)], axis=1)
    values.pop("dither")
    scenarios = [Scenario(values, ticks, {"dither": each}) for each in (0 * waves, waves)]
    still, moved = simulate(lib, loop_around(true, list(BEST.blocks), LEVER), scenarios, ["x", "adaptation"])

    assert (still["adaptation"][:, 1] == 0).all()
    assert abs(still["x"][-1, 0]) > 0.1
    assert moved["adaptation"][-1, 1] > 0.24
    assert abs(moved["x"][-1, 0]) < 0.06


def test_the_inertia_of_a_grasped_object_is_learnt_in_one_step_and_not_from_a_load(lib, joint):
    gains = BEST.gains_for(joint)
    learnt = {}
    for link in (1.0, 3.0):
        true = joint.perturbed(link=link)
        values = values_of(true, joint.believed(), 45.0) | BEST.values(lib, joint.believed(), 45.0, gains)
        known = motions(load_of(joint))
        cases = [
            Scenario(values, 900, {"goal": known[n].goal[:900], "load": known[n].load[:900]}) for n in SCENARIOS[:2]
        ]
        learnt[link] = [
            trace["link_inertia"][-1, 0] / joint.inertias[0]
            for trace in simulate(lib, loop_around(true, list(BEST.blocks)), cases, ["link_inertia"])
        ]

    assert learnt[1.0] == pytest.approx([1, 1], rel=0.25)
    assert learnt[3.0][0] > 2 * learnt[1.0][0]
    assert learnt[3.0][1] == pytest.approx(1, rel=1e-6)


def test_a_load_that_would_slacken_a_tendon_raises_the_pretension_within_its_limit(lib):
    bounds, curves = [0.06, 0.02, 0.3], [[0.2, -0.03, 0.05]] * 2
    plan = np.array([0.06, 0.0, 0.0])
    seen = []
    for _ in range(300):
        plan = lib.antagonistic_pretension(plan, 0.2, 0.0, curves, bounds, 300.0, 1 / 3000).plan_next
        seen.append(plan)

    assert np.array(seen)[:, 0].max() <= 0.12 + 1e-12
    assert (np.diff(np.array(seen)[:, 0]) >= 0).all()
    assert plan == pytest.approx([0.12, 0, 0], abs=1e-6)
    for _ in range(300):
        plan = lib.antagonistic_pretension(plan, 5.0, 0.0, curves, bounds, 300.0, 1 / 3000).plan_next
    assert plan[0] == pytest.approx(0.3)


def test_the_pretension_for_a_stiffness_gives_the_springs_this_stiffness(lib, joint):
    wanted, plan = 2 * float(joint.slopes(30.0 * joint.arm).mean()), np.zeros(3)
    bounds = [0.01, 0.0, 1.0]
    for _ in range(600):
        plan = lib.antagonistic_pretension(plan, 0.0, wanted, joint.tendons, bounds, 300.0, 1 / 3000).plan_next

    assert plan[0] == pytest.approx(30.0 * joint.arm, rel=1e-6)


def test_motors_on_springs_of_their_own_leave_the_stiffness_to_the_tendons(rows):
    for row in of(rows, "motor_pd", "as known"):
        assert row.score.settling < 0.040
        assert abs(row.score.stiffness) > 0.1


def test_the_printed_decoupling_lets_a_tendon_go_slack_and_the_exact_law_does_not(rows):
    assert all(row.score.slack > 0 for row in of(rows, "backstepping_decoupled", "as known"))
    assert all(row.score.slack == 0 for row in of(rows, "backstepping_antagonistic"))


def test_two_comparisons_give_the_same_numbers(lib, hand):
    first, second = (compare(lib, hand, [BEST], forces=[10.0], plants=["as known"]) for _ in range(2))

    assert first == second


# -- the clock ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_every_laws_own_gains_run_on_the_clock_with_half_a_sample_to_spare(lib, hand, joint, law):
    ((_, found), *_) = clocks(lib, hand, [law])

    assert found.runs
    assert found.radius < 1
    assert found.margin > 0.5 / 3000


def test_gains_that_run_on_the_plant_as_known_are_unstable_on_a_wrong_one_which_is_named(lib, joint):
    law, plant = LAWS["motor_pd"], "link x0.7, damping x0.5, friction x0.7"
    found = clocked(lib, law, law.gains_for(joint), joint, 10.0, {"as known": {}, plant: FAMILY[plant]})

    assert found.radius > 1
    assert found.at["radius"] == plant
    assert found.plants == 2
    assert found.runs == (found.cycle <= 1e-3)


def test_a_law_that_only_hunts_is_not_called_unstable(lib, joint):
    found = clocked(lib, BEST, BEST.gains_for(joint), joint, 20.0)
    hunting = replace(found, radius=1.01, cycle=1e-4)

    assert hunting.runs
    assert "hunting by 0.0001 rad" in hunting.reason
    assert not replace(hunting, cycle=2e-3).runs
    assert "runs away on the plant 'as known'" in replace(hunting, cycle=float("inf")).reason


def test_a_loop_that_is_called_unstable_is_unstable_when_it_runs(lib, joint):
    law = LAWS["motor_pd"]
    gains = law.gains_with({"kp": 20000.0})
    assert clocked(lib, law, gains, joint, 10.0).radius > 1

    values = values_of(joint, joint.believed(), 10.0) | law.values(lib, joint.believed(), 10.0, gains)
    values["x"][2] += 1e-3
    sliding = values | {"friction": joint.friction * [1, 0, 1], "known_friction": joint.friction * [1, 0, 0.9]}
    (trace,) = simulate(lib, loop_around(joint, list(law.blocks)).exact(), [Scenario(sliding, 1500)], ["x"])

    assert trace.done < 1500 or np.abs(trace["x"][-100:, 2]).max() > 1


def test_gains_that_cannot_run_are_refused_with_the_reason_and_the_nearest_that_do(lib, joint):
    law = LAWS["motor_pd"]
    gains = law.gains_with({"kp": 20000.0})

    with pytest.raises(InputError) as refused:
        require_clocked(lib, law, gains, joint, 10.0)

    found = running_gains(lib, law, gains, joint, 10.0)
    assert found.runs
    assert found.margin > 0.9 / 3000  # with something to spare
    assert "hunting (spectral radius 1.096) at 3000 Hz and one sample of delay" in str(refused.value)
    changed = [f"{name} = {value:.4g}" for name, value in found.gains.items() if value != gains[name]]
    assert f"the nearest that run have {', '.join(changed)} (" in str(refused.value)


def test_gains_that_only_amplify_noise_are_refused_too(lib, joint):
    found = clocked(lib, BEST, BEST.gains_with({"K_3": 2000.0, "K_4": 2000.0}), joint, 10.0)

    assert found.radius < 1
    assert not found.runs
    assert "the sensors' noise alone" in found.reason


def test_the_printed_damping_of_the_impedance_is_refused(lib, joint):
    """K_d = 0.05 N m s/rad on a link of some 1e-5 kg m^2 asks for a pole that no clock of 3 kHz can have."""
    found = clocked(lib, BEST, BEST.gains_with({"K_d": 0.05}), joint, 10.0)

    assert not found.runs
    assert found.radius > 1


# -- bad input ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_gains_that_are_not_positive_numbers_are_refused_by_name(law, bad):
    for name in law.gains:
        with pytest.raises(InputError, match=f"{law.name}: the gain {name} = "):
            law.gains_with({name: bad})


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_reference_far_beyond_the_motors_leaves_torques_within_their_limit_and_is_recovered_from(lib, joint, law):
    ticks, goal = 6000, np.zeros((6000, 5))
    goal[100:700, 0] = 1.0
    values = values_of(joint, joint.believed(), 20.0) | law.values(lib, joint.believed(), 20.0, law.gains_with({}))
    values.pop("goal")
    (trace,) = simulate(
        lib, loop_around(joint, list(law.blocks)), [Scenario(values, ticks, {"goal": goal})], ["x", "u", "wanted"]
    )

    assert np.abs(trace["wanted"]).max() > joint.limit
    assert np.abs(trace["u"]).max() <= joint.limit
    assert trace.done == ticks
    assert np.isfinite(trace["x"]).all()
    assert np.abs(trace["x"][-300:, 0]).max() < 0.02


def test_the_law_fails_while_a_stiffness_is_singular_and_then_recovers(lib, joint):
    ticks, impedance = 1500, np.tile([0.5, 0.003], (1500, 1))
    impedance[300:330, 0] = 0.0
    values = values_of(joint, joint.believed(), 20.0) | BEST.values(lib, joint.believed(), 20.0, BEST.gains_with({}))
    values.pop("impedance")
    loop = loop_around(joint, list(BEST.blocks))
    (trace,) = simulate(lib, loop, [Scenario(values, ticks, {"impedance": impedance})], ["x", "u", "tau"])

    assert trace.refused == 30
    assert trace["u"][302:330] == pytest.approx(0)
    assert trace.status == 0
    assert np.abs(trace["x"][-300:, 0]).max() < 0.01
    assert trace["tau"][-300:].mean() == pytest.approx(20.0 * joint.arm, rel=0.02)


def test_a_sensor_failure_commands_zero_and_the_loop_recovers(lib, joint):
    """The load, as the law is told, is no number for 10 ms."""
    ticks, told = 1500, np.zeros(1500)
    told[300:330] = np.nan
    law = [*BEST.blocks[:-1], type(BEST.blocks[-1])(
        BEST.blocks[-1].kernel, {**BEST.blocks[-1].wires, "external": ("told", "nothing")}
    )]  # fmt: skip
    values = values_of(joint, joint.believed(), 20.0) | BEST.values(lib, joint.believed(), 20.0, BEST.gains_with({}))
    (trace,) = simulate(lib, loop_around(joint, law), [Scenario(values, ticks, {"told": told})], ["x", "u"])

    assert trace.refused == 30
    assert trace["u"][302:330] == pytest.approx(0)
    assert np.abs(trace["x"][-300:, 0]).max() < 0.01


# -- printed gains ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def printed(lib):
    return {(each.where, each.plant): each for each in printed_gains(lib)}


def test_the_printed_impedance_cannot_run_on_the_clock_for_its_damping_asks_for_a_pole_at_k_d_over_m(printed):
    for where in ("figure 15.16", "figure 15.17"):
        for plant in ("table 15.1", "table 16.1"):
            found = printed[where, plant]

            assert not found.report.implementable
            assert found.report.delay_margin == pytest.approx(22.5e-6, rel=0.01)
            assert np.abs(found.report.poles).max() == pytest.approx(0.05 / 7.2e-7, rel=0.01)


def test_the_gains_of_figure_15_13_are_stable_on_the_clock_for_one_of_two_plants(printed):
    assert printed["figure 15.13", "table 15.1"].report.delay_margin == pytest.approx(0.399e-3, rel=0.01)
    assert printed["figure 15.13", "table 15.1"].report.radius == pytest.approx(1.107, abs=1e-3)
    assert printed["figure 15.13", "table 16.1"].report.implementable


def test_near_the_printed_sets_run_such_with_a_damping_of_a_thousandth_unless_the_spring_is_too_stiff(printed):
    refused = [each for each in printed.values() if not each.report.implementable]

    assert len(refused) == 6
    assert all(each.cells()[-1] == "refused" for each in refused)
    assert [each.plant for each in refused if each.nearest is None] == ["table 15.1"] * 3  # it rings at 840 Hz
    near = printed["figure 15.16", "table 16.1"].nearest
    assert near.gains["K_p"] == 0.5
    assert 5e-4 < near.gains["K_d"] < 2e-3
