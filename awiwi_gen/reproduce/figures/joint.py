"""Chapter 7, and figures 8.3, 9.3, 11.1 to 11.4: forces, stiffness, friction and impedance of joints, run again.

The source shows experiments and simulations of its hand, whose masses, springs and gains it does not print. Here the
joint is one of the hand file that a pair of tendons has for itself; what is concluded is about that joint. Impedances
and pretensions of figures 11.2 to 11.4 were chosen such that it oscillates, and the page says so: softer it does not.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.kernels.fingers_control import antagonists
from awiwi_gen.loops.hand_joint import STRETCH, Joint, joint_of, loop_around, values_of
from awiwi_gen.loops.step import overshoot, run, settling
from awiwi_gen.reproduce.distribution_search import Demands, closed_form_of
from awiwi_gen.reproduce.printed.joint import VISIBLE, paired
from awiwi_gen.results import Figure, curves, listed
from awiwi_gen.simulate import PERIOD, Array, Block, Element, Scenario, Sum, Trace, simulate
from awiwi_gen.structure import groups, senses

FELT = (1.0, 0.7)  # N m/rad, of figure 8.3
EPSILON = 1.5
WEIGHTS = 10.0 ** np.arange(-5, 2)
DEMANDS = 120
TICKS, STEP_AT = 900, 30
TIMES = np.arange(TICKS) * PERIOD
STEP = 0.1  # rad
DAMPING = 1e-3  # N m s/rad, of the link
SOFT, STIFF, RESONANT = 0.3, 0.8, 1.3  # N m/rad, of the impedance; the tendons make about 1
CHOSEN = "The source prints no gains; these were chosen such that the joint oscillates."
TENSIONS = np.array([40.0, 60.0, 80.0])  # N, of figure 11.4
SWEEP = (2.0, 4.0, 8.0, 12.0, 14.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0, 24.0, 26.0, 28.0, 32.0, 64.0)  # Hz
SWEPT = 1.0  # s
LOW_TENSION, HIGH_TENSION = 30.0, 60.0  # N
SLOW, AMPLITUDE, DRY_FRICTION, OBSERVER = 0.5, 0.5, 0.03, 300.0  # Hz, rad, N m, 1/s: figure 9.3


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All figures that the hand has the joints for."""
    found = [algorithm_2(library, name) for name in paired(hand)[:1] if closed_form_of(library, name)]
    found.append(observer(library))
    name = joint_with_own_pair(hand)
    if name is None or hand.motor is None or hand.motor.friction is None or hand.spring is None:
        return found
    joint = replace(joint_of(library, hand, *name), damping=DAMPING)
    bench = Bench(library, joint, float(hand.motor.pulley))
    return [*found, correction(library, joint), *force_steps(bench), *joint_steps(bench), sweep(bench)]


def joint_with_own_pair(hand: Hand) -> tuple[str, str] | None:
    """Finger and joint that a pair of tendons has for itself; the largest pulley of several."""
    found = []
    for name, finger in hand.fingers.items():
        for group in groups(finger):
            turned = senses(finger, finger.tendons[group[0]])
            if len(group) == 2 and antagonists(finger, group) and len(turned) == 1:
                (joint,) = turned
                found.append((float(finger.radii[joint]), name, joint))
    return max(found)[1:] if found else None


def algorithm_2(library: Any, finger: str) -> Figure:
    """Violated limits and missed stiffness by the penalty's weight, beside the closed form."""
    demands = Demands.feasible(library, finger, DEMANDS)
    searched = [demands.search(False, weight) for weight in WEIGHTS]
    violated = np.array([np.percentile(demands.violation(f), 90) for f in searched])
    missed = np.array([np.percentile(demands.miss(f), 90) for f in searched])
    ours = demands.closed_form()
    lines = {"limits violated by [N]": violated, "stiffness missed by [N m/rad]": missed}
    log: dict[str, Any] = {"xscale": "log", "yscale": "log"}
    return Figure(
        "7 (algorithm 2)", "Algorithm 2, corrected, on feasible demands",
        "The force limits are in practice achieved, since their weight can be large.", "One case in ten "
        f"violates them by {violated.max():.2g} N or more at a light weight and misses the stiffness by "
        f"{missed.max():.2g} N m/rad or more at a heavy one; the closed form violates nothing and misses "
        f"{demands.miss(ours).max():.0e}.", bool(np.any((violated < VISIBLE) & (missed < 0.01))),
        curves(WEIGHTS, lines, "weight of the penalty", "90th percentile", "o-", "s-", **log),
    )  # fmt: skip


def correction(library: Any, joint: Joint) -> Figure:
    """Figure 8.3: the controller corrects the stiffness of the tendons, which a disturbance changes."""
    even = np.linspace(*STRETCH, 400) * joint.arm  # N m, of either tendon
    slopes = np.array([joint.slopes(torque)[0] for torque in even])
    shown = []
    for felt in FELT:
        mean = np.interp(EPSILON * felt, 2 * slopes, even)
        reach = 0.9 * 2 * min(mean - even[0], even[-1] - mean)
        load = np.linspace(-reach, reach, 201)
        tendons = sum(np.interp(mean + side * load / 2, even, slopes) for side in (1, -1))
        controller = library.stiffness_correction_scalar(felt, tendons)
        given = np.cumsum(1 / tendons) * (load[1] - load[0])
        deflexion = given - given[len(load) // 2] + load / controller.k_imp
        secant = np.divide(load, deflexion, out=np.full_like(load, felt), where=np.abs(load) > reach / 10)
        shown.append((load, tendons, controller.k_imp, secant, controller.status))
    worst = max(np.abs(curve[3] / felt - 1).max() for curve, felt in zip(shown, FELT, strict=True))
    changes = max(np.ptp(curve[1]) / curve[1].mean() for curve in shown)

    def draw(axes: Any) -> None:
        for load, tendons, controller, secant, _ in shown:
            axes.plot(load, controller, color="tab:red", linewidth=0.8)
            axes.plot(load, tendons, ":", color="tab:blue")
            axes.plot(load, secant, "-.", color="tab:green")
        axes.set(xlabel="disturbance [N m]", ylabel="stiffness [N m/rad]")
        axes.legend(["controller", "tendons", "felt: load per deflexion"], loc="upper right", ncols=3)
        axes.set_ylim(top=1.15 * axes.get_ylim()[1])

    return Figure(
        "8.3", "Stiffness correction under a disturbance",
        f"The felt stiffness stays around {listed(FELT, 'g', ' and ')} N m/rad although the "
        "disturbance changes that of the tendons.",
        f"It stays within {worst:.1%}, while the stiffness of the tendons changes by {changes:.0%}.",
        bool(worst < 0.1 and not any(np.any(curve[4]) for curve in shown)), draw,
    )  # fmt: skip


def observer(library: Any) -> Figure:
    """Figure 9.3: a slow sine with low stiffness and damping, with and without the observed friction fed forward."""
    runs = {fed: tracked(library, fed) for fed in (False, True)}
    errors = {fed: float(np.sqrt(np.mean((wanted - angle) ** 2))) for fed, (wanted, angle, _) in runs.items()}
    busy = {fed: float(np.abs(np.diff(torque)).sum()) for fed, (_, _, torque) in runs.items()}
    lines = {"desired": runs[True][0], "without compensation": runs[False][1], "with compensation": runs[True][1]}
    times = np.arange(len(runs[True][0])) * PERIOD
    return Figure(
        "9.3", "A slow sine with and without friction compensation",
        "Compensating the observed friction clearly improves the tracking.",
        f"The error falls from {errors[False] * 1e3:.0f} to {errors[True] * 1e3:.1f} mrad (r.m.s.), and the torque "
        f"travels {busy[True] / busy[False]:.1f} times as far; the text has it react violently.",
        errors[True] < errors[False] / 3, curves(times, lines, "t [s]", "joint angle [rad]", ":"),
    )  # fmt: skip


def tracked(library: Any, compensate: bool) -> tuple[Array, Array, Array]:
    """Desired angle, angle and torque (ticks) of a joint with dry friction, over two periods after the first."""
    inertia, ticks = 1e-4, round(3 / SLOW / PERIOD)
    phase = 2 * np.pi * SLOW * np.arange(ticks) * PERIOD
    goal = AMPLITUDE * np.stack([np.sin(phase), 2 * np.pi * SLOW * np.cos(phase)], axis=1)
    law: list[Element] = [
        Block(
            "friction_observer", {"momentum_next": "momentum", "tau": "zeros[0]", "thd": "x[1]", "friction": "estimate"}
        ),
        Sum("compensation", (float(compensate), "estimate")),
        Block(
            "pole_placement_law",
            {"x": ("x", "zeros"), "x_des": ("goal", "zeros"), "u_des": "compensation", "u": "command"},
        ),
    ]
    values = {
        "x": np.zeros(2), "path": 0.0, "motor": (inertia, 1.0), "line": np.zeros(3), "zeros": np.zeros(2),
        "friction": (10 * np.pi, 2 / np.pi * DRY_FRICTION, 0.0), "K": (0.3, 0.004, 0.0, 0.0), "momentum": 0.0,
        "B": inertia, "gain": OBSERVER, "period": PERIOD,
    }  # fmt: skip
    trace = run(library, [Block("plant_tendon")], law, Scenario(values, ticks, {"goal": goal}), ["x", "u"])
    after = slice(round(1 / SLOW / PERIOD), None)
    return goal[after, 0], trace["x"][after, 0], trace["u"][after, 0]


class Bench:
    """A joint between two tendons under the law of the two time scales: its impedance shared by motors on springs.

    Motor gains kp and kd are those of the motor itself, whose pulley has the radius r [m].
    """

    def __init__(self, library: Any, joint: Joint, r: float) -> None:
        self.library, self.joint, self.ratio = library, joint, joint.arm / r

    def run(
        self, goals: Array, forces: Array, K: float = 0.0, kp: float = 10.0, kd: float = 0.2, fed: float = 1.0,
        compensation: float = 0.0, joint: Joint | None = None,
    ) -> list[Trace]:  # fmt: skip
        """Traces of runs to desired angles (runs, ticks) with pretensions (runs, ticks) [N], from rest.

        K [N m/rad] is the link's impedance, critically damped for SOFT. Shares of the desired force and of the motors'
        friction are fed forward.
        """
        plant, ratio = joint or self.joint, self.ratio
        motors = [
            Block(
                "motor_impedance",
                {
                    "theta": f"x[{2 * i + 2}]", "thd": f"x[{2 * i + 3}]", "theta_des": f"theta_des[{i}]",
                    "f_des": f"fed[{i}]", "friction": f"compensated[{i}]", "r": "one", "tau": f"wanted[{i}]",
                },
            )
            for i in (0, 1)
        ]  # fmt: skip
        friction = [Block("motor_friction", {"thd": f"speeds[{i}]", "tau": f"modelled[{i}]"}) for i in (0, 1)]
        D = float(2 * np.sqrt(SOFT * self.joint.inertias[0])) if K else 0.0
        law: list[Element] = [
            Sum("tau_link", (K, "q_des"), (-K, "x[0]"), (-D, "x[1]")),
            Block("antagonistic_sharing", {"torque": "tau_link"}),
            Sum("excess", (1.0, "shares"), (-1.0, "pretension[0]")),
            Sum("theta_des", (1.0, "elongations"), ("compliances", "excess"), ("sides", "x[0]")),
            Sum("speeds", (ratio, ("x[3]", "x[5]"))),
            *friction,
            Sum("compensated", (compensation * ratio, "modelled")),
            Sum("fed", (fed, "shares")),
            *motors,
        ]
        own = {
            "motor_kp": kp * ratio**2, "motor_kd": kd * ratio**2, "one": 1.0, "sides": (1.0, -1.0),
            "modelled": np.zeros(2),
        }  # fmt: skip
        scenarios = []
        for goal, force in zip(goals, forces, strict=True):
            values = values_of(plant, plant, float(force[0])) | own
            del values["pretension"]
            levels, level = np.unique(force * plant.arm, return_inverse=True)
            elongations = np.array([plant.elongations(torque) for torque in levels])[level]
            compliances = np.array([1 / plant.slopes(torque) for torque in levels])[level]
            pretension = np.outer(force * plant.arm, [1, 0, 0])
            inputs = {"q_des": goal, "pretension": pretension, "elongations": elongations, "compliances": compliances}
            scenarios.append(Scenario(values, len(goal), inputs))
        return simulate(self.library, loop_around(plant, law), scenarios, ["x", "tau"])


def force_steps(bench: Bench) -> list[Figure]:
    """Figure 11.1: what feed-forward and friction compensation do to a step of the pretension, the joint held."""
    held = replace(bench.joint, inertias=bench.joint.inertias * [1e10, 1, 1])
    smooth = replace(held, friction=held.friction * [1, 0, 1])
    wanted = np.where(np.arange(TICKS) < STEP_AT, LOW_TENSION, 2.5 * LOW_TENSION)
    cases: list[tuple[str, str, list[dict[str, Any]]]] = [
        ("11.1a", "feed-forward of the force", [{"joint": smooth, "fed": share} for share in (0.0, 1.0)]),
        ("11.1b", "friction compensation", [{"joint": held, "compensation": share} for share in (0.0, 0.9)]),
    ]
    found = []
    for number, subject, choices in cases:
        traces = [bench.run(np.zeros((1, TICKS)), wanted[None], **choice)[0] for choice in choices]
        forces = np.stack([trace["tau"][:, 0] / bench.joint.arm for trace in traces], axis=1)
        errors = np.abs(forces[-1] - wanted[-1])
        arrivals = settling(TIMES[:-STEP_AT], forces[STEP_AT:], wanted[-1], wanted[0], 0.1) * 1e3
        lines = {"desired": wanted, "without": forces[:, 0], "with": forces[:, 1]}
        found.append(Figure(
            number, f"A step of the tendon force with and without {subject}",
            f"The {subject} improves the force step.",
            f"At {TICKS * PERIOD:.1f} s the error is {errors[0]:.2g} N without and {errors[1]:.2g} N with it; the force "
            f"stays within 10 % of the step {_after(arrivals[0])} and {_after(arrivals[1])}.",
            bool(errors[1] < errors[0] / 2 and arrivals[1] <= arrivals[0]),
            curves(TIMES, lines, "t [s]", "tendon force [N]", "--", ":"),
        ))  # fmt: skip
    return found


def _after(arrival: float) -> str:
    return f"after {arrival:.0f} ms" if np.isfinite(arrival) else "not at all"


def joint_steps(bench: Bench) -> list[Figure]:
    """Figures 11.2 and 11.3: steps at two impedances of the same damping, and at two pretensions."""
    wanted = np.where(np.arange(TICKS) < STEP_AT, 0.0, STEP)

    def step(K: float, force: float) -> Array:
        (trace,) = bench.run(wanted[None], np.full((1, TICKS), force), K, kp=40.0, kd=0.4, compensation=0.9)
        q: Array = trace["x"][:, 0]
        return q

    impedances = {f"K = {K:g} N m/rad": step(K, TENSIONS[0]) for K in (SOFT, STIFF)}
    pretensions = {f"pretension {force:g} N": step(STIFF, force) for force in (LOW_TENSION, HIGH_TENSION)}
    beyond = [float(overshoot(q, STEP, 0.0)) for q in (*impedances.values(), *pretensions.values())]
    desired = {"desired": wanted}
    return [
        Figure(
            "11.2", "A step of the joint at two impedances (simulated)",
            "At the same damping a stiffer impedance oscillates more.",
            f"The overshoot goes from {beyond[0]:.1%} to {beyond[1]:.1%} from K = {SOFT:g} to {STIFF:g} N m/rad. {CHOSEN}",
            beyond[1] > beyond[0] + 0.01, curves(TIMES, desired | impedances, "t [s]", "joint angle [rad]", "--"),
        ),
        Figure(
            "11.3", "A step of the joint at two pretensions (simulated)", "Stiffer tendons oscillate less.",
            f"The overshoot goes from {beyond[2]:.1%} to {beyond[3]:.1%} from {LOW_TENSION:g} to "
            f"{HIGH_TENSION:g} N. {CHOSEN}",
            beyond[3] < beyond[2] - 0.01, curves(TIMES, desired | pretensions, "t [s]", "joint angle [rad]", "--"),
        ),
    ]  # fmt: skip


def sweep(bench: Bench) -> Figure:
    """Figure 11.4: sines of several frequencies at three pretensions, after a first period."""
    w, force = (each.ravel() for each in np.meshgrid(2 * np.pi * np.array(SWEEP), TENSIONS, indexing="ij"))
    times = np.arange(round(SWEPT / PERIOD)) * PERIOD
    phase = w[:, None] * times
    traces = bench.run(
        STEP * np.sin(phase), np.repeat(force[:, None], len(times), axis=1), RESONANT, kp=40.0, kd=0.4, compensation=0.9
    )
    q = np.stack([trace["x"][:, 0] for trace in traces])
    window = np.where(times >= SWEPT - 2 * np.pi / w[:, None] * np.floor(w[:, None] * SWEPT / 4 / np.pi), 1.0, 0.0)
    window /= window.sum(axis=1, keepdims=True)
    gain = (np.abs((window * q * np.exp(-1j * phase)).sum(axis=1)) * 2 / STEP).reshape(len(SWEEP), -1)
    peaks = np.array(SWEEP)[gain.argmax(axis=0)]
    lines = {f"pretension {f:g} N": each for f, each in zip(TENSIONS, gain.T, strict=True)}
    return Figure(
        "11.4", "Gain of the joint over frequency at three pretensions (simulated)",
        "The resonance moves with the mechanical stiffness, so two time scales hold in a limited range.",
        f"The gain is highest at {listed(peaks, 'g')} Hz, where it is "
        f"{', '.join(f'{peak:.2f}' for peak in gain.max(axis=0))}. {CHOSEN}", bool(np.all(np.diff(peaks) > 0)),
        curves(SWEEP, lines, "frequency [Hz]", "amplitude of the angle per desired angle", *["o-"] * 3),
    )  # fmt: skip
