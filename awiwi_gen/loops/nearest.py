"""The gains nearest to some that fail: one gain changed alone, or all of them as of a slower or a faster law.

Where no such gains do, each step changes the gain that helps most, until they do or nothing helps any more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

WIDEST = 1e3  # by how much gains are changed at most
MOVES = 24  # steps of the search on the way there
HALVINGS = 10
DESCENTS = 60  # steps of one gain after the other, each by a move's factor


@dataclass(frozen=True)
class Nearest:
    """What was changed, "bandwidth" or "several" for more than one, by which factor, and the gains that work."""

    changed: str
    factor: float
    gains: Mapping[str, float]


def nearest(
    gains: Mapping[str, float],
    powers: Mapping[str, float],
    works: Callable[[Mapping[str, float]], bool],
    radius: Callable[[Mapping[str, float]], float],
) -> Nearest | None:
    """The gains that work and need the smallest factor, or some that come near, or None.

    ``powers`` are those of the bandwidth that the gains grow with, ``radius`` is what must fall before they work. The
    order of trials is fixed, and so is the answer.
    """
    most = max(abs(power) for power in powers.values())  # a move's length is the factor of the gain that changes most
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
    """Gains that work, by the steepest way down of the radius along single gains; None where it ends too early."""
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
