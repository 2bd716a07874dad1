"""Searches for the nearest law that is stable.

``nearest`` changes one gain alone, or scales all gains to another bandwidth; if that fails, a descent changes in each
step the gain that helps most.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product

WIDEST = 1e3  # largest factor on a gain
MOVES = 24  # steps of the search up to that factor
HALVINGS = 10
DESCENTS = 60  # steps of the descent, each by one move of one gain

Gains = Mapping[str, float]


def least(works: Callable[[float], bool], steps: int, halvings: int) -> tuple[float, float] | None:
    """Bracket of the least share of 1 that works: the last that fails, the first that works; None if no step works."""
    first = next((step for step in range(1, steps + 1) if works(step / steps)), None)
    return None if first is None else bisected(works, (first - 1) / steps, first / steps, halvings)


def bisected(works: Callable[[float], bool], fails: float, best: float, halvings: int) -> tuple[float, float]:
    """A bracket, after so many halvings, of where a search begins to work."""
    for _ in range(halvings):
        middle = (fails + best) / 2
        fails, best = (fails, middle) if works(middle) else (middle, best)
    return fails, best


@dataclass(frozen=True)
class Nearest:
    """The changed gain, or "bandwidth", or "several"; the factor; and all gains."""

    changed: str
    factor: float
    gains: Gains


def nearest(
    gains: Gains, powers: Mapping[str, float], works: Callable[[Gains], bool], radius: Callable[[Gains], float]
) -> Nearest | None:
    """The gains that work with the smallest factor, else those of the descent, or None.

    A gain is proportional to a power of the bandwidth, given in ``powers``. ``radius`` is what the descent reduces. The
    search is deterministic.
    """
    most = max(abs(power) for power in powers.values())  # the factor is that of the gain that changes most
    directions = {"bandwidth": {name: power / most for name, power in powers.items()}}
    directions |= {name: {name: 1.0} for name in gains}

    def moved(name: str, exponent: float) -> dict[str, float]:
        factors = {key: float(WIDEST ** (exponent * directions[name].get(key, 0))) for key in gains}
        return {key: value * factors[key] for key, value in gains.items()}

    def runs(name: str, sign: int, exponent: float) -> bool:
        return works(moved(name, sign * exponent))

    for step, name, sign in product(range(1, MOVES + 1), directions, (-1, 1)):
        if runs(name, sign, step / MOVES):
            _, best = bisected(partial(runs, name, sign), (step - 1) / MOVES, step / MOVES, HALVINGS)
            share = sign * best / (most if name == "bandwidth" else 1)
            return Nearest(name, float(WIDEST**share), moved(name, sign * best))
    return _descent(gains, works, radius)


def _descent(gains: Gains, works: Callable[[Gains], bool], radius: Callable[[Gains], float]) -> Nearest | None:
    """Gains that work, by steepest descent of the radius along single gains; None where the descent ends earlier."""
    chosen, smallest, step = dict(gains), radius(gains), float(WIDEST ** (1 / MOVES))
    for _ in range(DESCENTS):
        trials = [chosen | {name: chosen[name] * factor} for name in chosen for factor in (1 / step, step)]
        radii = [radius(trial) for trial in trials]
        best = min(range(len(trials)), key=radii.__getitem__)
        if not radii[best] < smallest:
            return None
        chosen, smallest = trials[best], radii[best]
        if works(chosen):
            widest = max(max(chosen[name] / gains[name], gains[name] / chosen[name]) for name in gains)
            return Nearest("several", widest, chosen)
    return None
