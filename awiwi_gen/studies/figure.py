"""A figure of the source, computed again: what it claims, whether that holds, and how to draw it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Figure:
    """One reproduced figure. ``draw`` takes Matplotlib axes, so that only who draws needs Matplotlib."""

    number: str
    title: str
    claim: str
    holds: bool
    draw: Callable[[Any], None]
