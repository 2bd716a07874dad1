"""Figures 10.1 to 10.4 and 14.3: steps of a tendon's force, by the compiled laws on the hand's motor and lever spring.

The motor obeys its compiled equation, friction and ripple included; the law runs on the hand's clock, its torque comes
one period late and is limited. For the experiments of figure 10.4 the sensor is noisy and part of the friction unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand, Motor
from awiwi_gen.loops.sampled import is_implementable
from awiwi_gen.loops.step import overshoot, run, settling
from awiwi_gen.results import Draw, Figure, curves, listed
from awiwi_gen.simulate import PERIOD, Actuator, Array, Block, Element, Loop, Scenario, Sensor, Sum, simulate

STEPS = np.array([[10.0, 20.0], [20.0, 30.0], [30.0, 40.0], [40.0, 50.0]])  # N, from and to (section 10.4)
TUNED_AT = 30.0  # N (figure 10.2)
FREQUENCY, DAMPING = 80.0, 0.8  # of the target [rad/s]
DURATION = 0.3  # s
RESOLUTION = 100.0 / 4096  # N, of the force sensor
NOISE, KNOWN = 0.1, 0.7  # N; share of the friction: figure 10.4
WELL_DAMPED = 0.06  # of the step, that a second-order system of this damping may overshoot by 1.5 %
TABLE_14_1: dict[str, Any] = {"b": 2e-3, "weights": np.array([1.0, 1e-4]), "R": 1e-6}
FORCES_14_3 = (0.0, 40.0, 45.0)  # N
TICKS = round(DURATION / PERIOD)


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them, for hands with motors and lever springs."""
    if not hand.motor or not hand.spring:
        return []
    bench = Bench(library, hand.motor)
    return [feedforward(bench), fixed(bench), scheduled(bench), measured(bench), state_dependent(bench)]


@dataclass(frozen=True)
class Bench:
    """A motor that pulls a tendon with a lever spring, whose other end is held (figure 14.1)."""

    library: Any
    motor: Motor

    @property
    def radius(self) -> float:
        """Of the motor's pulley [m]."""
        return float(self.motor.pulley)

    @property
    def inertia(self) -> float:
        """Of the motor, at its output [kg m^2]."""
        return 2 * float(self.library.motor_energy(1.0))

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

    def steps(self, gains: Array, fed: float = 1.0, compensated: float = 1.0, noise: float = 0.0) -> Array:
        """Forces (ticks, runs) of the four steps, with gains (runs, 2).

        Shares of the desired force's torque and of the friction are fed forward; forces are measured with noise [N].
        """
        law: list[Element] = [
            Block("spring_stiffness", {"x": "elongation"}),
            Sum("elongation_rate", ("r", "x[1]")),
            Sum("fd", ("k", "elongation_rate")),
            Block("motor_compensation", {"theta": "x[0]", "thd": "x[1]", "tau": "modelled"}),
            Sum("friction", (compensated, "modelled")),
            Block("tendon_force_pd", {"f": "measured", "tau": "command"}),
        ]
        plant: list[Element] = [
            Sum("elongation", ("r", "x[0]")),
            Block("spring_force", {"x": "elongation"}),
            Sum("xd[0]", (1.0, "x[1]")),
            Block("motor_acceleration", {"theta": "x[0]", "thd": "x[1]", "tau": "u", "thdd": "xd[1]"}),
        ]
        sensors, actuators = (
            [Sensor("f", "measured", noise, RESOLUTION)],
            [Actuator("command", "u", float(self.motor.torque))],
        )
        loop = Loop(plant, law, {"x": "xd"}, sensors, actuators)
        scenarios = [
            Scenario(
                {
                    "x": (self.angle(start), 0.0), "command": self.radius * start, "f": start, "r": self.radius,
                    "f_des": goal, "fd_des": 0.0, "f_hat": fed * goal, "kp": kp, "kd": kd,
                },
                TICKS, seed=index,
            )
            for index, ((start, goal), (kp, kd)) in enumerate(zip(STEPS, gains, strict=True))
        ]  # fmt: skip
        return np.concatenate([trace["f"] for trace in simulate(self.library, loop, scenarios, ["f"])], axis=1)

    def gains(self, force: Any) -> Array:
        """Gains (runs, 2) scheduled at a force."""
        found: Array = self.library.tendon_force_scheduled(
            f=force, fd=0.0, f_des=force, fd_des=0.0, f_hat=force, friction=0.0, r=self.radius, b=self.inertia,
            stiffness=self.stiffness(force), stiffness_rate=0.0, omega0=FREQUENCY, xi0=DAMPING,
        ).gains  # fmt: skip
        return found

    def both_gains(self) -> tuple[Array, Array]:
        """Gains (runs, 2) tuned at one force, and scheduled."""
        return np.repeat(self.gains(TUNED_AT)[None], len(STEPS), axis=0), self.gains(STEPS[:, 1])


def feedforward(bench: Bench) -> Figure:
    """Figure 10.1."""
    runs = [bench.steps(bench.gains(STEPS[:, 1]), fed, compensated=fed) for fed in (1.0, 0.0)]
    errors = [np.abs(forces[-1] - STEPS[:, 1]).max() for forces in runs]
    lines = {name: forces[:, 1] for name, forces in zip(("with feed-forward", "without"), runs, strict=True)}
    lines |= {"desired": np.full(TICKS, STEPS[1, 1])}
    return Figure(
        "10.1", "A force step with and without feed-forward of tendon torque and friction",
        "Feed-forward takes away the steady error.", f"{errors[1]:.2f} N without, {errors[0]:.2f} N with it.",
        bool(errors[0] < 0.2 * errors[1]), curves(_times(), lines, "t [s]", "tendon force [N]", *"--:"),
    )  # fmt: skip


def fixed(bench: Bench) -> Figure:
    """Figure 10.2."""
    forces = bench.steps(bench.both_gains()[0])
    beyond = overshoot(forces, STEPS[:, 1], STEPS[:, 0])
    ratios = DAMPING * np.sqrt(bench.stiffness(STEPS[:, 1]) / bench.stiffness(TUNED_AT))
    lines = {f"{start:g} to {goal:g} N": run for (start, goal), run in zip(STEPS, forces.T, strict=True)}
    return Figure(
        "10.2", "Force steps with gains tuned at 30 N",
        "Ideal at 30 N, underdamped below.", f"Damping ratios {listed(ratios, '.2f')} at {_forces()} N, overshoots "
        f"{listed(beyond, '.1%')}. The text calls both sides underdamped.",
        bool(np.all(np.diff(ratios) > 0) and beyond[0] > beyond[1] and beyond[-1] <= beyond[1]),
        curves(_times(), lines, "t [s]", "tendon force [N]"),
    )  # fmt: skip


def scheduled(bench: Bench) -> Figure:
    """Figure 10.3, both halves."""
    runs = [bench.steps(gains) for gains in bench.both_gains()]
    spread = [np.ptp(settling(_times(), forces, STEPS[:, 1], STEPS[:, 0], 0.05)) for forces in runs]
    beyond = [overshoot(forces, STEPS[:, 1], STEPS[:, 0]).max() for forces in runs]
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
    runs = [bench.steps(gains, compensated=KNOWN, noise=NOISE) for gains in bench.both_gains()]
    errors = [np.abs(forces - STEPS[:, 1]).mean(axis=0) * 1e3 * DURATION for forces in runs]
    sums = [listed(error, ".0f") for error in errors]
    return Figure(
        "10.4", f"Figure 10.3 with noise of {NOISE:g} N and {KNOWN:.0%} of the friction compensated",
        "In the experiments scheduled gains are better than fixed ones in all cases.",
        f"The error sums up to {sums[1]} N ms with scheduled and to {sums[0]} N ms with fixed gains, at {_forces()} N.",
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
    goal = np.where(np.arange(TICKS) < TICKS // 2, goals[1], goals[2])
    inputs = {"goal": goal, "hold": (goal[:, None] ** np.arange(1, 4)) @ spring}
    values = TABLE_14_1 | {
        "x": (goals[0], 0.0), "path": 0.0, "motor": (TABLE_14_1["b"], 1.0), "line": spring, "friction": (1.0, 0.0, 0.0),
        "spring": spring, "dtheta": 0.0, "K_rest": (*once.K, 0.0, 0.0), "zeros": np.zeros(3),
    }  # fmt: skip
    laws = {
        "state-dependent": Block("sdre_tendon", {"theta": "x[0]", "thd": "x[1]", "theta_des": "goal", "u": "command"}),
        "fixed": Block(
            "pole_placement_law",
            {"K": "K_rest", "x": ("x", "zeros[0:2]"), "x_des": ("goal", "zeros"), "u_des": "hold", "u": "command"},
        ),
    }  # fmt: skip
    forces = {}
    for name, law in laws.items():
        trace = run(bench.library, [Block("plant_tendon")], [law], Scenario(values, TICKS, inputs))
        forces[name] = bench.force(trace["x"][:, 0])
    apart = float(np.abs(forces["state-dependent"] - forces["fixed"]).max())
    return Figure(
        "14.3", "State-dependent and fixed optimal gains on a tendon's force",
        "The two are hardly distinguishable.",
        f"They are {apart:.2g} N apart at most. Computed without delay, as printed; "
        f"with that, the law of table 14.1 is {clock.reason}.", apart < 0.5,
        curves(_times(), forces, "t [s]", "tendon force [N]", "-", "--"),
    )  # fmt: skip


def _shares(runs: list[Array]) -> Draw:
    """All steps on top of one another, as shares of their heights."""

    def draw(axes: Any) -> None:
        for forces, style, name in zip(runs, (":", "-"), ("fixed", "scheduled"), strict=True):
            for index, (start, goal) in enumerate(STEPS):
                share, label = (forces[:, index] - start) / (goal - start), f"{name}, to {goal:g} N"
                axes.plot(_times() * 1e3, share, style, linewidth=1.0, color=f"C{index}", label=label)
        axes.set(xlabel="t [ms]", ylabel="force, as a share of the step", xlim=(0, 100))
        axes.legend(ncols=2)

    return draw


def _times() -> Array:
    return np.arange(TICKS) * PERIOD


def _forces() -> str:
    return listed(STEPS[:, 1], "g")
