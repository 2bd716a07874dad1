"""Figures 16.2 and 16.3: gains drawn at random for one optimum, and whether their steps look alike (chapter 16).

Nothing is near the optimum of table 16.1, which no gains with weights of 1 have. So each figure is shown twice: as
printed, and for a cheaper torque whose optimum can be had, with draws that are spread over magnitudes and a cost that
counts relative errors. Figure 16.3 shows ten runs on a finger; here they are ten draws of fewer samples.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_16_1, impedance_loop
from awiwi_gen.loops.regulator import regulator
from awiwi_gen.reproduce.gain_search import PRINTED_BOX, USEFUL_BOX, Box, draw, nearest
from awiwi_gen.results import Figure, curves

COSTS = np.diag([100.0, 0.01, 0.01, 0.01])
STEP, END = 0.5, 0.1
ALIKE = 0.1  # of the step: how far apart curves may be that look alike


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [
        draws(library, "16.2", "five draws as printed", 0.1, PRINTED_BOX, 5, 20000),
        draws(library, "16.2", "five draws, corrected", 1e-3, USEFUL_BOX, 5, 200000),
        draws(library, "16.3", "ten short searches, corrected", 1e-3, USEFUL_BOX, 10, 2000),
    ]


def draws(library: Any, number: str, title: str, R: float, box: Box, runs: int, samples: int) -> Figure:
    """Steps of the gains that several searches find."""
    wanted, corrected = regulator(TABLE_16_1, COSTS, R, cancelled=True), box is not PRINTED_BOX
    found = [nearest(library, TABLE_16_1, wanted, draw(box, samples, seed), corrected) for seed in range(runs)]
    loops = [impedance_loop(library, TABLE_16_1, each.gains) for each in found]
    times = np.linspace(0, END, 501)
    steps = np.array([loop.step(STEP, times) for loop in loops])
    slowest = [float(loop.poles().real.max()) for loop in loops]
    apart = float(np.ptp(steps, axis=0).max() / STEP)
    arrived = float(steps[:, -1].min() / STEP)
    lines = {f"search {seed + 1}": step for seed, step in enumerate(steps)}
    return Figure(
        f"{number} ({title})", f"Steps of drawn gains, {title}",
        "All drawn gains move the link alike.", "The curves are up to "
        f"{apart:.0%} of the step apart, have slowest poles from {min(slowest):.3g} to {max(slowest):.3g} 1/s, "
        f"and cover at least {arrived:.0%} of the step in {END * 1e3:.0f} ms.", apart < ALIKE and arrived > 0.95,
        curves(times * 1e3, lines, "t [ms]", "q [rad]"),
    )  # fmt: skip
