"""Overshoot and settling time of step responses."""

from __future__ import annotations

import numpy as np

from awiwi_gen.simulate import Array


def overshoot(values: Array, goal: Array | float, start: Array | float) -> Array:
    """How far runs (ticks, ...) go beyond the goal, as a share of the step; at least 0."""
    beyond: Array = np.maximum(((values - goal) / (np.asarray(goal, float) - start)).max(axis=0), 0.0)
    return beyond


def settling(times: Array, values: Array, goal: Array | float, start: Array | float, band: float = 0.02) -> Array:
    """When runs (ticks, ...) come within a share of the step for good [s]; infinite for those that do not."""
    away = np.abs(values - goal) > band * np.abs(np.asarray(goal, float) - start)
    last = len(times) - 1 - np.argmax(away[::-1], axis=0)
    found: Array = np.where(away[-1], np.inf, np.where(away.any(axis=0), times[last], 0.0))
    return found
