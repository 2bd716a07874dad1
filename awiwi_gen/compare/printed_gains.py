"""Gain sets that the source prints, on the plants that it prints them for: can they run at 3 kHz, and what near can?

As printed the plants have no friction, and the law sees the state itself; only the clock and one sample of delay are
added.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from awiwi_gen.loops.joint import TABLE_15_1, TABLE_16_1, Loop, impedance_loop, position_loop
from awiwi_gen.loops.nearest import Nearest, nearest
from awiwi_gen.loops.pair import TABLE_PAIR, TUNING, pair_loop
from awiwi_gen.loops.sampled import Report, report
from awiwi_gen.simulate import PERIOD

COLUMNS = ("law", "gains of", "plant", "spectral radius", "delay margin", "nearest that run", "verdict")
PLANTS = {"table 15.1": TABLE_15_1, "table 16.1": TABLE_16_1}
FAST = {"K_3": 100.0, "K_4": 100.0}  # of nearly all figures [1/s]
CHAIN = {"k1": 5.0, "k2": 1.0, "k3": 100.0, "k4": 100.0}  # 1/s
UNIT = {"C_t": 1.0, "C_s": 1.0}
IMPEDANCES = {"figure 15.16": (0.5, 0.05), "figure 15.17": (1.0, 0.05)}
SPARE = 1.8 * PERIOD  # s: the clock and one sample take 1.5 periods
POWERS = {"K_p": 2, "C_t": 0, "C_s": -2}  # of the bandwidth; all others grow with it
Gains = Mapping[str, float]
Make = Callable[[Gains], Loop]


@dataclass(frozen=True)
class PrintedGains:
    """One set: where it is printed, for which plant, what the clock says, and what near would run if it does not."""

    law: str
    where: str
    plant: str
    report: Report
    nearest: Nearest | None

    def cells(self) -> tuple[str, ...]:
        """A row of text."""
        runs = self.report.implementable
        if runs:
            instead = "-"
        elif self.nearest is None:
            instead = "none"
        elif self.nearest.changed == "bandwidth":
            instead = f"all at {self.nearest.factor:.3g} of the bandwidth"
        elif self.nearest.changed == "several":
            instead = ", ".join(f"{name} = {value:.3g}" for name, value in self.nearest.gains.items())
        else:
            instead = f"{self.nearest.changed} = {self.nearest.gains[self.nearest.changed]:.3g}"
        margin = f"{self.report.delay_margin * 1e6:.3g} us"
        return (
            self.law, self.where, self.plant, f"{self.report.radius:.4g}", margin, instead, "runs" if runs else "refused",
        )  # fmt: skip


def printed_gains(library: Any) -> Iterator[PrintedGains]:
    """All sets."""
    for name, plant in PLANTS.items():

        def chain(gains: Gains, plant: Any = plant) -> Loop:
            return position_loop(library, plant, tuple(gains.values()))

        yield _asked("backstepping_position", "figure 15.13", name, CHAIN, chain)
    for where, (K_p, K_d) in IMPEDANCES.items():
        for name, plant in PLANTS.items():

            def joint(gains: Gains, plant: Any = plant) -> Loop:
                K_p, K_d, K_3, K_4, C_t, C_s = gains.values()
                return impedance_loop(library, plant, (K_p, K_d, K_3, K_4), (C_t, C_s))

            yield _asked("backstepping_impedance", where, name, {"K_p": K_p, "K_d": K_d, **FAST, **UNIT}, joint)
    tuning = dict(zip(("K_3", "K_4", "C_t", "C_s"), TUNING, strict=True))
    yield _asked(
        "backstepping_antagonistic", "figure 15.23", "table 16.1", {"K_p": 0.5, "K_d": 0.05, **tuning},
        lambda gains: pair_loop(
            library.backstepping_antagonistic, TABLE_PAIR, tuple(gains.values())[:2], tuple(gains.values())[2:]
        )[0],
    )  # fmt: skip


def _asked(law: str, where: str, plant: str, gains: Gains, make: Make) -> PrintedGains:
    def works(chosen: Gains) -> bool:
        loop = make(chosen)
        return loop.sampled_radius() < 1 and loop.delay_margin() > SPARE

    loop = make(gains)
    found = report(loop.A, loop.B, loop.K)
    powers = {name: POWERS.get(name, 1) for name in gains}
    instead = None
    if not found.implementable:
        instead = nearest(gains, powers, works, lambda chosen: make(chosen).sampled_radius(2))
    return PrintedGains(law, where, plant, found, instead)
