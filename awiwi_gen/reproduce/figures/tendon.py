"""Figures 10.1 to 10.4 and 14.3: steps of a tendon's force, by the compiled laws on the hand's motor and lever spring.

The motor obeys its compiled equation, friction and ripple included; the law runs on the hand's clock, its torque comes
one period late and is bounded. For the experiments of figure 10.4 sensors are noisy and part of the friction is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.clocked import Array, overshoot, run, settling
from awiwi_gen.loops.sampled import is_implementable
from awiwi_gen.results import Figure

STEPS = np.array([[10.0, 20.0], [20.0, 30.0], [30.0, 40.0], [40.0, 50.0]])  # N, from and to (section 10.4)
TUNED_AT = 30.0  # N (figure 10.2)
FREQUENCY, DAMPING = 80.0, 0.8  # of the target [rad/s]
DURATION = 0.3  # s
RESOLUTION = 100.0 / 4096  # N, of the force sensor
NOISE, KNOWN = 0.1, 0.7  # N; share of the friction: figure 10.4
WELL_DAMPED = 0.06  # of the step, that a second-order system of this damping may overshoot by 1.5 %
TABLE_14_1: dict[str, Any] = {"b": 2e-3, "weights": np.array([1.0, 1e-4]), "R": 1e-6}
FORCES_14_3 = (0.0, 40.0, 45.0)  # N


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them, for hands with motors and lever springs."""
    if not hand.motor or not hand.spring:
        return []
    bench = Bench(library, hand)
    return [feedforward(bench), fixed(bench), scheduled(bench), measured(bench), state_dependent(bench)]


@dataclass(frozen=True)
class Bench:
    """A motor that pulls a tendon with a lever spring, whose other end is held (figure 14.1)."""

    library: Any
    hand: Hand

    @property
    def radius(self) -> float:
        """Of the motor's pulley [m]."""
        return float(self.hand.motor.pulley) if self.hand.motor else 0.0

    @property
    def inertia(self) -> float:
        """Of the motor, at its output [kg m^2]."""
        return 2 * float(self.library.motor_energy(1.0))

    @property
    def limit(self) -> float:
        """Of the motor's torque [N m]."""
        return float(self.hand.motor.torque) if self.hand.motor else 0.0

    def stiffness(self, force: Any) -> Array:
        """Slope of the tendon's force over its elongation [N/m]."""
        found: Array = self.library.spring_stiffness(self.library.spring_elongation(force).x).k
        return found

    def force(self, theta: Array) -> Array:
        """Tendon force [N] at a motor angle; the spring ends where its lever does."""
        ends = self.library.spring_force.inputs[0]
        found: Array = self.library.spring_force(np.clip(theta * self.radius, ends["low"], ends["high"])).f
        return found

    def angle(self, force: Any) -> Array:
        """Motor angle [rad] at a tendon force."""
        found: Array = self.library.spring_elongation(force).x / self.radius
        return found

    def rates(self, state: Array, tau: Array, _: float) -> Array:
        """Of angle and speed (2, runs)."""
        moved = self.library.motor_acceleration(*state, tau, self.force(state[0]))
        return np.stack([state[1], moved])

    def steps(
        self, gains: Array, fed: float = 1.0, compensated: float = 1.0, noise: float = 0.0
    ) -> tuple[Array, Array]:
        """Times and forces (ticks, runs) of the four steps, with gains (runs, 2).

        Shares of the desired force's torque and of the friction are fed forward; forces are seen with noise [N].
        """
        start, goal, random = STEPS[:, 0], STEPS[:, 1], np.random.default_rng(10)

        def law(state: Array, _: float) -> Array:
            theta, speed = state
            seen = self.force(theta) + noise * random.standard_normal(len(theta))
            force = RESOLUTION * np.round(seen / RESOLUTION)
            tau = self.library.tendon_force_pd(
                f=force, fd=self.radius * self.stiffness(np.clip(force, 5.0, 95.0)) * speed, f_des=goal, fd_des=0.0,
                f_hat=fed * goal, friction=compensated * self.library.motor_compensation(theta, speed), r=self.radius,
                kp=gains[:, 0], kd=gains[:, 1],
            ).tau  # fmt: skip
            cut: Array = np.clip(tau, -self.limit, self.limit)
            return cut

        times, states, _ = run(self.rates, law, np.stack([self.angle(start), np.zeros(len(STEPS))]), DURATION)
        return times, np.stack([self.force(state) for state in states[:, 0]])

    def gains(self, force: Any) -> Array:
        """Gains (runs, 2) scheduled at a force."""
        found: Array = self.library.tendon_force_scheduled(
            f=force, fd=0.0, f_des=force, fd_des=0.0, f_hat=force, friction=0.0, r=self.radius, b=self.inertia,
            stiffness=self.stiffness(force), stiffness_rate=0.0, omega0=FREQUENCY, xi0=DAMPING,
        ).gains  # fmt: skip
        return found


def feedforward(bench: Bench) -> Figure:
    """Figure 10.1."""
    gains = bench.gains(STEPS[:, 1])
    runs = [bench.steps(gains, fed, compensated=fed) for fed in (1.0, 0.0)]
    errors = [np.abs(forces[-1] - STEPS[:, 1]).max() for _, forces in runs]

    def draw(axes: Any) -> None:
        for (times, forces), name in zip(runs, ("with feed-forward", "without"), strict=True):
            axes.plot(times, forces[:, 1], linewidth=0.8, label=name)
        axes.axhline(STEPS[1, 1], linewidth=0.5, linestyle=":", color="black")
        axes.set(xlabel="t [s]", ylabel="tendon force [N]")
        axes.legend()

    return Figure(
        "10.1", "A force step with and without feed-forward of tendon torque and friction",
        "Feed-forward takes away the steady error.", f"{errors[1]:.2f} N without, {errors[0]:.2f} N with it.",
        bool(errors[0] < 0.2 * errors[1]), draw,
    )  # fmt: skip


def fixed(bench: Bench) -> Figure:
    """Figure 10.2."""
    times, forces = bench.steps(np.repeat(bench.gains(TUNED_AT)[None], len(STEPS), axis=0))
    beyond = overshoot(forces, STEPS[:, 1], STEPS[:, 0])
    ratios = DAMPING * np.sqrt(bench.stiffness(STEPS[:, 1]) / bench.stiffness(TUNED_AT))
    return Figure(
        "10.2", "Force steps with gains tuned at 30 N",
        "Ideal at 30 N, underdamped below.",
        f"Damping ratios {', '.join(f'{ratio:.2f}' for ratio in ratios)} at {_forces()} N, overshoots "
        f"{', '.join(f'{share:.1%}' for share in beyond)}. The text calls both sides underdamped.",
        bool(np.all(np.diff(ratios) > 0) and beyond[0] > beyond[1] and beyond[-1] <= beyond[1]), _steps(times, forces),
    )  # fmt: skip


def scheduled(bench: Bench) -> Figure:
    """Figure 10.3, both halves."""
    runs = [
        bench.steps(gains) for gains in (np.repeat(bench.gains(TUNED_AT)[None], 4, axis=0), bench.gains(STEPS[:, 1]))
    ]
    spread = [np.ptp(settling(times, forces, STEPS[:, 1], STEPS[:, 0], 0.05)) for times, forces in runs]
    beyond = [overshoot(forces, STEPS[:, 1], STEPS[:, 0]).max() for _, forces in runs]

    return Figure(
        "10.3", "Force steps with fixed and with scheduled gains",
        "Scheduled gains are better than fixed ones at every working point.",
        f"They overshoot by {beyond[1]:.1%} at most, fixed ones "
        f"by {beyond[0]:.1%}; their settling times differ by {spread[1] * 1e3:.0f} ms, those of fixed gains by "
        f"{spread[0] * 1e3:.0f} ms.",
        bool(beyond[1] < WELL_DAMPED and beyond[1] <= beyond[0] and spread[1] < spread[0]), _shares(runs),
    )  # fmt: skip


def measured(bench: Bench) -> Figure:
    """Figure 10.4, simulated: the same with noise and with friction that is known only in part."""
    both = (np.repeat(bench.gains(TUNED_AT)[None], 4, axis=0), bench.gains(STEPS[:, 1]))
    runs = [bench.steps(gains, compensated=KNOWN, noise=NOISE) for gains in both]
    errors = [np.abs(forces - STEPS[:, 1]).mean(axis=0) * 1e3 * DURATION for _, forces in runs]

    listed = [", ".join(f"{each:.0f}" for each in error) for error in errors]
    return Figure(
        "10.4", f"Figure 10.3 with noise of {NOISE:g} N and {KNOWN:.0%} of the friction compensated",
        "In the experiments scheduled gains are better than fixed ones in all cases.",
        f"The error sums up to {listed[1]} N ms with scheduled and to {listed[0]} N ms with fixed gains, at {_forces()} N.",
        bool(np.all(errors[1] <= 1.001 * errors[0])), _shares(runs),
    )  # fmt: skip


def state_dependent(bench: Bench) -> Figure:
    """Figure 14.3: the law of table 14.1, on the torque of this hand's spring as a cubic of the motor's angle."""
    theta = np.linspace(0, bench.angle(95.0), 200)
    torque = bench.radius * bench.force(theta)
    spring = np.linalg.lstsq(theta[:, None] ** np.arange(1, 4), torque - torque[0], rcond=None)[0]
    goals = bench.angle(np.maximum(FORCES_14_3, bench.force(np.zeros(1))[0] + 1e-9))
    once = bench.library.sdre_tendon(
        theta=goals[1], thd=0.0, theta_des=goals[1], dtheta=0.0, spring=spring, **TABLE_14_1
    )  # at rest
    slope = float(spring @ (np.arange(1, 4) * goals[1] ** np.arange(3)))
    A, B = np.array([[0, 1], [-slope / TABLE_14_1["b"], 0]]), np.array([0, 1 / TABLE_14_1["b"]])
    clock = is_implementable(A, B, once.K)

    def response(adaptive: bool) -> tuple[Array, Array]:
        def rates(x: Array, u: Array, _: float) -> Array:
            powers = x[0] ** np.arange(1, 4)[:, None]
            return np.stack([x[1], (u - spring @ powers) / TABLE_14_1["b"]])

        def law(x: Array, time: float) -> Array:
            goal = goals[1] if time < DURATION / 2 else goals[2]
            found = bench.library.sdre_tendon(
                theta=x[0], thd=x[1], theta_des=goal, dtheta=0.0, spring=spring, **TABLE_14_1
            )
            held = float(spring @ goal ** np.arange(1, 4))
            fixed_torque: Array = held - once.K[0] * (x[0] - goal) - once.K[1] * x[1]
            return np.asarray(found.u) if adaptive else fixed_torque

        times, states, _ = run(rates, law, np.array([[goals[0]], [0.0]]), DURATION, late=0)
        return times, bench.force(states[:, 0, 0])

    (times, adapted), (_, constant) = response(True), response(False)
    apart = float(np.abs(adapted - constant).max())

    def draw(axes: Any) -> None:
        axes.plot(times, adapted, linewidth=0.8, label="state-dependent")
        axes.plot(times, constant, "--", linewidth=0.8, label="fixed")
        axes.set(xlabel="t [s]", ylabel="tendon force [N]")
        axes.legend()

    return Figure(
        "14.3", "State-dependent and fixed optimal gains on a tendon's force",
        "The two are hardly to be told apart.",
        f"They are {apart:.2g} N apart at most. Computed without delay, as printed; "
        f"with that, the law of table 14.1 is {clock.reason}.",
        apart < 0.5, draw,
    )  # fmt: skip


def _shares(runs: Any) -> Any:
    """All steps on top of one another, as shares of their heights."""

    def draw(axes: Any) -> None:
        for (times, forces), style, name in zip(runs, (":", "-"), ("fixed", "scheduled"), strict=True):
            for index, (start, goal) in enumerate(STEPS):
                share, label = (forces[:, index] - start) / (goal - start), f"{name}, to {goal:g} N"
                axes.plot(times * 1e3, share, style, linewidth=1.0, color=f"C{index}", label=label)
        axes.set(xlabel="t [ms]", ylabel="force, as a share of the step", xlim=(0, 100))
        axes.legend(ncols=2)

    return draw


def _forces() -> str:
    return ", ".join(f"{force:g}" for force in STEPS[:, 1])


def _steps(times: Array, forces: Array) -> Any:
    def draw(axes: Any) -> None:
        for index, (start, goal) in enumerate(STEPS):
            axes.plot(times, forces[:, index], linewidth=0.8, label=f"{start:g} to {goal:g} N")
        axes.set(xlabel="t [s]", ylabel="tendon force [N]")
        axes.legend()

    return draw
