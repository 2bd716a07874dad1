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
from awiwi_gen.loops.clocked import overshoot, settling
from awiwi_gen.reproduce.distribution_search import Demands, closed_form_of
from awiwi_gen.reproduce.joint_simulation import PERIOD, Array, Gains, Joint
from awiwi_gen.reproduce.printed.joint import VISIBLE, paired
from awiwi_gen.results import Figure

FELT = (1.0, 0.7)  # N m/rad, of figure 8.3
EPSILON = 1.5
WEIGHTS = 10.0 ** np.arange(-5, 2)
DEMANDS = 120
TICKS, STEP_AT = 900, 30
STEP = 0.1  # rad
SOFT, STIFF, RESONANT = 0.3, 0.8, 1.3  # N m/rad, of the impedance; the tendons make about 1
CHOSEN = "The source prints no gains; these were chosen such that the joint oscillates."
TENSIONS = np.array([40.0, 60.0, 80.0])  # N, of figure 11.4
SWEEP, SWEPT = (
    (2.0, 4.0, 8.0, 12.0, 14.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0, 24.0, 26.0, 28.0, 32.0, 64.0),
    1.0,
)  # Hz, s
LOW_TENSION, HIGH_TENSION = 30.0, 60.0  # N
SLOW, AMPLITUDE, RUBBING, OBSERVER = 0.5, 0.5, 0.03, 300.0  # Hz, rad, N m, 1/s: figure 9.3


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All figures that the hand has the joints for."""
    found = [algorithm_2(library, name) for name in paired(hand)[:1] if closed_form_of(library, name)]
    found.append(observer(library))
    joint = Joint.of(library, hand)
    if joint is None:
        return found
    return [*found, correction(library, joint), *force_steps(joint), *joint_steps(joint), sweep(joint)]


# -- chapter 7 ----------------------------------------------------------------------------------------------


def algorithm_2(library: Any, finger: str) -> Figure:
    """What the penalty of algorithm 2 trades for what, against the closed form."""
    demands = Demands.feasible(library, finger, DEMANDS)
    searched = [demands.search(False, weight) for weight in WEIGHTS]
    violated = np.array([np.percentile(demands.violation(f), 90) for f in searched])
    missed = np.array([np.percentile(demands.miss(f), 90) for f in searched])
    ours = demands.closed_form()

    def draw(axes: Any) -> None:
        axes.loglog(WEIGHTS, violated, "o-", markersize=3, label="limits violated by [N]")
        axes.loglog(WEIGHTS, missed, "s-", markersize=3, label="stiffness missed by [N m/rad]")
        axes.set(xlabel="weight of the penalty", ylabel="90th percentile")
        axes.legend()

    return Figure(
        number="7 (algorithm 2)",
        title="What algorithm 2, mended, makes of demands that can be met",
        claim="The force limits are in practice achieved, since their weight can be large.",
        found=(
            "One case in ten "
            f"violates them by {violated.max():.2g} N or more at a light weight and misses the stiffness by "
            f"{missed.max():.2g} N m/rad or more at a heavy one; the closed form violates nothing and misses "
            f"{demands.miss(ours).max():.0e}."
        ),
        holds=bool(np.any((violated < VISIBLE) & (missed < 0.01))),
        draw=draw,
    )


# -- chapter 8 ----------------------------------------------------------------------------------------------


def correction(library: Any, joint: Joint) -> Figure:
    """Figure 8.3: the controller's stiffness follows what a disturbance makes of the tendons' stiffness."""
    curves = []
    for felt in FELT:
        even = np.linspace(joint.spring.f[0], joint.spring.f[-1], 400)
        mean = np.interp(EPSILON * felt, joint.stiffness(np.stack([even, even], axis=-1)), even)
        reach = 0.9 * 2 * joint.R * min(mean - joint.spring.f[0], joint.spring.f[-1] - mean)
        load = np.linspace(-reach, reach, 201)
        shift = load[:, None] / (2 * joint.R) * np.array([1, -1])
        tendons = joint.stiffness(mean + shift)
        controller = library.stiffness_correction_scalar(felt, tendons)
        given = np.cumsum(1 / tendons) * (load[1] - load[0])
        deflexion = given - given[len(load) // 2] + load / controller.k_imp
        secant = np.divide(load, deflexion, out=np.full_like(load, felt), where=np.abs(load) > reach / 10)
        curves.append((load, tendons, controller.k_imp, secant, controller.status))
    worst = max(np.abs(curve[3] / felt - 1).max() for curve, felt in zip(curves, FELT, strict=True))
    changes = max(np.ptp(curve[1]) / curve[1].mean() for curve in curves)

    def draw(axes: Any) -> None:
        for load, tendons, controller, secant, _ in curves:
            axes.plot(load, controller, color="tab:red", linewidth=0.8)
            axes.plot(load, tendons, ":", color="tab:blue")
            axes.plot(load, secant, "-.", color="tab:green")
        axes.set(xlabel="disturbance [N m]", ylabel="stiffness [N m/rad]")
        axes.legend(["controller", "tendons", "felt: load per deflexion"], loc="upper right", ncols=3)
        axes.set_ylim(top=1.15 * axes.get_ylim()[1])

    return Figure(
        number="8.3",
        title="Stiffness correction under a disturbance",
        claim=(
            f"The felt stiffness stays around {' and '.join(f'{felt:g}' for felt in FELT)} N m/rad although the "
            "disturbance changes that of the tendons."
        ),
        found=f"It stays within {worst:.1%}, while the stiffness of the tendons changes by {changes:.0%}.",
        holds=bool(worst < 0.1 and not any(np.any(curve[4]) for curve in curves)),
        draw=draw,
    )


# -- chapter 9 ----------------------------------------------------------------------------------------------


def observer(library: Any) -> Figure:
    """Figure 9.3: a slow sine with low stiffness and damping, with and without the observed friction fed forward."""
    runs = {fed: tracked(library, fed) for fed in (False, True)}
    errors = {fed: float(np.sqrt(np.mean((run[0] - run[1]) ** 2))) for fed, run in runs.items()}
    busy = {fed: float(np.abs(np.diff(run[2])).sum()) for fed, run in runs.items()}

    def draw(axes: Any) -> None:
        times = np.arange(len(runs[True][0])) * PERIOD
        axes.plot(times, runs[True][0], ":", label="desired")
        axes.plot(times, runs[False][1], linewidth=0.8, label="without compensation")
        axes.plot(times, runs[True][1], linewidth=0.8, label="with compensation")
        axes.set(xlabel="t [s]", ylabel="joint angle [rad]")
        axes.legend()

    return Figure(
        number="9.3",
        title="A slow sine with and without friction compensation",
        claim="Compensating the observed friction clearly improves the tracking.",
        found=(
            f"The error falls from {errors[False] * 1e3:.0f} to {errors[True] * 1e3:.1f} mrad (r.m.s.), and the torque "
            f"travels {busy[True] / busy[False]:.1f} times as far; the text has it react violently."
        ),
        holds=errors[True] < errors[False] / 3,
        draw=draw,
    )


def tracked(library: Any, compensate: bool) -> tuple[Array, Array, Array]:
    """Desired angle, angle and torque (ticks) of a joint with dry friction, over two periods after the first."""
    inertia, K, D, substeps = 1e-4, 0.3, 0.004, 8
    q = qd = momentum = estimate = 0.0
    rows = []
    for tick in range(round(3 / SLOW / PERIOD)):
        phase = 2 * np.pi * SLOW * tick * PERIOD
        wanted, speed = AMPLITUDE * np.sin(phase), 2 * np.pi * SLOW * AMPLITUDE * np.cos(phase)
        tau = K * (wanted - q) + D * (speed - qd) + estimate * compensate
        rows.append((wanted, q, tau))
        for _ in range(substeps):
            qd += PERIOD / substeps / inertia * (tau - RUBBING * np.tanh(qd / 0.05))
            q += PERIOD / substeps * qd
        momentum, estimate, _ = library.friction_observer(momentum, tau, 0.0, qd, inertia, OBSERVER, PERIOD)
    wanted, angle, torque = np.array(rows)[round(1 / SLOW / PERIOD) :].T
    return wanted, angle, torque


# -- chapter 11 ---------------------------------------------------------------------------------------------


def force_steps(joint: Joint) -> list[Figure]:
    """Figure 11.1: what feed-forward and friction compensation do to a step of the pretension, the joint held."""
    held = replace(joint, inertia=1e6)
    smooth = replace(held, friction=(joint.friction[0], 0.0, joint.friction[2]))
    wanted = np.where(np.arange(TICKS) < STEP_AT, LOW_TENSION, 2.5 * LOW_TENSION)
    both = np.stack([wanted, wanted], axis=1)
    neither, only_second = np.zeros(2), np.array([0.0, 1.0])
    cases = [
        ("11.1a", "feed-forward of the force", smooth, Gains(0.0, 0.0, feed_forward=only_second)),
        ("11.1b", "friction compensation", held, Gains(0.0, 0.0, compensation=0.9 * only_second)),
    ]
    found = []
    for number, subject, plant, gains in cases:
        forces = plant.forces(plant.run(np.zeros_like(both) + neither, both, gains))[..., 0]
        errors = np.abs(forces[-1] - wanted[-1])
        arrivals = settling(times_of(forces), forces[STEP_AT:], wanted[-1], wanted[0], 0.1) * 1e3

        def draw(axes: Any, forces: Array = forces) -> None:
            times = np.arange(TICKS) * PERIOD
            axes.plot(times, wanted, "--", color="tab:green", label="desired")
            axes.plot(times, forces[:, 1], color="tab:red", linewidth=0.8, label="with")
            axes.plot(times, forces[:, 0], ":", color="tab:blue", label="without")
            axes.set(xlabel="t [s]", ylabel="tendon force [N]")
            axes.legend()

        found.append(Figure(
            number=number, title=f"A step of the tendon force with and without {subject}",
            claim=f"The {subject} improves the force step.",
            found=(
                f"At {TICKS * PERIOD:.1f} s the error is {errors[0]:.2g} N without and {errors[1]:.2g} N with it; the force "
                f"stays within 10 % of the step {_after(arrivals[0])} and {_after(arrivals[1])}."
            ),
            holds=bool(errors[1] < errors[0] / 2 and arrivals[1] <= arrivals[0]), draw=draw,
        ))  # fmt: skip
    return found


def times_of(run: Array) -> Array:
    """Times [s] of the ticks from the step on."""
    return np.arange(len(run) - STEP_AT) * PERIOD


def _after(arrival: float) -> str:
    return f"after {arrival:.0f} ms" if np.isfinite(arrival) else "not at all"


def joint_steps(joint: Joint) -> list[Figure]:
    """Figures 11.2 and 11.3: steps at two impedances of the same damping, and at two pretensions."""
    wanted = np.where(np.arange(TICKS) < STEP_AT, 0.0, STEP)[:, None].repeat(4, axis=1)
    tensions = np.array([40.0, 40.0, LOW_TENSION, HIGH_TENSION])
    K = np.array([SOFT, STIFF, STIFF, STIFF])
    gains = Gains(K, critical(joint, SOFT), kp=40.0, kd=0.4, compensation=0.9)
    q = joint.run(wanted, np.broadcast_to(tensions, wanted.shape), gains)[..., 0]
    beyond = overshoot(q, STEP, 0.0)

    def draw(first: int, labels: list[str]) -> Any:
        def on(axes: Any) -> None:
            times = np.arange(TICKS) * PERIOD
            axes.plot(times, wanted[:, 0], "--", color="tab:green", linewidth=0.8, label="desired")
            axes.plot(times, q[:, first : first + 2], linewidth=0.8, label=labels)
            axes.set(xlabel="t [s]", ylabel="joint angle [rad]")
            axes.legend()

        return on

    return [
        Figure(
            "11.2", "A step of the joint at two impedances (simulated)",
            "At the same damping a stiffer impedance oscillates more.",
            f"The overshoot goes from {beyond[0]:.1%} to {beyond[1]:.1%} from K = {K[0]:g} to {K[1]:g} N m/rad. {CHOSEN}",
            bool(beyond[1] > beyond[0] + 0.01), draw(0, [f"K = {each:g} N m/rad" for each in K[:2]]),
        ),
        Figure(
            "11.3", "A step of the joint at two pretensions (simulated)", "Stiffer tendons oscillate less.",
            f"The overshoot goes from {beyond[2]:.1%} to {beyond[3]:.1%} from {LOW_TENSION:g} to "
            f"{HIGH_TENSION:g} N. {CHOSEN}",
            bool(beyond[3] < beyond[2] - 0.01), draw(2, [f"pretension {f:g} N" for f in tensions[2:]]),
        ),
    ]  # fmt: skip


def critical(joint: Joint, K: float) -> float:
    """Damping [N m s/rad] that would be critical for the link on a spring of stiffness K."""
    return float(2 * np.sqrt(K * joint.inertia))


def sweep(joint: Joint) -> Figure:
    """Figure 11.4: sines of several frequencies at three pretensions, after a first period."""
    w = 2 * np.pi * np.repeat(SWEEP, len(TENSIONS))
    times = np.arange(round(SWEPT / PERIOD))[:, None] * PERIOD
    pulls = np.broadcast_to(np.tile(TENSIONS, len(SWEEP)), (len(times), len(w)))
    gains = Gains(RESONANT, critical(joint, SOFT), kp=40.0, kd=0.4, compensation=0.9)
    q = joint.run(STEP * np.sin(w * times), pulls, gains)[..., 0]
    window = np.where(times >= SWEPT - 2 * np.pi / w * np.floor(w * SWEPT / 4 / np.pi), 1.0, 0.0)
    window /= window.sum(axis=0)
    gain = (np.abs((window * q * np.exp(-1j * w * times)).sum(axis=0)) * 2 / STEP).reshape(len(SWEEP), -1)
    peaks = np.array(SWEEP)[gain.argmax(axis=0)]

    def draw(axes: Any) -> None:
        axes.plot(SWEEP, gain, "o-", markersize=3, linewidth=0.8, label=[f"pretension {f:g} N" for f in TENSIONS])
        axes.set(xlabel="frequency [Hz]", ylabel="amplitude of the angle per desired angle")
        axes.legend()

    return Figure(
        number="11.4",
        title="Gain of the joint over frequency at three pretensions (simulated)",
        claim="The resonance moves with the mechanical stiffness, so two time scales hold in a limited range.",
        found=(
            f"The gain is highest at {', '.join(f'{peak:g}' for peak in peaks)} Hz, where it is "
            f"{', '.join(f'{peak:.2f}' for peak in gain.max(axis=0))}. {CHOSEN}"
        ),
        holds=bool(np.all(np.diff(peaks) > 0)),
        draw=draw,
    )
