"""Identification: known numbers come back from noisy recordings, and recordings that cannot tell are refused."""

from __future__ import annotations

import numpy as np
import pytest
from actuators import compiled, hand_text

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.identify import fit_calibration, fit_friction, fit_ripple, fit_unit

ENDS = (410.0, 3685.0)
SLACK, TAUT = 3.25, 3.62


@pytest.fixture(scope="module")
def lib():
    return compiled()


@pytest.fixture
def noise():
    return np.random.default_rng(20120301)


@pytest.fixture
def friction(lib, noise):
    """Mean torques at constant speeds, with 10 mNm of noise."""
    speeds = np.concatenate([[0.01, 0.02, 0.05, 0.1, 0.2, 0.4], np.arange(0.5, 6, 0.5)])
    velocity = np.concatenate([-speeds, speeds])
    return velocity, lib.motor_friction(velocity) + noise.normal(0, 0.01, velocity.shape)


@pytest.fixture
def ripple(lib, noise):
    """One turn of the output at constant speed with its mean torque, at 3 kHz and 1 rad/s, with 20 mNm of noise."""
    theta = np.arange(-np.pi, np.pi, 1 / 3000)
    return theta, lib.motor_ripple(theta).tau + 0.88 + noise.normal(0, 0.02, theta.shape)


@pytest.fixture
def pulled(lib, noise):
    """A tendon pulled and released: counts, elongation with 2 um and force with 50 mN of noise, 4 N of hysteresis."""
    counts = np.concatenate([np.linspace(*ENDS, 300), np.linspace(*ENDS[::-1], 300)]).round()
    dL, force, _, _ = lib.spring_lever(angle(counts))
    hysteresis = np.repeat([2.0, -2.0], 300)
    x = lib.spring_lever(SLACK).dL - dL + noise.normal(0, 2e-6, counts.shape)
    return counts, x, np.maximum(force + hysteresis + noise.normal(0, 0.05, counts.shape), 0)


def angle(counts):
    return SLACK + (TAUT - SLACK) * (counts - ENDS[0]) / (ENDS[1] - ENDS[0])


# -- what comes back --------------------------------------------------------------------------------------


def test_friction_is_identified_from_noisy_torques_within_three_deviations(friction):
    fit = fit_friction(*friction)
    errors = np.array([fit.steepness - 10, fit.level - 0.5586, fit.viscosity - 0.0356])

    assert np.all(np.abs(errors) < 3 * np.array(fit.deviations))
    assert np.all(np.array(fit.deviations) < [1.0, 0.02, 0.004])
    assert fit.residual == pytest.approx(0.01, rel=0.3)


def test_friction_is_identified_exactly_from_exact_torques(lib):
    velocity = np.linspace(-5, 5, 200)
    fit = fit_friction(velocity, lib.motor_friction(velocity))

    assert (fit.steepness, fit.level, fit.viscosity) == pytest.approx((10, 0.5586, 0.0356), rel=1e-7)


@pytest.mark.parametrize("steepness", [0.3, 3.0, 60.0])
def test_friction_of_any_steepness_is_identified(steepness):
    velocity = np.linspace(-10, 10, 401)
    fit = fit_friction(velocity, 0.2 * np.arctan(steepness * velocity) + 0.01 * velocity)

    assert (fit.steepness, fit.level, fit.viscosity) == pytest.approx((steepness, 0.2, 0.01), rel=1e-6)


def test_ripple_is_identified_from_a_noisy_revolution(ripple):
    fit = fit_ripple(*ripple, 100, (1, 2), (1, 3))
    found = [(wave.shaft, wave.harmonic) for wave in fit.waves]
    true = [(0.06, 40), (0.025, -75), (0.03, 10), (0.012, 120)]

    assert found == [("input", 1), ("input", 2), ("output", 1), ("output", 3)]
    for wave, (amplitude, phase) in zip(fit.waves, true, strict=True):
        assert wave.amplitude == pytest.approx(amplitude, abs=4 * fit.deviation)
        assert np.degrees(wave.phase) == pytest.approx(phase, abs=4 * np.degrees(fit.deviation / amplitude))
    assert fit.offset == pytest.approx(0.88, abs=4 * fit.deviation)
    assert fit.deviation < 4e-4


def test_calibration_runs_through_the_middle_of_the_hysteresis(lib, pulled):
    fit = fit_calibration(*pulled, ENDS, float(lib.spring_lever(SLACK).dL))
    counts = np.linspace(*ENDS, 300)
    dL, force, stiffness, status = lib.calibration_polynomials(
        counts, fit.ends, fit.length_powers, fit.force_powers, fit.stiffness_powers
    )
    true = lib.spring_lever(angle(counts))

    assert not status.any()
    assert np.max(np.abs(dL - true.dL)) < 2e-6
    assert np.max(np.abs(force - true.force)) < 0.2  # of 2 N up and 2 N down
    assert np.max(np.abs(stiffness / true.stiffness - 1)) < 0.1
    assert fit.residuals["force"] == pytest.approx(2.0, rel=0.1)
    assert fit.residuals["elongation"] == pytest.approx(2e-6, rel=0.2)


def test_calibration_of_exact_data_has_the_residual_of_degree_6(lib):
    counts = np.linspace(*ENDS, 200)
    dL, force, stiffness, _ = lib.spring_lever(angle(counts))
    fit = fit_calibration(counts, dL[0] - dL, force, ENDS, float(dL[0]))
    read = lib.calibration_polynomials(counts, fit.ends, fit.length_powers, fit.force_powers, fit.stiffness_powers)

    assert np.max(np.abs(read.force - force)) < 1.2e-5 * 100
    assert np.max(np.abs(read.dL - dL)) < 1e-6
    assert np.max(np.abs(read.stiffness / stiffness - 1)) < 1e-3


def test_a_units_own_spring_is_identified_and_fits_into_the_hand_file(noise):
    unit = '\n[[spring.units]]\ntendon = 1\nrate = "6.87 N/mm"\nfree_length = "35.02 mm"\nsource = "bench"\n'
    own = compiled(("[tendon]", unit + "[tendon]"), only="calibration_readings")
    counts = np.linspace(*ENDS, 300)
    force = own.calibration_readings(np.repeat(counts[:, None], 3, axis=1)).force[:, 1]
    spring = Hand.parse(hand_text()).spring
    fit = fit_unit(spring, counts, force + noise.normal(0, 0.5, counts.shape), ENDS)

    assert abs(fit.rate - 6870) < 3 * fit.deviations[0] < 60
    assert abs(fit.free_length - 35.02e-3) < 3 * fit.deviations[1] < 1e-4
    table = f'[[spring.units]]\ntendon = 1\n{fit.toml}\nsource = "bench"\n[tendon]'
    calibrated = Hand.parse(hand_text(("[tendon]", table))).spring.calibrated[1]
    assert float(calibrated.rate) == pytest.approx(fit.rate, rel=1e-5)


def test_identified_parameters_can_be_pasted_into_the_hand_file(friction, ripple):
    text = hand_text()
    old = text[text.index("friction = ") : text.index("compensation = ")]
    waves = text[text.index("[[motor.ripple]]") : text.index("[spring]")]
    new = fit_friction(*friction).toml + "\n"
    motor = Hand.parse(hand_text((old, new), (waves, fit_ripple(*ripple, 100, (1, 2), (1, 3)).toml))).motor

    assert float(motor.friction.level) == pytest.approx(0.5586, rel=0.05)
    assert [wave.harmonic for wave in motor.ripple] == [1, 2, 1, 3]


# -- what is refused --------------------------------------------------------------------------------------


def spoilt(column, index, value):
    column = np.array(column)
    column[index] = value
    return column


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda v, t: (v[:5], t[:5]), "velocity is 5; expected a column of at least 8 numbers"),
        (lambda v, t: (v, t[:-1]), "the columns differ in length: velocity 34, torque 33"),
        (lambda v, t: (spoilt(v, 3, np.nan), t), "velocity[3] = nan is not finite"),
        (lambda v, t: (["fast"] * 9, t), "velocity is not a column of numbers"),
        (lambda v, t: (v, -t), "torque opposes velocity"),
        (lambda v, t: (np.sign(v), t), "fewer than 4 different speeds"),
        (lambda v, t: (v, spoilt(t, 30, 50.0)), "point 30 (velocity 4, torque 50)"),
        (lambda v, t: (v[np.abs(v) > 2], t[np.abs(v) > 2]), "has no values near enough to standstill"),
        (lambda v, t: (v, t - 0.1 * v), "a negative viscosity, -0.0"),
    ],
)
def test_recordings_that_do_not_determine_friction_are_refused(friction, spoil, expected):
    with pytest.raises(InputError) as caught:
        fit_friction(*spoil(*friction))
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda a, t: (a[:4000], t[:4000]), "the slowest ripple has a period of 6.28 rad"),
        (lambda a, t: (np.linspace(-np.pi, np.pi, 101), t[:101]), "too few or too regular to distinguish 4 ripples"),
        (lambda a, t: (a, spoilt(t, 7, 9.0)), "point 7 (theta -3.13926, torque 9)"),
    ],
)
def test_recordings_that_do_not_distinguish_ripples_are_refused(ripple, spoil, expected):
    with pytest.raises(InputError) as caught:
        fit_ripple(*spoil(*ripple), 100, (1, 2), (1, 3))
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda c, x, f: (c[:10], x[:10], f[:10]), "expected a column of at least 14 numbers"),
        (lambda c, x, f: (c[:200], x[:200], f[:200]), "counts cover 67% of the travel"),
        (lambda c, x, f: (spoilt(c, 9, 4095), x, f), "counts[9] = 4095 is beyond the sensor's ends"),
        (lambda c, x, f: (np.where(c < 2000, 410, 3685), x, f), "counts has 2 different readings"),
        (lambda c, x, f: (c, x, spoilt(f, 40, -1.0)), "force[40] = -1 N; a tendon cannot push"),
        (lambda c, x, f: (c, x, spoilt(f, 40, 900.0)), "point 40 (counts 848, force 900)"),
        (lambda c, x, f: (c, spoilt(x, 40, 1.0), f), "point 40 (counts 848, elongation 1)"),
        (lambda c, x, f: (c, x, f[::-1].copy() * 0 + 100 - c / 41), "force does not rise from slack to taut at"),
    ],
)
def test_absurd_calibration_data_are_refused(pulled, spoil, expected):
    with pytest.raises(InputError) as caught:
        fit_calibration(*spoil(*pulled), ENDS, 0.026)
    assert expected in str(caught.value)


def test_a_sensor_without_travel_and_forces_of_no_spring_are_refused(pulled):
    counts, _, force = pulled
    spring = Hand.parse(hand_text()).spring

    with pytest.raises(InputError, match="would measure nothing"):
        fit_unit(spring, counts, force, (410, 410))
    with pytest.raises(InputError, match="a rate of -"):
        fit_unit(spring, counts, -force, ENDS)
