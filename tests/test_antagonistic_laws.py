"""What makes a law work on a joint between two tendons: its proof with what it must overcome, its observer, its filter."""

from __future__ import annotations

import numpy as np
import pytest
from proofs import column, rate, shifts, spelled_out, vanishes
from sympy import Matrix, symbols

from awiwi_gen.definitions.backstepping.adaptive import adaptive_law, backstepping_adaptive

PERIOD = 1 / 3000
INERTIAS, TENDONS = (2e-5, 2e-3, 3e-3), np.array([(0.3, 0.2, 1.0), (0.4, 0.1, 2.0)])
NONE = (10.0, 0.0, 0.0)
BANDWIDTHS = (600.0, 400.0, 1000.0, 20.0)

# -- the law ------------------------------------------------------------------------------------------------

JOINT = q, qd = column("q qd")
TORQUES = tau1, tau1d, tau2, tau2d = column("tau1 tau1d tau2 tau2d")
DESIRED, PRETENSION = column("r:5"), column("o:3")
EXTERNAL = tau_ext, _ = column("tau_ext tau_extd")
MASSES = m, b1, b2 = column("m b1 b2")
SPRINGS = s1, c1, s2, c2 = column("slope1 curvature1 slope2 curvature2")
d = symbols("d", real=True)
DAMPING = Matrix([d])
IMPEDANCE = K_p, K_d = column("K_p K_d")
TUNINGS = column("K31 K41 Ct1 Cs1 K32 K42 Ct2 Cs2")
GUESS = guess1, guess2 = column("guess1 guess2")


def flow(motors, against):
    """Two motors, each held back by its spring and something else, and a damped link (eq. 15.82)."""
    accelerated = (tau1 - tau2 + tau_ext - d * qd) / m
    stretch1 = c1 * (tau1d / s1) ** 2 + s1 * ((motors[0] - against[0] - tau1) / b1 - accelerated)
    stretch2 = c2 * (tau2d / s2) ** 2 + s2 * ((motors[1] - against[1] - tau2) / b2 + accelerated)
    moving = {q: qd, qd: accelerated, tau1: tau1d, tau1d: stretch1, tau2: tau2d, tau2d: stretch2}
    return moving | shifts(DESIRED, PRETENSION, EXTERNAL)


def test_the_energy_falls_but_for_the_load_and_for_what_is_guessed_wrong():
    law = adaptive_law(JOINT, TORQUES, DESIRED, PRETENSION, EXTERNAL, MASSES, SPRINGS, d, IMPEDANCE, TUNINGS)
    motors, _ = backstepping_adaptive(
        None, JOINT, TORQUES, DESIRED, PRETENSION, EXTERNAL, MASSES, SPRINGS, DAMPING, IMPEDANCE, TUNINGS, GUESS
    )
    against = column("against1 against2")
    (et1, et2), (es1, es2) = law.errors
    K31, K41, Ct1, Cs1, K32, K42, Ct2, Cs2 = TUNINGS
    speed = qd - DESIRED[1]
    lost = (K_d + d) * speed**2 + Ct1 * K31 * et1**2 + Ct2 * K32 * et2**2 + Cs1 * K41 * es1**2 + Cs2 * K42 * es2**2
    wrong = Cs1 * es1 * s1 / b1 * (guess1 - against[0]) + Cs2 * es2 * s2 / b2 * (guess2 - against[1])

    rises = rate(law.energy, flow([spelled_out(motor) for motor in motors], against))

    assert vanishes(rises + lost - speed * tau_ext - wrong)


def test_at_rest_under_a_load_the_link_yields_by_the_load_over_the_stiffness():
    """All errors vanish there, so the torque on the link is its virtual control: minus the load."""
    law = adaptive_law(JOINT, TORQUES, DESIRED, PRETENSION, EXTERNAL, MASSES, SPRINGS, d, IMPEDANCE, TUNINGS)
    still = {qd: 0, **dict.fromkeys(DESIRED, 0), **dict.fromkeys(PRETENSION[1:], 0), **dict.fromkeys((tau1d, tau2d), 0)}
    target = [spelled_out(torque).subs(still) for torque in law.targets[0]]

    assert vanishes(target[0] - target[1] + K_p * q)
    assert vanishes(target[0] + target[1] - 2 * PRETENSION[0])


# -- the observer -------------------------------------------------------------------------------------------


def observed(lib, memory, true=TENDONS, known=TENDONS, theta=(0.5, 0.5)):
    """The observer's results for a joint that rests at zero, by its true tendons and those that are known."""
    given = {
        "thetas": theta, "stretches": theta, "acted": pulls(true, theta), "acting": pulls(true, theta),
        "measured": pulls(true, theta), "inertias": INERTIAS, "tendons": known, "damping": 0.0,
        "friction": NONE, "bandwidths": BANDWIDTHS, "period": PERIOD,
    }  # fmt: skip
    return lib.antagonistic_observer(memory=memory, **given)


def pulls(tendons, stretches):
    return np.array([spring @ np.array(p) ** [1, 2, 3] for spring, p in zip(tendons, stretches, strict=True)])


def at_rest(true=TENDONS, theta=(0.5, 0.5)):
    return np.array([0, 0, 0, theta[0], 0, 0, theta[1], 0, 0, *pulls(true, theta), 1, 1])


@pytest.mark.parametrize(("first", "bandwidth"), [(0, BANDWIDTHS[0]), (3, BANDWIDTHS[1]), (6, BANDWIDTHS[1])])
def test_errors_of_every_motion_die_out_with_a_triple_pole(lib, first, bandwidth):
    columns = []
    for place, step in zip(range(first, first + 3), (1e-6, 1e-4, 1e-2), strict=True):
        up, down = at_rest(), at_rest()
        up[place] += step
        down[place] -= step
        change = observed(lib, up).memory_next - observed(lib, down).memory_next
        columns.append(change[first : first + 3] / (2 * step))

    characteristic = np.poly(np.array(columns).T)

    assert characteristic == pytest.approx(np.poly([np.exp(-bandwidth * PERIOD)] * 3), rel=1e-6)


def test_a_joint_that_rests_is_left_alone(lib):
    same = np.array([TENDONS[0], TENDONS[0]])
    memory = np.array([0, 0, 0, 0.5, 0, 0, 0.5, 0, 0, *pulls(same, (0.5, 0.5)), 1, 1])

    seen = observed(lib, memory, same, known=same)

    assert seen.memory_next == pytest.approx(memory, abs=1e-12)
    assert seen.joint == pytest.approx([0, 0], abs=1e-12)
    assert seen.load == pytest.approx(0, abs=1e-12)
    assert seen.resistance == pytest.approx([0, 0], abs=1e-12)


def test_the_springs_are_learnt_from_the_pretension_alone(lib):
    true = TENDONS * np.array([[0.7], [1.3]])
    memory = at_rest(true)
    for _ in range(3000):
        memory = observed(lib, memory, true).memory_next

    assert memory[11:] == pytest.approx([0.7, 1.3], rel=1e-6)
    slopes = np.array([k1 + 2 * k2 * 0.5 + 3 * k3 * 0.25 for k1, k2, k3 in true])
    assert observed(lib, memory, true).springs[:, 0] == pytest.approx(slopes, rel=1e-6)


# -- the reference filter -----------------------------------------------------------------------------------


def filtered(lib, goal, delay, ticks):
    motion, seen = np.zeros(5), []
    for tick in range(ticks):
        motion = lib.reference_filter(motion, goal(tick * PERIOD), delay, PERIOD).motion_next
        seen.append(motion)
    return np.array(seen)


def test_a_jump_arrives_within_a_percent_after_less_than_twice_the_delay(lib):
    position = filtered(lib, lambda _: np.array([1.0, 0, 0, 0, 0]), 0.022, 600)[:, 0]
    off = np.flatnonzero(np.abs(position - 1) > 0.02)

    assert (off[-1] + 1) * PERIOD < 2 * 0.022
    assert position.max() < 1.01
    assert position[-1] == pytest.approx(1, abs=1e-6)


def test_a_goal_with_its_derivatives_is_followed_once_the_start_is_forgotten(lib):
    w = 2 * np.pi * 2

    def goal(t):
        s, c = np.sin(w * t), np.cos(w * t)
        return np.array([s, w * c, -(w**2) * s, -(w**3) * c, w**4 * s])

    moved = filtered(lib, goal, 0.022, 1500)

    wanted = np.array([goal((tick + 1) * PERIOD) for tick in range(1500)])
    assert np.abs(moved - wanted)[-1, :2] == pytest.approx([0, 0], abs=1e-3)


@pytest.mark.parametrize(("delay", "period"), [(0.0, PERIOD), (-1.0, PERIOD), (0.02, 0.0), (np.nan, PERIOD)])
def test_a_delay_or_a_period_that_is_not_positive_is_refused(lib, delay, period):
    assert lib.reference_filter(np.zeros(5), np.ones(5), delay, period).status == 1


# -- the linear laws ----------------------------------------------------------------------------------------


def test_the_setpoint_of_a_motion_is_where_the_plant_makes_that_motion(lib):
    """With linear springs: their plant accelerates the link, and both motors, as the setpoint says."""
    linear, pretension = np.array([(0.3, 0, 0), (0.4, 0, 0)]), 0.1
    rest = pretension / linear[:, 0]
    desired = np.array([0.2, 1.0, 30.0, 400.0, 2e4])

    found = lib.antagonistic_setpoint(desired, (pretension, 0, 0), rest, linear[:, 0], INERTIAS, 1e-3)
    xd = lib.plant_antagonistic(found.x_des, found.u_des, 0.0, INERTIAS, linear, 1e-3, NONE).xd
    later = lib.antagonistic_setpoint(
        desired + 1e-6 * np.append(desired[1:], 0), (pretension, 0, 0), rest, linear[:, 0], INERTIAS, 1e-3
    )

    assert xd[1] == pytest.approx(desired[2])
    assert xd[:5] == pytest.approx((later.x_des - found.x_des)[:5] / 1e-6, rel=1e-4)


def test_modes_and_shares_take_a_pair_apart_and_put_it_together(lib):
    against, together = lib.antagonistic_modes(np.array([[0.5, 1.0], [0.1, -2.0]]))
    shares = lib.antagonistic_sharing(0.06, (0.1, 0, 0))

    assert against + together == pytest.approx([0.5, 1.0])
    assert together - against == pytest.approx([0.1, -2.0])
    assert shares[0] - shares[1] == pytest.approx(0.06)
    assert shares.mean() == pytest.approx(0.1)
