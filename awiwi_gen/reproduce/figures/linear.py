"""Figures 12.3, 12.4, 13.2, 13.3, 14.4 and 14.5: a joint with a spring under placed and under optimal gains.

Gains come from the compiled kernels. What runs on the hand's clock with a period of delay is shown on it; what does
not is shown as the source has it, in continuous time, and the claim says so.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from awiwi_gen.hand import Hand
from awiwi_gen.loops.clocked import Array, run, settling
from awiwi_gen.loops.linear_joint import TABLE_12_1, TABLE_12_1_TARGET, TABLE_13_1, TABLE_14_2
from awiwi_gen.loops.sampled import PERIOD, is_implementable, report, sampled
from awiwi_gen.results import Figure

STIFFNESSES = np.linspace(0.43, 1.15, 73)  # N m/rad, as captioned
COSTS_13 = (0.0001, 0.01, 1.0)
START = np.array([1.0, 0.0, 1.0, 0.0])
SPRING = np.array([0.605, 0.0, 1.0])  # of section 14.3, which prints none: twice as stiff under the load below
COST_14 = 0.01  # the R of table 14.2 does not run on a clock
STEP, LOAD = 0.5, 0.4  # rad, N m
LOAD_AT, END = 0.5, 1.0  # s


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [open_loop(), placed(library), *optimal(library), *state_dependent(library)]


# -- chapter 12 -----------------------------------------------------------------------------------------------


def open_loop() -> Figure:
    """Figure 12.3."""
    by_spring = [np.linalg.eigvals(TABLE_12_1.with_(k=k).A) for k in STIFFNESSES]
    by_friction = [np.linalg.eigvals(TABLE_12_1.with_(dq=share * TABLE_12_1.dq).A) for share in STIFFNESSES]
    as_captioned = [np.linalg.eigvals(TABLE_12_1.with_(dq=d).A) for d in STIFFNESSES]
    slow = np.array([np.sort(np.abs(poles))[:2] for poles in by_spring])
    moved = float(np.ptp(slow[:, 1]) / slow[0, 1])
    fast = np.array([np.abs(poles).max() for poles in by_spring])

    def draw(axes: Any) -> None:
        _scatter(axes, by_spring, "spring 0.43 to 1.15 N m/rad")
        _scatter(axes, by_friction, "link friction 0.43 to 1.15 of table 12.1")
        axes.set(xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
        axes.legend()

    real = max(poles[0].real for poles in ([p[np.argsort(-np.abs(p))] for p in as_captioned]))
    return Figure(
        "12.3", "Poles of the joint alone over the stiffness of its spring",
        "The third and fourth pole hardly move.",
        f"They move by {moved:.1%}, while the fast pair grows from {fast[0]:.0f} to "
        f"{fast[-1]:.0f} 1/s. The captioned range of link friction is that of the spring; with it the fastest pole would "
        f"be at {real:.2g} 1/s or beyond.",
        moved < 0.05, draw,
    )  # fmt: skip


def placed(library: Any) -> Figure:
    """Figure 12.4."""
    K = library.pole_placement(**TABLE_12_1.numbers, **TABLE_12_1_TARGET).K
    poles = [np.linalg.eigvals(TABLE_12_1.with_(k=k).closed(K)) for k in STIFFNESSES]
    low, high = stable_band(K)

    def draw(axes: Any) -> None:
        _scatter(axes, poles, "spring 0.43 to 1.15 N m/rad")
        nominal = np.linalg.eigvals(TABLE_12_1.closed(K))
        axes.plot(nominal.real, nominal.imag, "s", markersize=4, label="nominal")
        axes.set(xlabel="real part [1/s]", ylabel="imaginary part [1/s]", xscale="symlog", yscale="symlog")
        axes.legend()

    return Figure(
        "12.4", "Poles under placed gains over the stiffness of the spring",
        "The poles are very sensitive, yet the gains do not lead to an unstable system.",
        "Sensitive they are, and the system is unstable: the loop is "
        f"stable from {low:.6f} to {high:.6f} N m/rad only, {(high - low) / (high + low):.2%} either way.",
        bool(all(p.real.max() < 0 for p in poles)), draw,
    )  # fmt: skip


def stable_band(K: Array) -> tuple[float, float]:
    """Stiffnesses [N m/rad] around that of table 12.1 between which gains keep the joint stable."""

    def growth(k: float) -> float:
        return float(np.linalg.eigvals(TABLE_12_1.with_(k=k).closed(K)).real.max())

    k = TABLE_12_1.k
    return tuple(brentq(growth, k, k * (1 + side), xtol=1e-12) for side in (-1e-2, 1e-2))


# -- chapter 13 -----------------------------------------------------------------------------------------------


def optimal(library: Any) -> list[Figure]:
    """Figures 13.2 and 13.3, with the friction of table 12.1."""
    plants = {R: TABLE_13_1.optimum(library, R) for R in COSTS_13}
    times = np.arange(0, 0.4, PERIOD)
    runs, clocks = {}, {}
    for R, K in plants.items():
        clocks[R] = is_implementable(TABLE_13_1.A, TABLE_13_1.B, K)
        runs[R] = _continuous(TABLE_13_1.closed(K), times)
    torques = {R: np.abs(states @ plants[R]).max() for R, states in runs.items()}
    settled = {R: float(settling(times, states[:, :1], 0.0, 1.0)[0]) for R, states in runs.items()}
    refused = [f"R = {R:g} is {clock.reason}" for R, clock in clocks.items() if not clock.implementable]

    def positions(axes: Any) -> None:
        for index, (R, states) in enumerate(runs.items()):
            axes.plot(times, states[:, 2], linewidth=0.8, color=f"C{index}", label=f"motor, R = {R:g}")
            axes.plot(times, states[:, 0], ":", linewidth=0.8, color=f"C{index}")
        for index, (R, K) in enumerate(plants.items()):
            if clocks[R].implementable:
                ticks = _clocked(sampled(TABLE_13_1.A, TABLE_13_1.B, K), len(times))
                axes.plot(times[::20], ticks[::20, 2], "x", markersize=3, color=f"C{index}")
        axes.set(xlabel="t [s]", ylabel="angle [rad]")
        axes.legend()

    def inputs(axes: Any) -> None:
        for R, states in runs.items():
            axes.plot(times, -states @ plants[R], linewidth=0.8, label=f"R = {R:g}")
        axes.set(xlabel="t [s]", ylabel="motor torque [N m]", yscale="symlog")
        axes.legend()

    shares = [torques[a] / torques[b] for a, b in pairwise(COSTS_13)]
    slower = max(settled.values()) / min(settled.values()) - 1
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
            bool(np.allclose(shares, 10, rtol=0.2)), inputs,
        ),
    ]  # fmt: skip


def _continuous(closed: Array, times: Array) -> Array:
    """States (times, 4) from START."""
    step, states = expm(closed * (times[1] - times[0])), [START]
    for _ in times[1:]:
        states.append(step @ states[-1])
    return np.array(states)


def _clocked(loop: Array, ticks: int) -> Array:
    """States of a sampled loop from START."""
    states = [np.append(START, np.zeros(len(loop) - 4))]
    for _ in range(ticks - 1):
        states.append(loop @ states[-1])
    return np.array(states)


# -- chapter 14 -----------------------------------------------------------------------------------------------


def state_dependent(library: Any) -> list[Figure]:
    """Figures 14.4 and 14.5: a step, then a load that the law does not know of."""
    at_rest = TABLE_14_2.optimum(library, COST_14)
    given = {**TABLE_14_2.inertias, "spring": SPRING, "weights": TABLE_14_2.weights, "R": COST_14, "K_last": at_rest}
    goal = np.array([STEP, 0.0, STEP, 0.0])

    def rates(x: Array, u: Array, time: float) -> Array:
        q, qd, theta, thd = x
        torque = SPRING @ ((theta - q) ** np.arange(1, 4)[:, None])
        load = LOAD * (time >= LOAD_AT)
        m, b, dq, dtheta = (TABLE_14_2.inertias[name] for name in ("m", "b", "dq", "dtheta"))
        return np.stack([qd, (torque - dq * qd + load) / m, thd, (u - torque - dtheta * thd) / b])

    def law(x: Array, _: float) -> Array:
        found = library.sdre_joint(**given, x=x[:, 0], x_des=goal)
        return np.array([float(found.u), float(-at_rest @ (x[:, 1] - goal))])

    times, states, _ = run(rates, law, np.zeros((4, 2)), END)
    adapted, constant = states[:, 0, 0], states[:, 0, 1]
    gains = library.sdre_joint(**given, x=states[:, :, 0], x_des=goal).K
    free = times < LOAD_AT
    apart, loaded = (float(np.abs((adapted - constant)[part]).max()) for part in (free, ~free))
    change = [float(np.abs(gains[part] / at_rest - 1).max()) for part in (free, ~free)]
    table = is_implementable(TABLE_14_2.A, TABLE_14_2.B, TABLE_14_2.optimum(library, TABLE_14_2.R))
    runs = report(TABLE_14_2.A, TABLE_14_2.B, at_rest)

    def positions(axes: Any) -> None:
        axes.plot(times, adapted, linewidth=0.8, label="state-dependent")
        axes.plot(times, constant, "--", linewidth=0.8, label="fixed")
        axes.set(xlabel="t [s]", ylabel="link angle [rad]")
        axes.legend()

    def shares(axes: Any) -> None:
        for index in range(4):
            axes.plot(times, gains[:, index] / at_rest[index], linewidth=0.8, label=f"K{index + 1}")
        axes.axhline(1.0, linestyle=":", linewidth=0.8, color="red")
        axes.set(xlabel="t [s]", ylabel="gain, as a share of the fixed one")
        axes.legend()

    return [
        Figure(
            "14.4", "State-dependent and fixed optimal gains, free and under a load",
            "No difference in free motion, a visible one under a load.",
            f"They are {apart * 1e3:.2g} mrad apart in free motion and {loaded * 1e3:.2g} mrad under {LOAD} N m. "
            f"With R = {COST_14:g} the fixed gains are {runs.reason}; those of table 14.2 are {table.reason}.",
            bool(apart < 0.05 * STEP < 5 * loaded and runs.implementable), positions,
        ),
        Figure(
            "14.5", "Gains of figure 14.4",
            "The gains follow the stiffness, which only a load changes.",
            f"They change by {change[0]:.0%} in free motion and by {change[1]:.0%} under load.",
            change[1] > 2 * change[0], shares,
        ),
    ]  # fmt: skip


def _scatter(axes: Any, poles: list[Array], label: str) -> None:
    every = np.concatenate(poles)
    axes.plot(every.real, every.imag, ".", markersize=2, label=label)
