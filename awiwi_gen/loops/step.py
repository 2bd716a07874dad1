"""One run of a plant under a law on a clock; overshoot and settling time of step responses."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np

from awiwi_gen.simulate import PERIOD, Actuator, Array, Element, Loop, Scenario, Trace, simulate


def run(
    library: Any, plant: Sequence[Element], law: Sequence[Element], scenario: Scenario, watch: Sequence[str] = ("x",),
    period: float = PERIOD, limit: float = inf, late: bool = False,
) -> Trace:  # fmt: skip
    """Run a plant of state ``x`` and rate ``xd`` under a law whose ``command`` acts as ``u``, within a limit."""
    loop = Loop(plant, law, {"x": "xd"}, actuators=[Actuator("command", "u", limit, late)], period=period)
    return simulate(library, loop, [scenario], watch)[0]


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
