"""The C that a study runs, and the hand that it is made from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np

from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.hand import Hand
from awiwi_gen.kernels import catalog
from awiwi_gen.kernels.estimates import joint_limits
from awiwi_gen.parallel import Progress
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.study.base import Array
from awiwi_gen.study.run import Place
from awiwi_gen.units import Quantity

PLACEHOLDER = Fraction(1, 100_000)


@dataclass(frozen=True)
class Request:
    """What is asked for: the hand, the finger, so many samples at least, a seed, and what single kinds of studies take."""

    hand: Hand
    finger: str
    samples: int
    seed: int
    place: Place
    progress: Progress
    spreads: tuple[str, ...] = ()
    goals: tuple[str, ...] = ()
    force: float = 20.0
    joint: str = ""
    law: str = ""

    def chunks(self, size: int) -> int:
        """As many chunks of a size as the samples fill."""
        return -(-self.samples // size)


def require_finger(hand: Hand, name: str) -> str:
    """The finger of that name, or the first that a hand has. Raises InputError where there is none."""
    if name and name not in hand.fingers:
        raise unknown("finger", name, hand.fingers, f"the hand has {', '.join(hand.fingers)}")
    return name or ("index" if "index" in hand.fingers else next(iter(hand.fingers)))


def families_of(hand: Hand, finger: str) -> set[str]:
    """The kernels of a finger, without its name."""
    return {
        name.removeprefix(f"{finger}_") for name in (each.name for each in catalog(hand)) if name.startswith(finger)
    }


def require_families(hand: Hand, finger: str, *families: str) -> None:
    """Raise InputError where a finger lacks a kernel that a study needs."""
    absent = [f"{finger}_{family}" for family in families if family not in families_of(hand, finger)]
    if absent:
        raise InputError(f"the study needs {' and '.join(absent)}, which this hand has not; see awiwi-gen check")


def ranges_of(hand: Hand, finger: str) -> tuple[Array, Array]:
    """Lower and upper limits of a finger's joints."""
    low, high = joint_limits(hand.fingers[finger])
    return np.array(low), np.array(high)


def generated(hand: Hand, only: str, progress: Progress, params: Literal["baked", "runtime"] = "baked") -> Path:
    """The directory of the generated C in the cache, up to date."""
    return cached_tree(Job(hand, Options(params=params), only, progress=progress))


def without_zeros(hand: Hand, finger: str) -> Hand:
    """The same hand with a length or angle in the place of every zero of the finger and its springs.

    What is zero becomes a constant of the C even with ``--params runtime``, and could not be varied.
    """

    def filled(path: str, number: Quantity) -> Quantity:
        fixed = not path.startswith((f"fingers.{finger}.", "spring.")) or path.endswith((".low", ".high", ".rest"))
        return number if number.value or fixed else Quantity(PLACEHOLDER, number.unit, "placeholder")

    return replaced(hand.model_copy(update={"gains": ()}), filled)


def with_numbers(hand: Hand, values: Mapping[str, float]) -> Hand:
    """The same hand with some numbers replaced, exactly by these doubles."""

    def new(path: str, number: Quantity) -> Quantity:
        value = values.get(path)
        return number if value is None else Quantity(Fraction(value), number.unit, f"{value!r} {number.unit}")

    return replaced(hand.model_copy(update={"gains": ()}), new)


def replaced(hand: Hand, leaf: Callable[[str, Quantity], Quantity]) -> Hand:
    """The hand with other numbers."""
    found: Any = hand.symbolic(leaf)
    return found  # type: ignore[no-any-return]
