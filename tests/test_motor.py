"""Motors (chapter 3): what drives, what brakes, and what the printed equations get wrong."""

from __future__ import annotations

import numpy as np
import pytest
from actuators import compiled, hand_text
from scipy.integrate import solve_ivp

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand

STEEPNESS, LEVEL, VISCOSITY = 10.0, 0.5586, 0.0356  # table 3.3
INERTIA = 2e-7 * 100**2 + 1e-6


@pytest.fixture(scope="module")
def motor():
    return compiled()


def random(count, *limits):
    generator = np.random.default_rng(3)
    return [generator.uniform(-limit, limit, count) for limit in limits]


def test_friction_is_the_printed_curve(motor):
    (thd,) = random(500, 20)

    assert motor.motor_friction(thd) == pytest.approx(np.arctan(STEEPNESS * thd) * LEVEL + VISCOSITY * thd, rel=1e-15)


def test_dry_friction_tends_to_level_times_half_pi_not_to_level(motor):
    dry = motor.motor_friction(20.0) - 20 * VISCOSITY

    assert dry == pytest.approx(0.8774, abs=3e-3)
    assert dry > 1.5 * LEVEL


def test_the_inertia_at_the_output_counts_the_rotor_ten_thousand_times(motor):
    thd = np.linspace(0.1, 20, 7)

    assert motor.motor_energy(thd) == pytest.approx(INERTIA * thd**2 / 2, rel=1e-15)
    # A rotor of 2e-8 kg m^2 is the 2e-4 kg m^2 of table 15.1, if the ratio of eq. 3.1 is 1/100; 100 gives 2e-12.
    small = compiled(('"2e-7 kg m^2"', '"2e-8 kg m^2"'), only="motor_energy")
    assert 2 * small.motor_energy(1.0) == pytest.approx(2e-4, rel=6e-3)


def test_acceleration_undoes_torque(motor):
    theta, thd, thdd = random(500, 5, 20, 1000)
    f = np.linspace(0, 100, 500)
    tau = motor.motor_torque(theta, thd, thdd, f).tau

    assert motor.motor_acceleration(theta, thd, tau, f).thdd == pytest.approx(thdd, abs=1e-10)


def test_the_motors_power_goes_into_motion_friction_ripple_and_tendon(motor):
    theta, thd, thdd = random(500, 5, 20, 1000)
    f = np.linspace(0, 100, 500)
    momentum = 2 * motor.motor_energy(thd) / thd
    wasted = (motor.motor_friction(thd) + motor.motor_ripple(theta).tau) * thd

    power = motor.motor_torque(theta, thd, thdd, f).tau * thd
    assert power == pytest.approx(momentum * thdd + wasted + 0.004 * f * thd, abs=1e-11)


def test_friction_brakes_a_free_motor_but_as_printed_in_3_2_it_would_drive_it(motor):
    held = motor.motor_ripple(0.0).tau  # ripple is fed forward, so that friction is alone

    def speed_after(end, acceleration):
        return solve_ivp(lambda _, thd: acceleration(thd), (0, end), [5.0], "Radau", rtol=1e-8, atol=1e-14).y[0, -1]

    assert abs(speed_after(0.05, lambda thd: motor.motor_acceleration(0.0, thd, held, 0.0).thdd)) < 1e-12
    assert speed_after(0.02, lambda thd: motor.motor_friction(thd) / INERTIA) > 15


def test_compensated_friction_leaves_a_motor_free_only_in_the_corrected_plant(motor):
    theta, thd = random(200, 5, 20)
    resistance = motor.motor_friction(thd) + motor.motor_ripple(theta).tau

    assert motor.motor_acceleration(theta, thd, resistance, 0.0).thdd == pytest.approx(0, abs=1e-9)
    # Eq. 10.1 adds friction to the motor's torque, eq. 10.2 adds its estimate once more: twice 0.85 Nm at 1 rad/s.
    assert 2 * motor.motor_friction(1.0) == pytest.approx(1.71, abs=0.01)


def test_the_share_that_is_compensated_is_taken_away_and_the_rest_still_brakes(motor):
    theta, thd = random(200, 5, 20)
    fed = motor.motor_compensation(theta, thd).tau
    resistance = motor.motor_friction(thd) + motor.motor_ripple(theta).tau

    assert fed == pytest.approx(0.9 * resistance, abs=1e-14)
    coasting = motor.motor_acceleration(theta, thd, fed, 0.0).thdd
    fast = np.abs(thd) > 2  # where ripple is smaller than friction
    assert np.all(coasting[fast] * thd[fast] < 0)


def test_damping_is_the_slope_of_friction_and_bounds_the_step_of_a_simulation(motor):
    thd = np.linspace(-20, 20, 401)
    slope = (motor.motor_friction(thd + 1e-6) - motor.motor_friction(thd - 1e-6)) / 2e-6
    assert motor.motor_damping(thd) == pytest.approx(slope, abs=1e-8)

    assert motor.motor_damping(0.0) == pytest.approx(5.6216, abs=1e-4)
    limit = 2 * INERTIA / motor.motor_damping(0.0)
    for step, shrinks in ((0.98 * limit, True), (1.02 * limit, False)):
        speed = 1e-6
        for _ in range(100):
            speed -= step * motor.motor_friction(speed) / INERTIA
        assert (abs(speed) < 1e-6) == shrinks
    # With the 2e-4 kg m^2 of table 15.1 the 3 kHz tick of 333 us is far beyond that limit of 71 us.
    assert 2 * 2e-4 / motor.motor_damping(0.0) == pytest.approx(71.2e-6, rel=1e-2)


@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_the_ripples_main_line_is_at_the_rotors_speed(motor, speed):
    time = np.arange(-np.pi, np.pi, 2 * np.pi / 4096) / speed  # one turn of the output
    amplitude = 2 * np.abs(np.fft.rfft(motor.motor_ripple(speed * time).tau)) / len(time)
    frequency = np.fft.rfftfreq(len(time), time[1] - time[0])

    assert 2 * np.pi * frequency[np.argmax(amplitude)] == pytest.approx(100 * speed)
    assert np.max(amplitude) == pytest.approx(0.06, rel=1e-12)


def test_ripple_repeats_with_the_angle_but_as_printed_in_3_7_it_would_not_move(motor):
    angle = np.linspace(-4, -2, 1001)
    assert motor.motor_ripple(angle + 2 * np.pi).tau == pytest.approx(motor.motor_ripple(angle).tau, abs=1e-13)

    # The printed argument is a speed; at constant speed that is one number, and figure 3.4 would be flat.
    printed = motor.motor_ripple(np.full(1001, 1.0)).tau
    assert np.ptp(printed) == 0
    assert np.ptp(motor.motor_ripple(1.0 * angle).tau) > 0.12


def test_ripples_are_the_sum_of_the_files_waves(motor):
    theta = np.linspace(-5, 5, 1001)
    waves = [(100, 0.06, 40), (200, 0.025, -75), (1, 0.03, 10), (3, 0.012, 120)]
    expected = sum(a * np.sin(n * theta + np.radians(phase)) for n, a, phase in waves)

    assert motor.motor_ripple(theta).tau == pytest.approx(expected, abs=1e-13)


def test_a_hand_without_a_motor_has_none_of_its_kernels():
    from awiwi_gen.kernels import catalog

    def parts(hand):
        return {kernel.path for kernel in catalog(hand)} & {"motor", "spring", "tendon", "calibration"}

    assert parts(Hand.parse(hand_text())) == {"motor", "spring", "tendon", "calibration"}
    assert parts(Hand.parse(hand_text().split("[motor]")[0])) == set()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('rotor_inertia = "2e-7 kg m^2"', 'rotor_inertia = "-2e-7 kg m^2"', "must be above zero"),
        ('gear_ratio = "100"', 'gear_ratio = "0"', "must be above zero"),
        ('compensation = "0.9"', 'compensation = "1.1"', "is not plausible"),
        ('travel = "5 rad"', 'travel = "50 rad"', "turns the rotor by 5000 rad"),
        ("harmonic = 3", "harmonic = 1", "which ripple[2] is already"),
        ("harmonic = 3", 'harmonic = "3"', 'harmonic = "3" is not a whole number; expected something such as 1'),
        ("harmonic = 3", "harmonic = 0", "is too small; expected at least 1"),
        ('\npulley = "4 mm"', '\npulley = "5 mm"', 'is not motor.pulley = "5 mm"'),
    ],
)
def test_an_impossible_motor_is_refused(old, new, expected):
    with pytest.raises(InputError) as caught:
        Hand.parse(hand_text((old, new)))
    assert expected in str(caught.value)
    assert "hand.toml:" in str(caught.value)
