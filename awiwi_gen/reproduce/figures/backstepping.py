"""Figures 15.1 to 15.13: the example of section 15.1 and the position law of section 15.2, with the compiled laws.

Figures 15.7 and 15.8 are shown twice. For the law that the text derives (eq. 15.27 to 15.43) their claims are false;
for the impedance law of section 15.3, with a link of unit inertia, they hold.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_15_1, TABLE_16_1, Plant, normalised_loop, position_loop, state_gains
from awiwi_gen.loops.joint import Loop as LinearLoop
from awiwi_gen.results import Figure, curves, shaded
from awiwi_gen.simulate import Actuator, Array, Block, Element, Loop, Scenario, Sum, Trace, simulate

STEP = 0.8  # rad, as captioned
FIGURE_15_1 = np.array([0.01, 2.0, 5.0, 7.5, 10.0]), np.linspace(0.5, 10.0, 10)
PHASES = {"15.2": (0.1, 5.0), "15.3": (1.0, 1.0), "15.4": (5.0, 0.1)}
SWEEP = (0.2, 1.0, 5.0, 50.0)
OUTER = (100.0, 100.0)  # K3, K4 of table 15.1
SATURATION = 0.0005  # N m
DELAYS = (0.0, 1e-4, 2e-4, 5e-4, 1e-3)
SERVO = 333e-6  # s, of a complete round trip


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    laws = {"position law": position_loop, "impedance law": normalised_loop}
    return [
        convergence(library),
        *(phases(library, number, gains) for number, gains in PHASES.items()),
        *(sweep(library, which, name, build) for which in (1, 2) for name, build in laws.items()),
        *saturation(library),
        delay(library),
    ]


def run_example(library: Any, starts: Array, gains: Array) -> tuple[Array, bool, float]:
    """The example of section 15.1 under the compiled law for 60 s; runs differ in start and gains.

    States (ticks, runs, 2), whether the energy V falls all the way, and the largest x1 at the end. The example's
    polynomial x1^2 - x1^3 is the torque of a cubic spring.
    """
    drift = {"deflexion": "x[0]", "deflexion_des": "x[0]", "torque": "drift", "k": "unused"}
    plant: list[Element] = [
        Block("secant_stiffness", drift),
        Sum("xd[0]", (1.0, "drift"), (1.0, "x[1]")),
        Block("backstepping_academic", {"k": "gains", "u": "xd[1]"}),
    ]
    scenarios = [
        Scenario({"x": x, "gains": k, "spring": (0.0, 1.0, -1.0)}, 3001)
        for x, k in zip(*np.broadcast_arrays(starts, gains), strict=True)
    ]
    traces = simulate(library, Loop(plant, [], {"x": "xd"}, period=0.02), scenarios, ["x"])
    states = np.stack([trace["x"] for trace in traces], axis=1)
    V = library.backstepping_academic_lyapunov(x=states, k=gains).V
    return states, bool((np.diff(V, axis=0) <= 1e-12).all()), float(np.abs(states[-1, :, 0]).max())


def convergence(library: Any) -> Figure:
    """Figure 15.1."""
    first, second = FIGURE_15_1
    k = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    trace, falling, left = run_example(library, np.ones_like(k), k)

    def draw(axes: Any) -> None:
        shaded(axes, np.linspace(0, 10, 501), trace[:501, :, 0].T, k.min(axis=1), "the smaller one of k1 and k2")
        axes.set(xlabel="t", ylabel="x1")

    return Figure(
        "15.1", "The example for 50 pairs of gains",
        "Every pair of positive gains brings the state to the origin.",
        f"All runs end within {left:.0e} after 60 s, and V falls all the way (eq. 15.10, corrected).",
        falling and left < 0.1, draw,
    )  # fmt: skip


def phases(library: Any, number: str, gains: tuple[float, float]) -> Figure:
    """Figures 15.2 to 15.4: one pair of gains from a ring of initial states."""
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    start = 2 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    trace, falling, left = run_example(library, start, np.array(gains))

    def draw(axes: Any) -> None:
        for states, style, label in ((trace, "C0-", "runs"), (start[None], "C1x", "initial states")):
            slopes = states[..., 0] ** 2 - states[..., 0] ** 3 + states[..., 1]
            first, *_ = axes.plot(states[..., 0], slopes, style, linewidth=0.8)
            first.set_label(label)
        axes.set(xlabel="x1", ylabel="x1'")
        axes.legend()

    return Figure(
        number, f"The example's phases for k1 = {gains[0]:g}, k2 = {gains[1]:g}",
        "Every initial state comes to the origin.",
        f"All runs end within {left:.0e} after 60 s, and V falls all the way.", falling and left < 0.1, draw,
    )  # fmt: skip


def sweep(library: Any, which: int, name: str, build: Callable[..., LinearLoop]) -> Figure:
    """Figures 15.7 (K1 swept, K2 = 1) and 15.8 (K2 swept, K1 = 5)."""
    times = np.linspace(0, 30, 3001)
    runs = {}
    for value in SWEEP:
        gains = (value, 1.0, *OUTER) if which == 1 else (5.0, value, *OUTER)
        runs[value] = build(library, TABLE_15_1, gains).step(STEP, times)
    rises = [rise(times, run) for run in runs.values()]
    overshoots = [max(float(run.max() / STEP - 1), 0.0) for run in runs.values()]
    shown = ", ".join(f"{v:g}: {r:.3g} s, {o:.0%}" for v, r, o in zip(SWEEP, rises, overshoots, strict=True))
    if which == 1:
        effect = "K1 is a stiffness: more of it is faster, and too much oscillates"
        holds = bool((np.diff(rises) < 0).all()) and overshoots[-1] > max(0.1, overshoots[0])
    else:
        effect = "K2 is a damping: more of it slows the link down"
        holds = bool((np.diff(rises) > 0).all())
    lines = {f"K{which} = {value:g}": run for value, run in runs.items()}
    return Figure(
        f"15.{6 + which} ({name})", f"Influence of K{which} on a step of {STEP:g} rad, {name}",
        f"{effect}.", f"Rise time and overshoot at K{which} = {shown}.", holds,
        curves(times, lines, "t [s]", "q [rad]", xlim=(0, 10)),
    )  # fmt: skip


def rise(times: Array, run: Array) -> float:
    """Time [s] from 10 to 90 percent of the step."""
    low, high = (int(np.argmax(run >= share * STEP)) for share in (0.1, 0.9))
    return float(times[high] - times[low]) if run.max() >= 0.9 * STEP else float("inf")


def held(
    library: Any, plant: Plant, rates: Any, until: float, tick: float, limit: float = np.inf, late: float = 0.0
) -> Trace:
    """A step under the position law: torques change every tick, have a limit [N m] and a delay [s]."""
    waits = round(late / tick)
    law: list[Element] = [
        Block("pole_placement_law", {"u": "command"}),
        Sum("queue", (1.0, ("command", f"queue[0:{waits}]") if waits else "command")),
    ]
    loop = Loop(
        [Block("plant_joint_linear")], law, {"x": "xd"},
        actuators=[Actuator(f"queue[{waits}]", "u", limit, late=False)], period=tick,
    )  # fmt: skip
    values = {
        "x": np.zeros(4), "plant": plant.numbers, "damping": np.zeros(2), "load": 0.0, "u_des": 0.0,
        "x_des": (STEP, 0.0, STEP, 0.0), "K": state_gains(plant, position_loop(library, plant, rates).K),
        "queue": np.zeros(waits + 1),
    }  # fmt: skip
    return simulate(library, loop, [Scenario(values, round(until / tick))], ["x", "u"])[0]


def saturation(library: Any) -> list[Figure]:
    """Figures 15.10 and 15.11: K1 = K2 = 1, with and without a limit."""
    gains = (1.0, 1.0, *OUTER)
    labels = {"free": np.inf, f"limit {SATURATION:g} N m": SATURATION}
    runs = {label: held(library, TABLE_16_1, gains, 6.0, 1e-4, limit) for label, limit in labels.items()}
    lighter = position_loop(library, TABLE_15_1, gains)
    light = lighter.response([-STEP, 0, 0, 0], runs["free"].time) @ lighter.K[0]
    peaks = [float(np.abs(torque).max()) for torque in (light, runs["free"]["u"])]
    left = max(abs(float(run["x"][-1, 0]) / STEP - 1) for run in runs.values())
    angles, torques = (
        {label: (run.time[::10], run[name][::10, 0]) for label, run in runs.items()} for name in ("x", "u")
    )
    return [
        Figure(
            "15.10", "A step with saturated torque: link, plant of table 16.1",
            "The law stays stable in spite of the limit.", f"Both runs end within {left:.1%} of the step.", left < 0.02,
            curves(None, angles, "t [s]", "q [rad]"),
        ),
        Figure(
            "15.11", "A step with saturated torque: command, plant of table 16.1",
            "The limit of 0.0005 N m cuts the command strongly.",
            f"With table 15.1, as captioned, the command stays below {peaks[0]:.1e} N m all by itself; with table "
            f"16.1, shown here, it would reach {peaks[1]:.1e} N m.", peaks[0] > SATURATION,
            curves(None, torques, "t [s]", "torque [N m]", xlim=(0, 0.3)),
        ),
    ]  # fmt: skip


def delay(library: Any) -> Figure:
    """Figure 15.13: K = (5, 1, 100, 100) behind delays."""
    gains = (5.0, 1.0, *OUTER)
    runs = {late: held(library, TABLE_15_1, gains, 2.0, 2e-5, late=late) for late in (*DELAYS, SERVO)}
    overshoot = float(runs[SERVO]["x"][:, 0].max() / STEP - 1)
    margin = position_loop(library, TABLE_15_1, gains).delay_margin()
    shown = {late: runs[late]["x"][::10, 0] for late in DELAYS}
    kept = {late: np.where(np.maximum.accumulate(np.abs(q)) > 2.0, np.nan, q) for late, q in shown.items()}
    lines = {f"{late * 1e3:g} ms": (runs[late].time[::10], q) for late, q in kept.items()}  # until they run away
    return Figure(
        "15.13", "A step behind delays",
        "At the 333 us of a round trip nothing oscillates, even with these large gains.",
        f"With table 15.1 it then overshoots by {overshoot:.0%}; the delay margin is {margin * 1e3:.2f} ms.",
        overshoot < 0.02, curves(None, lines, "t [s]", "q [rad]", ylim=(-0.2, 2.0)),
    )  # fmt: skip
