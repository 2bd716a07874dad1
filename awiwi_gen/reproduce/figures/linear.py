"""Figures 12.3, 12.4, 13.2, 13.3, 14.4 and 14.5: a joint with a spring under placed and under optimal gains.

Gains come from the compiled kernels. Loops that run on the hand's clock with a period of delay are shown on it; the
others in continuous time as in the source, and the claim says so.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_12_1, TABLE_12_1_TARGET, TABLE_13_1, TABLE_14_2
from awiwi_gen.loops.sampled import is_implementable, report
from awiwi_gen.loops.step import run, settling
from awiwi_gen.results import Draw, Figure, curves
from awiwi_gen.simulate import PERIOD, Array, Block, Scenario

STIFFNESSES = np.linspace(0.43, 1.15, 73)  # N m/rad, as captioned
COSTS_13 = (0.0001, 0.01, 1.0)
START = np.array([1.0, 0.0, 1.0, 0.0])
CURVE = (0.605, 1.0)  # spring of section 14.3, which prints none: twice as stiff under the load below
COST_14 = 0.01  # the R of table 14.2 does not run on a clock
STEP, LOAD = 0.5, 0.4  # rad, N m
LOAD_AT, END = 0.5, 1.0  # s


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [open_loop(), placed(library), *optimal(library), *state_dependent(library)]


def open_loop() -> Figure:
    """Figure 12.3."""
    by_spring, by_friction, as_captioned = (
        [np.linalg.eigvals(TABLE_12_1.with_(**{name: factor * each}).A) for each in STIFFNESSES]
        for name, factor in (("k", 1.0), ("dq", TABLE_12_1.dq), ("dq", 1.0))
    )
    slow = np.array([np.sort(np.abs(poles))[:2] for poles in by_spring])
    moved = float(np.ptp(slow[:, 1]) / slow[0, 1])
    fast = np.array([np.abs(poles).max() for poles in by_spring])
    real = max(poles[np.argmax(np.abs(poles))].real for poles in as_captioned)
    shown = {"spring 0.43 to 1.15 N m/rad": by_spring, "link friction 0.43 to 1.15 of table 12.1": by_friction}
    return Figure(
        "12.3", "Poles of the joint alone over the stiffness of its spring",
        "The third and fourth pole hardly move.",
        f"They move by {moved:.1%}, while the fast pair {'grows' if fast[-1] > fast[0] else 'falls'} from "
        f"{fast[0]:.0f} to {fast[-1]:.0f} 1/s. The captioned range of link friction is that of the spring; with it the "
        f"fastest pole would be at {real:.2g} 1/s or beyond.", moved < 0.05, _poles(shown),
    )  # fmt: skip


def placed(library: Any) -> Figure:
    """Figure 12.4."""
    K = library.pole_placement(**TABLE_12_1.ports, **TABLE_12_1_TARGET).K
    poles = [TABLE_12_1.with_(k=k).loop(K).poles() for k in STIFFNESSES]
    low, high = stable_band(K)
    shown = {"spring 0.43 to 1.15 N m/rad": poles, "nominal": [TABLE_12_1.loop(K).poles()]}
    return Figure(
        "12.4", "Poles under placed gains over the stiffness of the spring",
        "The poles are very sensitive, yet the gains do not lead to an unstable system.",
        "Sensitive they are, and the system is unstable: the loop is "
        f"stable from {low:.6f} to {high:.6f} N m/rad only, {(high - low) / (high + low):.2%} either way.",
        bool(all(p.real.max() < 0 for p in poles)), _poles(shown, xscale="symlog", yscale="symlog"),
    )  # fmt: skip


def stable_band(K: Array) -> tuple[float, float]:
    """Stiffnesses [N m/rad] around that of table 12.1 between which gains keep the joint stable."""

    def growth(k: float) -> float:
        return float(TABLE_12_1.with_(k=k).loop(K).poles().real.max())

    k = TABLE_12_1.k
    return tuple(brentq(growth, k, k * (1 + side), xtol=1e-12) for side in (-1e-2, 1e-2))


def _poles(groups: dict[str, list[Array]], **settings: Any) -> Draw:
    points = {label: np.concatenate(poles) for label, poles in groups.items()}
    lines = {label: (every.real, every.imag) for label, every in points.items()}
    return curves(None, lines, "real part [1/s]", "imaginary part [1/s]", ".", ".", markersize=2, **settings)


def optimal(library: Any) -> list[Figure]:
    """Figures 13.2 and 13.3, with the friction of table 12.1."""
    gains = {R: TABLE_13_1.optimum(library, R) for R in COSTS_13}
    times = np.arange(0, 0.4, PERIOD)
    runs = {R: TABLE_13_1.loop(K).response(START, times) for R, K in gains.items()}
    clocks = {R: is_implementable(TABLE_13_1.A, TABLE_13_1.B, K) for R, K in gains.items()}
    torques = {R: np.abs(states @ gains[R]).max() for R, states in runs.items()}
    settled = {R: float(settling(times, states[:, 0], 0.0, 1.0)) for R, states in runs.items()}
    refused = [f"R = {R:g} is {clock.reason}" for R, clock in clocks.items() if not clock.implementable]
    clocked = {R: on_the_clock(library, K, len(times)) for R, K in gains.items() if clocks[R].implementable}

    def positions(axes: Any) -> None:
        for index, (R, states) in enumerate(runs.items()):
            axes.plot(times, states[:, 2], linewidth=0.8, color=f"C{index}", label=f"motor, R = {R:g}")
            axes.plot(times, states[:, 0], ":", linewidth=0.8, color=f"C{index}")
            if R in clocked:
                axes.plot(times[::20], clocked[R][::20, 2], "x", markersize=3, color=f"C{index}")
        axes.plot([], [], ":", linewidth=0.8, color="gray", label="link")
        axes.plot([], [], "x", markersize=3, color="gray", label="motor on the clock")
        axes.set(xlabel="t [s]", ylabel="angle [rad]")
        axes.legend()

    shares = [torques[a] / torques[b] for a, b in pairwise(COSTS_13)]
    slower = max(settled.values()) / min(settled.values()) - 1
    inputs = {f"R = {R:g}": -states @ gains[R] for R, states in runs.items()}
    return [
        Figure(
            "13.2", "A joint under optimal gains, for three costs of torque",
            "A limited command costs settling time.",
            f"Settled after {', '.join(f'{1e3 * settled[R]:.0f} ms at R = {R:g}' for R in COSTS_13)}, {slower:.0%} more "
            f"at most. It is the weights of the speeds that decide. On the clock (crosses) {'; '.join(refused)}.",
            slower > 0.2, positions,
        ),
        Figure(
            "13.3", "The torques of figure 13.2",
            "The cost of torque sets its amplitude.",
            f"{', '.join(f'{torques[R]:.3g} N m at R = {R:g}' for R in COSTS_13)}, as the root of 1/R.",
            bool(np.allclose(shares, 10, rtol=0.2)), curves(times, inputs, "t [s]", "motor torque [N m]", yscale="symlog"),
        ),
    ]  # fmt: skip


def on_the_clock(library: Any, K: Array, ticks: int) -> Array:
    """States (ticks, 4) of table 13.1 from START under u = -K x, a period late."""
    law = Block("pole_placement_law", {"x_des": "goal", "u": "command"})
    values = {
        "x": START, "plant": TABLE_13_1.numbers, "damping": (TABLE_13_1.dq, TABLE_13_1.dtheta), "load": 0.0,
        "K": K, "goal": np.zeros(4), "u_des": 0.0,
    }  # fmt: skip
    return run(library, [Block("plant_joint_linear")], [law], Scenario(values, ticks), late=True)["x"]


def state_dependent(library: Any) -> list[Figure]:
    """Figures 14.4 and 14.5: a step, then a load that the law does not know of."""
    plant, ticks = TABLE_14_2, round(END / PERIOD)
    at_rest = plant.optimum(library, COST_14)
    values = plant.ports | {
        "x": np.zeros(4), "bodies": (plant.m, plant.b), "curve": CURVE, "damping": (plant.dq, plant.dtheta),
        "x_des": (STEP, 0.0, STEP, 0.0), "u_des": 0.0, "spring_known": (CURVE[0], 0.0, CURVE[1]),
        "weights": plant.weights, "R": COST_14, "K_last": at_rest,
    }  # fmt: skip
    adaptive = Block("sdre_joint", {"spring": "spring_known", "u": "command"})
    fixed = Block("pole_placement_law", {"K": "K_last", "u": "command"})
    load = np.where(np.arange(ticks) * PERIOD < LOAD_AT, 0.0, LOAD)
    scenario, joint = Scenario(values, ticks, {"load": load}), [Block("plant_joint_nonlinear")]
    traces = [
        run(library, joint, [law], scenario, watch, late=True)
        for law, watch in ((adaptive, ["x", "K"]), (fixed, ["x"]))
    ]
    times, gains = traces[0].time, traces[0]["K"] / at_rest
    difference = np.abs(traces[0]["x"] - traces[1]["x"])[:, 0]
    free = times < LOAD_AT
    apart, loaded = (float(difference[part].max()) for part in (free, ~free))
    change = [float(np.abs(gains[part] - 1).max()) for part in (free, ~free)]
    table = is_implementable(plant.A, plant.B, plant.optimum(library))
    runs = report(plant.A, plant.B, at_rest)
    angles = {name: trace["x"][:, 0] for name, trace in zip(("state-dependent", "fixed"), traces, strict=True)}
    shares = {f"K{index + 1}": gains[:, index] for index in range(4)} | {"fixed": np.ones(ticks)}
    return [
        Figure(
            "14.4", "State-dependent and fixed optimal gains, free and under a load",
            "No difference in free motion, a visible one under a load.",
            f"They are {apart * 1e3:.2g} mrad apart in free motion and {loaded * 1e3:.0f} mrad under {LOAD} N m. "
            f"With R = {COST_14:g} the fixed gains are {runs.reason}; those of table 14.2 are {table.reason}.",
            bool(apart < 0.05 * STEP < 5 * loaded and runs.implementable),
            curves(times, angles, "t [s]", "link angle [rad]", "-", "--"),
        ),
        Figure(
            "14.5", "Gains of figure 14.4",
            "The gains follow the stiffness, which only a load changes.",
            f"They change by {change[0]:.0%} in free motion and by {change[1]:.0%} under load.",
            change[1] > 2 * change[0], curves(times, shares, "t [s]", "gain, as a share of the fixed one", *"----:"),
        ),
    ]  # fmt: skip
