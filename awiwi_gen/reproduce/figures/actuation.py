"""Figures 3.3 to 3.6 and 4.7: friction and ripple of a motor, found and compensated; the lever spring's characteristic.

The source shows measurements. Here the motor is simulated: it obeys the compiled equation of
motion, a position controller drives it 3000 times a second, and its sensors are noisy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand, Motor
from awiwi_gen.identify import fit_friction
from awiwi_gen.results import Draw, Figure, curves
from awiwi_gen.simulate import PERIOD, Actuator, Array, Block, Element, Loop, Scenario, Sensor, Sum, Wire, simulate

BANDWIDTH = 450.0  # rad/s, of the position loop: well above the ripple it has to show in its torque
DAMPING = 0.7
RUNS = 10
POSITION_NOISE, VELOCITY_NOISE = 5e-6, 1e-3  # rad, rad/s; at the rotor, a hundred times as much
TORQUE_NOISE = 5e-3  # N m


def figures(library: Any, hand: Hand) -> list[Figure]:
    """The figures of chapters 3 and 4 that this hand has the parts for."""
    found = []
    if hand.motor:
        found.append(friction(library, hand.motor))
    if hand.motor and hand.motor.ripple:
        recordings = Recordings.of(library, hand.motor)
        found += [repeatability(recordings), frequencies(recordings), compensation(recordings)]
    if hand.spring:
        found.append(characteristic(library))
    return found


def friction(library: Any, motor: Motor) -> Figure:
    """Figure 3.3: mean torques at constant speeds give the friction curve, in spite of ripple."""
    generator = np.random.default_rng(33)
    fastest, turn = float(motor.velocity) / 4, 2 * np.pi / float(motor.gear_ratio)
    speeds = fastest * np.linspace(-1, 1, 41) ** 3
    theta = np.linspace(0, 4 * turn, 800, endpoint=False)  # "a few motor periods"
    torque = library.motor_torque(theta, speeds[:, None], 0.0, 0.0).tau + generator.normal(0, TORQUE_NOISE, (41, 800))
    mean, low, high = torque.mean(axis=1), torque.min(axis=1), torque.max(axis=1)
    fit = fit_friction(speeds, mean)
    model = library.motor_friction(speeds)
    error = float(np.max(np.abs(fit.curve(speeds) - model)) / np.max(np.abs(model)))

    def draw(axes: Any) -> None:
        axes.fill_between(speeds, low, high, alpha=0.25, label="lowest to highest")
        axes.plot(speeds, mean, ".", markersize=3, label="mean")
        axes.plot(speeds, fit.curve(speeds), linewidth=0.8, label="fitted model")
        axes.set(xlabel="speed [rad/s]", ylabel="motor torque [N m]")
        axes.legend()

    return Figure(
        "3.3", "Friction found from the mean motor torque at constant speeds",
        "The mean torques at constant speeds follow atan(g1 w) g2 + g3 w.",
        f"The fit finds the friction of the simulated motor within {error:.2%} of its largest value.", error < 0.02,
        draw,
    )  # fmt: skip


@dataclass(frozen=True)
class Recordings:
    """Torques that the controller asks for at constant speeds, against the angle (samples,) [rad] of the output.

    `repeated` (runs, samples) [N m] are at `speed` [rad/s], `slow` (samples,) at half of it, `compensated` at `speed`
    with friction and ripple fed forward. `line` is the rotor's strongest ripple, in periods per turn of the output.
    """

    speed: float
    line: float
    theta: Array
    repeated: Array
    slow: Array
    compensated: Array

    @classmethod
    def of(cls, library: Any, motor: Motor) -> Recordings:
        """Drive the motors from the same angle, over whole turns of the rotor."""
        ratio, travel = float(motor.gear_ratio), float(motor.travel)
        speed = min(1.0, float(motor.velocity) / 2)
        turn = 2 * np.pi / ratio
        window = max(1, round(min(0.4 * travel, 1.0) / turn)) * turn
        theta = np.linspace(-window / 2, window / 2, 4096, endpoint=False)
        speeds = np.full(RUNS + 2, speed)
        speeds[-2] /= 2
        fed = np.zeros(RUNS + 2)
        fed[-1] = 1.0
        angle, feedback = drive(library, speeds, fed, -0.6 * window, 2.2 * window / speed)
        torque = np.array([np.interp(theta, *lane) for lane in zip(angle, feedback, strict=True)])
        strongest = max(motor.ripple, key=lambda wave: (wave.shaft == "input", float(wave.amplitude)))
        line = strongest.harmonic * (ratio if strongest.shaft == "input" else 1.0)
        return cls(speed, line, theta, torque[:RUNS], torque[-2], torque[-1])

    @property
    def highest(self) -> float:
        """The highest frequency worth drawing [Hz]."""
        return 3 * self.line * self.speed / (2 * np.pi)

    def spectrum(self, torque: Array) -> tuple[Array, Array]:
        """Periods per turn of the output, and amplitudes [N m] of a recording (samples,)."""
        amplitude = 2 * np.abs(np.fft.rfft(torque - torque.mean())) / len(torque)
        return np.fft.rfftfreq(len(torque), (self.theta[1] - self.theta[0]) / (2 * np.pi)), amplitude

    def strongest(self, torque: Array) -> float:
        """The largest line of the rotor in a recording, in periods per turn of the output."""
        lines, amplitude = self.spectrum(torque)
        return float(lines[np.argmax(np.where(lines > self.line / 2, amplitude, 0.0))])

    def drawing(self, shown: Mapping[str, tuple[float, Array]]) -> Draw:
        """The spectra of labelled recordings, each with its speed [rad/s]."""
        spectra = {label: (speed, *self.spectrum(torque)) for label, (speed, torque) in shown.items()}
        lines = {
            label: (speed * lines / (2 * np.pi), amplitude) for label, (speed, lines, amplitude) in spectra.items()
        }
        return curves(None, lines, "frequency [Hz]", "torque amplitude [N m]", xlim=(0, self.highest))

    def peak(self, torque: Array) -> float:
        """Amplitude of the rotor's strongest ripple in a recording [N m]."""
        lines, amplitude = self.spectrum(torque)
        return float(amplitude[np.argmin(np.abs(lines - self.line))])


def drive(library: Any, speeds: Array, fed: Array, start: float, duration: float) -> tuple[Array, Array]:
    """Angles [rad] and controller torques [N m], both (motors, ticks), of motors controlled to their speeds [rad/s].

    A share `fed` of the motor's own compensation is added to the controller's torque.
    """
    inertia = 2 * float(library.motor_energy(1.0))
    law: list[Element] = [
        Block(
            "pole_placement_law",
            {"x": ("position", "velocity", "zeros"), "x_des": ("goal", "zeros"), "u_des": "zeros[0]", "u": "feedback"},
        ),
        Block("motor_compensation", {"theta": "position", "thd": "goal[1]", "tau": "modelled"}),
        Sum("command", (1.0, "feedback"), ("fed", "modelled")),
    ]
    motor: dict[str, Wire] = {"theta": "x[0]", "thd": "x[1]", "tau": "u", "f": "zeros[0]", "thdd": "xd[1]"}
    loop = Loop(
        [Sum("xd[0]", (1.0, "x[1]")), Block("motor_acceleration", motor)], law, {"x": "xd"},
        [Sensor("x[0]", "position", POSITION_NOISE), Sensor("x[1]", "velocity", VELOCITY_NOISE)],
        [Actuator("command", "u", late=False)],
    )  # fmt: skip
    times = np.arange(round(duration / PERIOD)) * PERIOD
    K = (inertia * BANDWIDTH**2, 2 * DAMPING * inertia * BANDWIDTH, 0.0, 0.0)
    values = {"zeros": np.zeros(2), "K": K, "u": 0.0}
    scenarios = []
    for seed, (speed, share) in enumerate(zip(speeds, fed, strict=True)):
        goal = np.stack([start + speed * times, np.full_like(times, speed)], axis=1)
        scenarios.append(Scenario(values | {"x": goal[0], "fed": share}, len(times), {"goal": goal}, seed))
    traces = simulate(library, loop, scenarios, ["x[0]", "feedback"])
    return np.stack([trace["x[0]"][:, 0] for trace in traces]), np.stack([trace["feedback"][:, 0] for trace in traces])


def repeatability(recordings: Recordings) -> Figure:
    """Figure 3.4: the same torque at each repetition."""
    mean = recordings.repeated.mean(axis=0)
    spread = float(np.std(recordings.repeated - mean))
    share = spread / float(np.std(mean))
    lines = {f"run {number}": run for number, run in enumerate(recordings.repeated, start=1)}
    return Figure(
        "3.4", f"Commanded torque of {RUNS} motions at {recordings.speed:g} rad/s from the same angle",
        "The disturbance repeats: it depends on the position.",
        f"Runs differ by {share:.0%} of what they have in common.", share < 0.2,
        curves(recordings.theta, lines, "output angle [rad]", "commanded torque [N m]"),
    )  # fmt: skip


def frequencies(recordings: Recordings) -> Figure:
    """Figure 3.5: at twice the speed the main line is at twice the frequency, and as high."""
    fast, slow = recordings.repeated[0], recordings.slow
    speeds = {recordings.speed: fast, recordings.speed / 2: slow}
    main = [speed * recordings.strongest(torque) for speed, torque in speeds.items()]
    shift, heights = main[0] / main[1], recordings.peak(fast) / recordings.peak(slow)

    shown = {f"{speed:g} rad/s": (speed, torque) for speed, torque in speeds.items()}
    return Figure(
        "3.5", "Frequencies of the disturbance at two speeds",
        "The main line moves with the rotor's speed, so the disturbance depends on the position.",
        f"At twice the speed it is at {shift:.3g} times the frequency, {heights:.2f} times as high.",
        abs(shift - 2) < 1e-6 and abs(heights - 1) < 0.1, recordings.drawing(shown),
    )  # fmt: skip


def compensation(recordings: Recordings) -> Figure:
    """Figure 3.6: the controller's remaining torque when friction and ripple are fed forward."""
    without, fed = recordings.repeated[0], recordings.compensated
    left = recordings.peak(fed) / recordings.peak(without)

    shown = {"without compensation": (recordings.speed, without), "with compensation": (recordings.speed, fed)}
    return Figure(
        "3.6", "Frequencies of the controller's torque with and without compensation",
        "Feeding the disturbance forward attenuates the rotor's main line.", f"Of its amplitude {left:.0%} is left.",
        left < 0.25, recordings.drawing(shown),
    )  # fmt: skip


def characteristic(library: Any) -> Figure:
    """Figure 4.7: force and stiffness of the mechanism, by the lever and by the elongation alone."""
    travel = library["spring_force"].inputs[0]["high"][0]
    x = np.linspace(0, travel, 1001)
    force, stiffness = library.spring_force(x).f, library.spring_stiffness(x).k
    lever = library["spring_lever"].inputs[0]
    dL, pulled, stiff, _ = library.spring_lever(np.linspace(lever["low"][0], lever["high"][0], 1001))
    elongation = dL.max() - dL
    error = float(np.max(np.abs(library.spring_force(elongation).f - pulled)) / pulled.max())
    order = np.argsort(elongation)
    progressive = bool(np.all(np.diff(pulled[order]) > 0) and np.all(np.diff(stiff[order]) > 0) and np.all(stiff > 0))

    def draw(axes: Any) -> None:
        axes.plot(x * 1e3, force, label="force")
        axes.set_xlabel("elongation [mm]")
        axes.set_ylabel("tendon force [N]", color="tab:blue")
        other = axes.twinx()
        other.plot(x * 1e3, stiffness / 1e3, "--", color="tab:red", label="stiffness")
        other.set_ylabel("tendon stiffness (dashed) [N/mm]", color="tab:red")

    return Figure(
        "4.7", "Force and stiffness of the tendon's mechanism",
        "The stiffness rises with the force, and a polynomial is enough for either.",
        f"It rises from {stiff.min() / 1e3:.1f} to {stiff.max() / 1e3:.1f} N/mm up to {pulled.max():.0f} N; "
        f"polynomials give the force within {error:.0e} of its largest value.", progressive and error < 1e-6, draw,
    )  # fmt: skip
