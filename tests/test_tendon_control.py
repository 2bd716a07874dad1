"""Control of a tendon's force: what holds of the mended equations of chapter 10, and where the printed ones fail."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from sympy import Function, S, diff, simplify, solve, symbols

from awiwi_gen.definitions.tendon_force import effort, scheduled_gains

B, kp, kd, r, omega, xi = symbols("B k_p k_d r omega xi", positive=True)
f, fd, f_des, fd_des, friction, load = symbols("f fd f_des fd_des friction load", real=True)
theta, speed, goal = symbols("theta speed goal", real=True)


def accelerated(tau, opposing):
    """Motor acceleration under the torque tau."""
    return (tau - opposing) / B


def law(force=f, rate=fd, f_hat=f, estimate=friction):
    return effort(kp, kd, f_des - force, fd_des - rate, r, f_hat, estimate)


# -- the law -----------------------------------------------------------------------------------------------


def test_exact_estimates_leave_only_the_errors():
    moved = accelerated(law(), friction + r * f)

    assert simplify(B * moved - (kp * (f_des - f) + kd * (fd_des - fd))) == 0


def test_the_printed_signs_double_what_they_mean_to_remove():
    printed_law = kp * (f_des - f) + kd * (fd_des - fd) + friction + load
    printed_plant = friction + printed_law + load

    assert simplify(printed_plant - (kp * (f_des - f) + kd * (fd_des - fd))) == 2 * friction + 2 * load


def test_what_the_estimates_miss_is_left_as_a_steady_error():
    guess, guessed_force = symbols("guess guessed_force", real=True)
    still = law(rate=0, f_hat=guessed_force, estimate=guess).subs(fd_des, 0) - friction - r * f
    error = solve(still.subs(f_des, f + symbols("e")), symbols("e"))[0]

    missed = (friction - guess + r * (f - guessed_force)) / kp
    assert simplify(error - missed) == 0
    assert simplify(error.subs({guess: 0, guessed_force: 0}) - (friction + r * f) / kp) == 0


def test_any_positive_gains_are_stable_everywhere_on_a_stiff_tendon():
    """V = B speed^2/2 + kp (energy of the tendon from the goal) falls by kd (slope of the force) speed^2."""
    curve = Function("curve")
    s = symbols("s")
    energy = B * speed**2 / 2 + kp * sympy.Integral(curve(s) - curve(goal), (s, goal, theta))
    slope = diff(curve(theta), theta)
    torque = kp * (curve(goal) - curve(theta)) - kd * slope * speed
    rate = diff(energy, theta) * speed + diff(energy, speed) * torque / B

    assert simplify(rate.doit() + kd * slope * speed**2) == 0


# -- gains from the slope ----------------------------------------------------------------------------------


def linearised(gains):
    """Coefficients of B x'' + c1 x' + c0 x for a small error x of the motor angle on a moving reference."""
    curve = Function("curve")
    x, v = symbols("x v")
    force, rate = curve(goal + x), diff(curve(goal + x), x) * (speed + v)
    wanted, wanted_rate = curve(goal), diff(curve(goal), goal) * speed
    pull = gains[0] * (force - wanted) + gains[1] * (rate - wanted_rate)
    at_rest = {x: 0, v: 0}
    c0 = simplify(diff(pull, x).subs(at_rest).doit())
    c1 = simplify(diff(pull, v).subs(at_rest).doit())
    return c0, c1, diff(curve(goal), goal), diff(curve(goal), goal, 2) * speed


def test_scheduled_gains_place_the_poles_even_while_the_reference_moves():
    _, _, alpha, beta = linearised((kp, kd))
    c0, c1, _, _ = linearised(scheduled_gains(B, alpha, beta, omega, xi))

    assert simplify(c0 - B * omega**2) == 0
    assert simplify(c1 - 2 * xi * omega * B) == 0


def test_the_rate_of_the_slope_belongs_to_the_proportional_term_and_not_to_the_derivative_one():
    c0, c1, alpha, beta = linearised((kp, kd))

    assert simplify(c0 - (kp * alpha + kd * beta)) == 0
    assert simplify(c1 - kd * alpha) == 0  # eq. 10.9 prints kd beta here


def test_the_printed_proportional_gain_divides_by_zero_where_the_reference_rests():
    _, _, _, beta = linearised((kp, kd))
    printed = omega**2 * B / symbols("beta")

    assert beta.subs(speed, 0) == 0
    assert printed.subs(symbols("beta"), 0) == S.ComplexInfinity


def test_fixed_gains_damp_more_the_stiffer_the_tendon():
    """Section 10.2 calls both sides of the tuning point underdamped."""
    alpha = symbols("alpha", positive=True)
    frequency = sympy.sqrt(kp * alpha / B)
    ratio = kd * alpha / B / (2 * frequency)

    assert simplify(ratio - kd / 2 * sympy.sqrt(alpha / (kp * B))) == 0
    assert simplify(diff(ratio, alpha) * 2 * alpha / ratio) == 1


def test_gains_scheduled_by_the_measured_force_are_the_same_law_at_rest():
    """Section 10.3.3 says otherwise; the gains' slope multiplies an error that is zero there."""
    curve, scheduled = Function("curve"), Function("scheduled")
    pull = scheduled(theta) * (curve(theta) - curve(goal))

    assert simplify((diff(pull, theta) - scheduled(goal) * diff(curve(theta), theta)).subs(theta, goal).doit()) == 0


# -- the kernels -------------------------------------------------------------------------------------------

SCHEDULED = {
    "f": 20.0, "fd": 10.0, "f_des": 30.0, "fd_des": 0.0, "f_hat": 20.0, "friction": 0.1, "r": 0.004, "b": 2e-3,
    "stiffness": 8000.0, "stiffness_rate": 0.0, "omega0": 200.0, "xi0": 1.0,
}  # fmt: skip


def test_the_scheduled_kernel_gives_the_motor_the_poles_asked_for(lib):
    for stiffness in (2000.0, 8000.0, 25000.0):
        got = lib.tendon_force_scheduled(**SCHEDULED | {"stiffness": stiffness})
        slope = SCHEDULED["r"] * stiffness
        poles = np.roots([SCHEDULED["b"], got.gains[1] * slope, got.gains[0] * slope])

        assert got.status == 0
        assert poles == pytest.approx([-200, -200], rel=1e-6)


def test_the_scheduled_kernel_is_the_fixed_one_with_its_own_gains(lib):
    got = lib.tendon_force_scheduled(**SCHEDULED)
    shared = {name: SCHEDULED[name] for name in ("f", "fd", "f_des", "fd_des", "f_hat", "friction", "r")}
    same = lib.tendon_force_pd(**shared, kp=got.gains[0], kd=got.gains[1])

    assert got.tau == pytest.approx(same.tau, rel=1e-14)


@pytest.mark.parametrize(
    "change",
    [
        {"stiffness": 0.0}, {"stiffness": -1.0}, {"b": 0.0}, {"r": 0.0}, {"omega0": 0.0}, {"xi0": -1.0},
        {"stiffness_rate": 1e6}, {"stiffness": np.nan}, {"omega0": np.nan},
    ],
    ids=str,
)  # fmt: skip
def test_what_cannot_be_tuned_is_refused(lib, change):
    assert lib.tendon_force_scheduled(**SCHEDULED | change).status == 1


@pytest.mark.parametrize("gains", [(0.0, 1e-3), (1e-2, -1e-3), (np.nan, 1e-3)])
def test_gains_that_are_not_positive_are_refused(lib, gains):
    shared = {name: SCHEDULED[name] for name in ("f", "fd", "f_des", "fd_des", "f_hat", "friction", "r")}

    assert lib.tendon_force_pd(**shared, kp=gains[0], kd=gains[1]).status == 1


# -- steps at every working point (figures 10.2, 10.3) -----------------------------------------------------

POINTS = np.array([10.0, 20.0, 30.0, 45.0, 60.0])  # N, where each step of 5 N ends
MOTOR, LINE = (2e-3, 0.004), np.array([3000.0, 1.2e5, 2e7])  # a spring that is three times as stiff at 60 N as at 10 N
FREQUENCY, TICK, SUBSTEPS = 150.0, 1 / 3000, 10


def stretch(force):
    """Elongation [m] under a force, by Newton's method."""
    x = force / LINE[0]
    for _ in range(30):
        x = x - (x * (LINE[0] + x * (LINE[1] + x * LINE[2])) - force) / slope_at(x)
    return x


def slope_at(x):
    return LINE[0] + 2 * LINE[1] * x + 3 * LINE[2] * x**2


def stepped(lib, gains):
    """Forces (ticks, points) of all steps at once, with a torque one sample late; gains as a function of the slope."""
    x = np.stack([stretch(POINTS - 5) / MOTOR[1], np.zeros(len(POINTS))], axis=-1)
    u, seen = MOTOR[1] * (POINTS - 5), []
    for _ in range(400):
        f, slope = lib.plant_tendon(x, u, 0.0, MOTOR, LINE, (10.0, 0.0, 0.0)).f, slope_at(MOTOR[1] * x[:, 0])
        wanted = gains(f, slope * MOTOR[1] * x[:, 1])
        seen.append(f)
        for _ in range(SUBSTEPS):
            xd = lib.plant_tendon(x, u, 0.0, MOTOR, LINE, (10.0, 0.0, 0.0)).xd
            x[:, 1] += TICK / SUBSTEPS * xd[:, 1]
            x[:, 0] += TICK / SUBSTEPS * x[:, 1]
        u = wanted
    return np.array(seen)


def overshoots(forces):
    return (forces.max(axis=0) - POINTS) / 5


def settlings(forces):
    off = np.abs(forces - POINTS) > 0.1
    return TICK * (len(off) - np.argmax(off[::-1], axis=0))


def with_scheduled_gains(lib):
    def gains(f, fd):
        return lib.tendon_force_scheduled(
            f, fd, POINTS, 0.0, f, 0.0, MOTOR[1], MOTOR[0], slope_at(stretch(POINTS)), 0.0, FREQUENCY, 1.0
        ).tau  # fmt: skip

    return gains


def with_gains_for_30_newton(lib):
    slope = MOTOR[1] * slope_at(stretch(30.0))
    kp, kd = MOTOR[0] * FREQUENCY**2 / slope, 2 * MOTOR[0] * FREQUENCY / slope

    def gains(f, fd):
        return lib.tendon_force_pd(f, fd, POINTS, 0.0, f, 0.0, MOTOR[1], kp, kd).tau

    return gains


def test_scheduled_gains_step_alike_at_every_working_point(lib):
    forces = stepped(lib, with_scheduled_gains(lib))

    assert forces[-1] == pytest.approx(POINTS, abs=1e-3)
    assert overshoots(forces).max() < 0.03
    assert np.ptp(settlings(forces)) < 0.2 * settlings(forces).min()


def test_gains_for_30_newton_ring_where_the_tendon_is_softer_and_creep_where_it_is_stiffer(lib):
    forces = stepped(lib, with_gains_for_30_newton(lib))
    over, settled = overshoots(forces), settlings(forces)

    assert forces[-1] == pytest.approx(POINTS, abs=0.02)
    assert (np.diff(over) <= 1e-9).all()
    assert over[0] > 0.02 > over[2]
    assert np.ptp(settled) > 0.4 * settled.min()
