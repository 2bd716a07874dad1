"""Gain sets that the source prints, on the plants that it prints them for: can they run at 3 kHz, and what near can?

As printed the plants have no friction, and the law sees the state itself; only the clock and one sample of delay are
added. What is slower keeps its form: every gain by its power of the bandwidth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.studies.joint_loops import TABLE_15_1, TABLE_16_1, Loop, Plant, impedance_loop, position_loop
from awiwi_gen.studies.pair_loops import TABLE_PAIR, TUNING, pair_loop
from awiwi_gen.studies.sampling import Answer, is_implementable

COLUMNS = ("law", "gains", "plant", "spectral radius", "delay margin", "nearest that run", "verdict")
PLANTS = {"table 15.1": TABLE_15_1, "table 16.1": TABLE_16_1}
FAST = (100.0, 100.0)  # K_3 and K_4 of nearly all figures [1/s]
CHAIN = (5.0, 1.0, *FAST)  # 1/s, of figure 15.13
IMPEDANCES = {
    "figure 15.16": (0.5, 0.05),
    "figure 15.17": (1.0, 0.05),
}
Make = Callable[[float], Loop]


@dataclass(frozen=True)
class PrintedGains:
    """One set: where it is printed, its loop at a share of the bandwidth, and what the clock says."""

    law: str
    where: str
    plant: str
    answer: Answer

    def cells(self) -> tuple[str, ...]:
        """A row of text."""
        report = self.answer.report
        margin = "any" if report.delay_margin == np.inf else f"{report.delay_margin * 1e6:.3g} us"
        nearest = "-"
        if not self.answer.implementable:
            nearest = f"at {self.answer.bandwidth:.3g} of the bandwidth" if self.answer.nearest else "none slower"
        verdict = "runs" if self.answer.implementable else "refused"
        return (self.law, self.where, self.plant, f"{report.radius:.4g}", margin, nearest, verdict)


def printed_gains(library: Any) -> Iterator[PrintedGains]:
    """All sets."""
    for name, plant in PLANTS.items():
        yield _asked("backstepping_position", "figure 15.13", name, _chain(library, plant))
    for where, impedance in IMPEDANCES.items():
        for name, plant in PLANTS.items():
            yield _asked("backstepping_impedance", where, name, _joint(library, plant, impedance))
    yield _asked("backstepping_antagonistic", "figure 15.23", "table 16.1", _pair(library, (0.5, 0.05)))


def _asked(law: str, where: str, plant: str, make: Make) -> PrintedGains:
    loop = make(1.0)
    return PrintedGains(law, where, plant, is_implementable(loop.A, loop.B, loop.K, design=lambda share: make(share).K))


def _chain(library: Any, plant: Plant) -> Make:
    return lambda share: position_loop(library, plant, tuple(rate * share for rate in CHAIN))


def _joint(library: Any, plant: Plant, impedance: tuple[float, float]) -> Make:
    K_p, K_d = impedance
    return lambda share: impedance_loop(
        library, plant, (K_p * share**2, K_d * share, *(rate * share for rate in FAST)), (1.0, share**-2)
    )


def _pair(library: Any, impedance: tuple[float, float]) -> Make:
    K_p, K_d = impedance
    K_3, K_4, C_t, C_s = TUNING

    def make(share: float) -> Loop:
        tuning = (K_3 * share, K_4 * share, C_t, C_s * share**-2)
        return pair_loop(library.backstepping_antagonistic, TABLE_PAIR, (K_p * share**2, K_d * share), tuning)[0]

    return make
