"""Figures 15.1 to 15.13: the example of section 15.1 and the position law of section 15.2, with the compiled laws.

Figures 15.7 and 15.8 are shown twice. For the law that the text derives (eq. 15.27 to 15.43) they claim the opposite of
what happens; for the impedance law of section 15.3, with a link of unit inertia, they come out as described.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import expm

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_15_1, TABLE_16_1, Array, Loop, normalised_loop, position_loop
from awiwi_gen.results import Figure

STEP = 0.8  # rad, as captioned
FIGURE_15_1 = np.array([0.01, 2.0, 5.0, 7.5, 10.0]), np.linspace(0.5, 10.0, 10)
PHASES = {"15.2": (0.1, 5.0), "15.3": (1.0, 1.0), "15.4": (5.0, 0.1)}
SWEEP = (0.2, 1.0, 5.0, 50.0)
OUTER = (100.0, 100.0)  # K3, K4 of table 15.1
SATURATION = 0.0005  # N m
DELAYS = (0.0, 1e-4, 2e-4, 5e-4, 1e-3)
SERVO = 333e-6  # s, of a complete round trip
DIVERGED = 1e6  # where a simulation that runs away is held

Builder = Callable[..., Loop]


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    laws: dict[str, Builder] = {"position law": position_loop, "impedance law": normalised_loop}
    return [
        convergence(library),
        *(phases(library, number, gains) for number, gains in PHASES.items()),
        *(sweep(library, which, name, build) for which in (1, 2) for name, build in laws.items()),
        *saturation(library),
        delay(library),
    ]


# -- section 15.1 ------------------------------------------------------------------------------------------


def run_example(library: Any, x: Array, k: Array, until: float, ticks: int) -> tuple[Array, Array]:
    """States (ticks + 1, ..., 2) of the example under the compiled law, and its energy V along the way."""

    def flow(x: Array) -> Array:
        u = library.backstepping_academic(x=x, k=k).u
        first = x[..., 0]
        return np.stack([first**2 - first**3 + x[..., 1], u], axis=-1)

    h, states = until / ticks, [x]
    for _ in range(ticks):
        x = states[-1]
        a = flow(x)
        b = flow(x + h / 2 * a)
        c = flow(x + h / 2 * b)
        states.append(x + h / 6 * (a + 2 * b + 2 * c + flow(x + h * c)))
    trace = np.array(states)
    return trace, library.backstepping_academic_lyapunov(x=trace, k=k).V


def convergence(library: Any) -> Figure:
    """Figure 15.1."""
    first, second = FIGURE_15_1
    k = np.stack(np.broadcast_arrays(first[:, None], second), axis=-1)
    trace, V = run_example(library, np.ones((*k.shape[:2], 2)), k, 60.0, 3000)
    falling, left = bool((np.diff(V, axis=0) <= 1e-12).all()), np.abs(trace[-1, ..., 0]).max()

    def draw(axes: Any) -> None:
        axes.plot(np.linspace(0, 10, 501), trace[:501, ..., 0].reshape(501, -1), linewidth=0.6)
        axes.set(xlabel="t", ylabel="x1")

    return Figure(
        number="15.1",
        title="The example for 50 pairs of gains",
        claim="Every pair of positive gains brings the state to the origin.",
        found=f"All runs end within {left:.0e} after 60 s, and V falls all the way, with the control of eq. 15.10 mended.",
        holds=falling and bool(left < 0.1),
        draw=draw,
    )


def phases(library: Any, number: str, gains: tuple[float, float]) -> Figure:
    """Figures 15.2 to 15.4: one pair of gains from a ring of initial states."""
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    start = 2 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    trace, V = run_example(library, start, np.array(gains), 60.0, 3000)
    falling, left = bool((np.diff(V, axis=0) <= 1e-12).all()), np.abs(trace[-1, :, 0]).max()

    def draw(axes: Any) -> None:
        for states, style in ((trace, "-"), (start[None], "x")):
            axes.plot(states[..., 0], states[..., 0] ** 2 - states[..., 0] ** 3 + states[..., 1], style, linewidth=0.6)
        axes.set(xlabel="x1", ylabel="x1'")

    return Figure(
        number=number,
        title=f"The example's phases for k1 = {gains[0]:g}, k2 = {gains[1]:g}",
        claim="Every initial state comes to the origin.",
        found=f"All runs end within {left:.0e} after 60 s, and V falls all the way.",
        holds=falling and bool(left < 0.1),
        draw=draw,
    )


# -- section 15.2 ------------------------------------------------------------------------------------------


def sweep(library: Any, which: int, name: str, build: Builder) -> Figure:
    """Figures 15.7 (K1 swept, K2 = 1) and 15.8 (K2 swept, K1 = 5)."""
    times = np.linspace(0, 30, 3001)
    runs = {}
    for value in SWEEP:
        gains = (value, 1.0, *OUTER) if which == 1 else (5.0, value, *OUTER)
        runs[value] = step_response(build(library, TABLE_15_1, gains), times)
    rises = [rise(times, run) for run in runs.values()]
    overshoots = [max(float(run.max() / STEP - 1), 0.0) for run in runs.values()]
    shown = ", ".join(f"{v:g}: {r:.3g} s, {o:.0%}" for v, r, o in zip(SWEEP, rises, overshoots, strict=True))
    if which == 1:
        told = "K1 is a stiffness: more of it is faster, and too much oscillates"
        holds = monotone(rises[::-1]) and overshoots[-1] > max(0.1, overshoots[0])
    else:
        told = "K2 is a damping: more of it slows the link down"
        holds = monotone(rises)

    def draw(axes: Any) -> None:
        for value, run in runs.items():
            axes.plot(times, run, linewidth=0.8, label=f"K{which} = {value:g}")
        axes.set(xlabel="t [s]", ylabel="q [rad]", xlim=(0, 10))
        axes.legend()

    return Figure(
        number=f"15.{6 + which} ({name})",
        title=f"Influence of K{which} on a step of {STEP:g} rad, {name}",
        claim=f"{told}.",
        found=f"Rise time and overshoot at K{which} = {shown}.",
        holds=holds,
        draw=draw,
    )


def monotone(values: Sequence[float]) -> bool:
    """Whether values grow all the way."""
    return all(a < b for a, b in pairwise(values))


def step_response(loop: Loop, times: Array) -> Array:
    """Position [rad] of the link after a step of the desired one."""
    response: Array = STEP + loop.response([-STEP, 0, 0, 0], times)[:, 0]
    return response


def rise(times: Array, run: Array) -> float:
    """Time [s] from 10 to 90 percent of the step."""
    low, high = (int(np.argmax(run >= share * STEP)) for share in (0.1, 0.9))
    return float(times[high] - times[low]) if run.max() >= 0.9 * STEP else float("inf")


def held(loop: Loop, until: float, tick: float, limits: Any = np.inf, late: Any = 0.0) -> tuple[Array, Array]:
    """Positions and torques (ticks, cases) of a step: torques held for a tick, cut at limits, late by some time [s]."""
    limit, waits = np.broadcast_arrays(np.atleast_1d(limits), np.round(np.atleast_1d(late) / tick).astype(int))
    n, cases = len(loop.A), np.arange(len(limit))
    step = expm(np.block([[loop.A, loop.B], [np.zeros((1, n + 1))]]) * tick)
    count = round(until / tick)
    x = np.zeros((n, len(cases)))
    x[0] = -STEP
    positions, torques = np.empty((count, len(cases))), np.zeros((count + int(waits.max()), len(cases)))
    for i in range(count):
        positions[i] = STEP + x[0]
        torques[i + waits, cases] = np.clip(-loop.K[0] @ x, -limit, limit)
        x = np.clip(step[:n, :n] @ x + step[:n, n:] * torques[i], -DIVERGED, DIVERGED)
    return positions, torques[:count]


def saturation(library: Any) -> list[Figure]:
    """Figures 15.10 and 15.11: K1 = K2 = 1, with and without a limit."""
    gains, tick = (1.0, 1.0, *OUTER), 1e-4
    loop = position_loop(library, TABLE_16_1, gains)
    positions, torques = held(loop, 6.0, tick, (np.inf, SATURATION))
    lighter = position_loop(library, TABLE_15_1, gains)
    times = np.arange(0, 6.0, tick)
    light = -lighter.response([-STEP, 0, 0, 0], times) @ lighter.K[0]
    peaks = [float(np.abs(torque).max()) for torque in (light, torques[:, 0])]

    def draw(runs: Array, label: str, until: float) -> Callable[[Any], None]:
        def on(axes: Any) -> None:
            shown = round(until / tick)
            axes.plot(times[:shown:10], runs[:shown:10], linewidth=0.8, label=["free", f"limit {SATURATION:g} N m"])
            axes.set(xlabel="t [s]", ylabel=label)
            axes.legend()

        return on

    return [
        Figure(
            number="15.10",
            title="A step with saturated torque: link, plant of table 16.1",
            claim="The law stays stable in spite of the limit.",
            found=f"Both runs end within {np.abs(positions[-1] / STEP - 1).max():.1%} of the step.",
            holds=bool(np.abs(positions[-1] / STEP - 1).max() < 0.02),
            draw=draw(positions, "q [rad]", 6.0),
        ),
        Figure(
            number="15.11",
            title="A step with saturated torque: command, plant of table 16.1",
            claim="The limit of 0.0005 N m cuts the command strongly.",
            found=(
                f"With table 15.1, as captioned, the command stays below {peaks[0]:.1e} N m all by itself; with table "
                f"16.1, shown here, it would reach {peaks[1]:.1e} N m."
            ),
            holds=peaks[0] > SATURATION,
            draw=draw(torques, "torque [N m]", 0.3),
        ),
    ]


def delay(library: Any) -> Figure:
    """Figure 15.13: K = (5, 1, 100, 100) behind delays."""
    loop, tick = position_loop(library, TABLE_15_1, (5.0, 1.0, *OUTER)), 2e-5
    runs, _ = held(loop, 2.0, tick, late=(*DELAYS, SERVO))
    overshoot = float(runs[:, -1].max() / STEP - 1)

    def draw(axes: Any) -> None:
        labels = [f"{late * 1e3:g} ms" for late in DELAYS]
        axes.plot(np.arange(0, len(runs), 10) * tick, runs[::10, :-1], linewidth=0.8, label=labels)
        axes.set(xlabel="t [s]", ylabel="q [rad]", ylim=(-0.2, 2.0))
        axes.legend()

    return Figure(
        number="15.13",
        title="A step behind delays",
        claim="At the 333 us of a round trip nothing oscillates, even with these large gains.",
        found=(
            f"With table 15.1 it then overshoots by {overshoot:.0%}, and {loop.delay_margin() * 1e3:.2f} ms are all "
            "that the loop bears."
        ),
        holds=overshoot < 0.02,
        draw=draw,
    )
