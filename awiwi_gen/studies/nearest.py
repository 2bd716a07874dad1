"""The gains nearest to some that fail: one gain changed alone, or all of them as of a slower or a faster law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

WIDEST = 1e3  # by how much gains are changed at most
MOVES = 24  # steps of the search on the way there
HALVINGS = 10


@dataclass(frozen=True)
class Nearest:
    """What was changed, "bandwidth" for all gains, by which factor, and the gains that work."""

    changed: str
    factor: float
    gains: Mapping[str, float]


def nearest(
    gains: Mapping[str, float], powers: Mapping[str, float], works: Callable[[Mapping[str, float]], bool]
) -> Nearest | None:
    """The gains that work and need the smallest factor, or None if there are none within a factor of a thousand.

    ``powers`` are those of the bandwidth that the gains grow with. The order of trials is fixed, and so is the answer.
    """
    directions: dict[str, Mapping[str, float]] = {"bandwidth": powers, **{name: {name: 1} for name in gains}}

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
                    return Nearest(name, float(WIDEST ** (sign * best)), moved(name, sign * best))
    return None
