"""Which number of a finger costs how much accuracy: hands drawn within the spreads of their numbers, at fixed poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError, VerificationError
from awiwi_gen.study.base import Array, Arrays, Study
from awiwi_gen.study.figures import FIGURES, View, errors, worst

POSES = 32
PERCENTILE = 0.95  # of the hands that must reach a goal
DRAWS = 1000  # of the linear model, for demands
DIGITS = 2  # of a demand, which is rounded down
LINEAR = 0.95  # of a goal that the linear model must keep: the rest is for what is not linear, and for chance
AGREES = 1e-9  # of the largest value: between numbers at run time and in the code


@dataclass(frozen=True, eq=False)
class Tolerance(Study):
    """Hands whose numbers are drawn evenly within ``values`` +- ``spreads`` (numbers,), in the order of the kernels."""

    SIZE = 1024
    finger: str
    figures: tuple[str, ...]
    values: Array
    spreads: Array
    poses: Array
    tensions: Array
    gravity: Array

    def chunk(self, library: Any, random: np.random.Generator) -> dict[str, Array]:
        """The worst error over the poses of each figure (SIZE,); infinite where a hand has none."""
        hands = Hands(self, library)
        found = {name: np.empty(self.SIZE) for name in self.figures}
        for row, numbers in enumerate(self.drawn(random)):
            for name, values in hands.figures(numbers).items():
                found[name][row] = worst(values, hands.known[name], hands.scales[name])
        return found

    def drawn(self, random: np.random.Generator) -> Array:
        """The numbers of the hands of a chunk (SIZE, numbers)."""
        drawn: Array = self.values + self.spreads * random.uniform(-1.0, 1.0, (self.SIZE, len(self.values)))
        return drawn


class Hands:
    """A library whose numbers change, and the figures of the hand as known."""

    def __init__(self, study: Tolerance, library: Any) -> None:
        self._library, self._names = library.with_numbers(study.values), study.figures
        self._view = View(self._library, study.finger, study.poses, study.tensions, study.gravity)
        self.known = self.figures(study.values)
        self.scales = {name: FIGURES[name].scale(values) for name, values in self.known.items()}

    def figures(self, numbers: Array) -> dict[str, Array]:
        """The figures (poses, parts, components) of a hand with other numbers."""
        self._library.change_numbers(numbers)
        return figures_of(self._view, self._names)


def figures_of(view: View, names: Sequence[str]) -> dict[str, Array]:
    """Some figures of a finger."""
    return {name: FIGURES[name].values(view) for name in names}


@dataclass(frozen=True)
class Slopes:
    """How figures move when one number moves from one end of its spread to the other, halved, in their own scale.

    ``moves`` are (numbers, poses, parts, components) for each figure; ``alone`` (numbers,) are the worst errors when
    only that number is as wrong as its spread.
    """

    moves: Mapping[str, Array]
    alone: Mapping[str, Array] = field(init=False)

    def __post_init__(self) -> None:
        alone = {name: errors(m, 0.0, 1.0).max(axis=(*range(1, m.ndim - 1),)) for name, m in self.moves.items()}  # type: ignore[arg-type]
        object.__setattr__(self, "alone", alone)

    def worst(self, name: str, shares: Array) -> Array:
        """The worst error (hands,) of a figure, for hands whose numbers are off by shares (hands, numbers) of spreads."""
        moves = self.moves[name]
        flat = shares @ moves.reshape(len(moves), -1)
        found: Array = errors(flat.reshape(len(shares), -1, moves.shape[-1]), 0.0, 1.0).max(axis=-1)  # type: ignore[arg-type]
        return found


def slopes(study: Tolerance, library: Any, paths: Sequence[str]) -> Slopes:
    """The effect of every number. Raises InputError for one whose spread leaves a hand without a figure."""
    hands = Hands(study, library)
    moves: dict[str, list[Array]] = {name: [] for name in study.figures}
    for index, path in enumerate(paths):
        step = np.zeros_like(study.values)
        step[index] = study.spreads[index]
        above, below = (hands.figures(study.values + sign * step) for sign in (1, -1))
        for name in study.figures:
            move = (above[name] - below[name]) / (2 * hands.scales[name])
            if not np.isfinite(move).all():
                raise InputError(
                    f"{path}: within a spread of {study.spreads[index]:.3g} there are hands without {name} at some pose, "
                    f"such as springs that cannot bear the force; choose a smaller one: --spread '{path}=...'"
                )
            moves[name].append(move)
    return Slopes({name: np.array(each) for name, each in moves.items()})


def percentile(values: Array) -> float:
    """What so many of the hands do not exceed."""
    return float(np.quantile(values, PERCENTILE, method="higher"))


def demanded(found: Slopes, goals: Mapping[str, float], spreads: Array, units: Array, seed: int) -> Array:
    """How well every number must be known (numbers,) so that the linear model reaches the goals.

    Numbers that must be known better than their spread may each cause the same error alone; the others keep theirs.
    Demands have few digits when shown in ``units`` (numbers,).
    """
    shares = np.random.default_rng(seed).uniform(-1.0, 1.0, (DRAWS, len(spreads)))
    wanted = np.ones(len(spreads))
    for name, goal in ((name, LINEAR * goal) for name, goal in goals.items()):
        alone = found.alone[name]

        def kept(level: float, alone: Array = alone) -> Array:
            shares: Array = np.minimum(1.0, level / np.maximum(alone, 1e-300))
            return shares

        if percentile(found.worst(name, shares)) <= goal:
            continue
        low, high = 0.0, float(alone.max())
        for _ in range(30):
            middle = (low + high) / 2
            inside = percentile(found.worst(name, shares * kept(middle))) <= goal
            low, high = (middle, high) if inside else (low, middle)
        wanted = np.minimum(wanted, kept(low))
    return np.where(wanted < 1, rounded_down(spreads * wanted / units) * units, spreads)


def rounded_down(values: Array) -> Array:
    """The values with few digits, none larger."""
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = 10.0 ** (np.floor(np.log10(values)) - (DIGITS - 1))
        return np.where(values > 0, np.floor(values / unit * (1 + 1e-12)) * unit, 0.0)


def require_agreement(study: Tolerance, library: Any, baked: Any, numbers: Array) -> float:
    """The largest difference of a baked hand's figures, relative to each figure's largest value.

    Raises VerificationError where numbers at run time and numbers in the code do not agree.
    """
    at_run_time = Hands(study, library).figures(numbers)
    view = View(baked, study.finger, study.poses, study.tensions, study.gravity)
    furthest = 0.0
    for name, values in figures_of(view, study.figures).items():
        differs = np.abs(values - at_run_time[name]).max() / np.abs(values).max()
        if not differs <= AGREES:
            raise VerificationError(
                f"{study.finger}: {name} differs by {differs:.1e} of its largest value between numbers at run time and "
                f"numbers in the code; at most {AGREES:g} is permitted"
            )
        furthest = max(furthest, float(differs))
    return furthest


def summary(chunks: Arrays, goals: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """For each figure: median, percentile and largest error of the hands, and the share within the goal."""
    return {
        name: {
            "median": float(np.median(values)),
            "percentile": percentile(values),
            "largest": float(values.max()),
            **({"goal": goals[name], "within": float((values <= goals[name]).mean())} if name in goals else {}),
        }
        for name, values in chunks.items()
    }
