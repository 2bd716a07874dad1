"""The nearest gains that are stable: one gain changed alone, or all gains scaled to another bandwidth.

If that fails, a descent changes in each step the gain that helps most.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

WIDEST = 1e3  # largest factor on a gain
MOVES = 24  # steps of the search up to that factor
HALVINGS = 10
DESCENTS = 60  # steps of the descent, each by one move of one gain


@dataclass(frozen=True)
class Nearest:
    """The changed gain, or "bandwidth", or "several"; the factor; and all gains."""

    changed: str
    factor: float
    gains: Mapping[str, float]


def nearest(
    gains: Mapping[str, float],
    powers: Mapping[str, float],
    works: Callable[[Mapping[str, float]], bool],
    radius: Callable[[Mapping[str, float]], float],
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

    for step in range(1, MOVES + 1):
        for name in directions:
            for sign in (-1, 1):
                if works(moved(name, sign * step / MOVES)):
                    fails, best = (step - 1) / MOVES, step / MOVES
                    for _ in range(HALVINGS):
                        middle = (fails + best) / 2
                        fails, best = (fails, middle) if works(moved(name, sign * middle)) else (middle, best)
                    share = sign * best / (most if name == "bandwidth" else 1)
                    return Nearest(name, float(WIDEST**share), moved(name, sign * best))
    return _descent(gains, works, radius)


def _descent(
    gains: Mapping[str, float],
    works: Callable[[Mapping[str, float]], bool],
    radius: Callable[[Mapping[str, float]], float],
) -> Nearest | None:
    """Gains that work, by steepest descent of the radius along single gains; None where the descent ends earlier."""
    chosen, least, step = dict(gains), radius(gains), float(WIDEST ** (1 / MOVES))
    for _ in range(DESCENTS):
        trials = [chosen | {name: chosen[name] * factor} for name in chosen for factor in (1 / step, step)]
        radii = [radius(trial) for trial in trials]
        best = min(range(len(trials)), key=radii.__getitem__)
        if not radii[best] < least:
            return None
        chosen, least = trials[best], radii[best]
        if works(chosen):
            widest = max(max(chosen[name] / gains[name], gains[name] / chosen[name]) for name in gains)
            return Nearest("several", widest, chosen)
    return None
