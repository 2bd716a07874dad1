"""The friction observer (chapter 9): a low-pass of the friction that needs no acceleration and is always stable."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from proofs import vanishes

from awiwi_gen.definitions.friction_observer import friction_observer

PERIOD, INERTIA = 1 / 3000, 2e-3
NAMES = "momentum u tau thd B gain period"


def stepped(**values):
    """Momentum and friction after a step of the definition, in symbols or with some of them replaced."""
    return friction_observer(None, *(sympy.Matrix([values.get(name, sympy.Symbol(name))]) for name in NAMES.split()))


def test_without_acceleration_the_estimate_follows_the_friction():
    t, gain, B = sympy.symbols("t L B")
    u, tau, friction, z, thd = (sympy.Function(name)(t) for name in ("u", "tau", "friction", "z", "thd"))
    estimate = gain * (z - B * thd)

    rate = estimate.diff(t).subs(z.diff(t), u - tau - estimate).subs(thd.diff(t), (u - tau - friction) / B)

    assert sympy.expand(rate - gain * (friction - estimate)) == 0


def test_eq_9_2_without_its_hat_says_that_the_estimate_is_the_friction_itself():
    u, B, thdd, tau, friction, estimate = sympy.symbols("u B thdd tau friction estimate")

    printed = sympy.solve([u - B * thdd - tau - estimate, u - B * thdd - tau - friction], [estimate, u], dict=True)

    assert sympy.expand(printed[0][estimate] - friction) == 0  # nothing is observed, and L plays no part


def test_with_its_hat_eq_9_2_is_the_low_pass():
    s, gain, B, friction = sympy.symbols("s L B friction")
    thd, model, estimate, free = sympy.symbols("thd model estimate free")

    found = sympy.solve(
        [B * s * thd - free + friction, B * s * model - free + estimate, estimate + gain * B * (thd - model)],
        [thd, model, estimate], dict=True,
    )[0]  # fmt: skip

    assert vanishes(found[estimate] / friction - gain / (s + gain))


def test_over_a_sample_it_is_the_implicit_low_pass_of_the_mean_friction():
    before, mean, start = sympy.symbols("before mean start")
    u, tau, B, gain, period = sympy.symbols("u tau B gain period")
    momentum = before / gain + B * start  # what gave the estimate at the start of the sample
    end = start + period / B * (u - tau - mean)  # the motor's momentum, exactly

    _, after, _ = stepped(momentum=momentum, thd=end)

    assert vanishes(after - (before + gain * period * mean) / (1 + gain * period))


def test_its_memory_and_its_estimate_agree_after_every_sample():
    momentum, friction, _ = stepped()
    B, gain, thd = sympy.symbols("B gain thd")

    assert vanishes(gain * (momentum - B * thd) - friction)


def test_its_pole_lies_between_0_and_1_for_every_gain_and_period():
    gain, period = sympy.symbols("gain period", positive=True)

    pole = sympy.factor(stepped(gain=gain, period=period)[0].diff(sympy.Symbol("momentum")))

    assert vanishes(pole - 1 / (1 + gain * period))
    assert pole.is_positive
    assert sympy.factor(1 - pole).is_positive


def run(lib, friction, gain, torque, quantum=0.0):
    """Estimates along the exact motion of a motor under torques and frictions that last a sample each."""
    thd, momentum, found = 0.0, 0.0, []
    for pushing, rubbing in zip(torque, friction, strict=True):
        thd += PERIOD / INERTIA * (pushing - rubbing)
        seen = np.round(thd / quantum) * quantum if quantum else thd
        momentum, estimate, status = lib.friction_observer(momentum, pushing, 0.0, seen, INERTIA, gain, PERIOD)
        assert status == 0
        found.append(float(estimate))
    return np.array(found)


def test_the_estimate_comes_to_rest_at_the_friction_without_overshoot(lib):
    found = run(lib, np.full(1500, 0.4), 100.0, np.full(1500, 0.5))

    assert np.isclose(found[-1], 0.4, rtol=1e-12)
    assert np.all(np.diff(found) > -1e-15)
    assert np.isclose(found[29], 0.4 * (1 - (1 + 100 * PERIOD) ** -30), rtol=1e-12)


@pytest.mark.parametrize("gain", [1.0, 100.0, 6001.0, 1e5, 1e9])
def test_no_gain_is_too_high_for_3_khz(lib, gain):
    friction = np.random.default_rng(0).uniform(-1, 1, 500)

    found = run(lib, friction, gain, np.zeros(500))

    assert np.abs(found).max() <= 1 + 1e-6
    if gain == 1e9:
        assert np.allclose(found, friction, atol=1e-4)


def test_an_explicit_step_would_be_unstable_where_this_one_is_not(lib):
    gain, estimate = 2.5 / PERIOD, 0.0
    for _ in range(60):
        estimate += PERIOD * gain * (0.4 - estimate)

    assert abs(estimate) > 1e6
    assert np.isclose(run(lib, np.full(60, 0.4), gain, np.zeros(60))[-1], 0.4)


def test_a_coarse_velocity_sensor_moves_the_estimate_by_its_step_at_most(lib):
    gain, quantum = 200.0, 0.05
    friction, torque = np.full(1500, 0.3), np.random.default_rng(1).uniform(-1, 1.6, 1500)

    fine, coarse = (run(lib, friction, gain, torque, step) for step in (0.0, quantum))

    assert 0 < np.abs(fine - coarse).max() <= gain * INERTIA * quantum


def test_fed_forward_it_takes_the_friction_out_of_the_tracking_error(lib):
    def worst(compensate):
        thd, theta, momentum, estimate, error = 0.0, 0.0, 0.0, 0.0, 0.0
        for step in range(4500):
            t = step * PERIOD
            wanted, speed = 0.5 * np.sin(2 * np.pi * t), np.pi * np.cos(2 * np.pi * t)
            torque = 5.0 * (wanted - theta) + 0.2 * (speed - thd) + (estimate if compensate else 0.0)
            thd += PERIOD / INERTIA * (torque - 0.3 * np.tanh(thd / 0.2))
            theta += PERIOD * thd
            momentum, estimate, _ = lib.friction_observer(momentum, torque, 0.0, thd, INERTIA, 200.0, PERIOD)
            error = max(error, abs(wanted - theta) if t > 0.5 else 0.0)
        return error

    assert worst(compensate=True) < 0.35 * worst(compensate=False)


@pytest.mark.parametrize(("port", "bad"), [("B", 0.0), ("gain", -1.0), ("period", 0.0), ("gain", np.nan)])
def test_parameters_that_make_no_observer_are_refused(lib, port, bad):
    given = {"momentum": 0.0, "u": 0.1, "tau": 0.0, "thd": 0.0, "B": INERTIA, "gain": 100.0, "period": PERIOD}

    assert lib.friction_observer(**given).status == 0
    assert lib.friction_observer(**given | {port: bad}).status == 1


def test_what_is_not_a_number_is_not_hidden(lib):
    found = lib.friction_observer(0.0, np.nan, 0.0, 0.0, INERTIA, 100.0, PERIOD)

    assert np.isnan(found.friction)
    assert np.isnan(found.momentum_next)
