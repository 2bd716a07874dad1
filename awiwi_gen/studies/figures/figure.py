"""A figure of the source, computed again: what it claims, what we find, whether the claim holds, and how to draw it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Figure:
    """One reproduced figure. ``draw`` takes Matplotlib axes, so that only who draws needs Matplotlib.

    ``claim`` is what the source concludes from it, in our words; ``found`` is what the compiled kernels say instead, in
    numbers; ``holds`` is computed from the same data, for this hand.
    """

    number: str
    title: str
    claim: str
    found: str
    holds: bool
    draw: Callable[[Any], None]
