"""Plants in continuous time under laws on the hand's clock: many runs side by side, as NumPy arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from awiwi_gen.loops.sampled import PERIOD

Array = np.ndarray[Any, Any]
Rates = Callable[[Array, Array, float], Array]
Law = Callable[[Array, float], Array]

SUBSTEPS = 4  # of Runge and Kutta's fourth order in a period


def run(rates: Rates, law: Law, start: Array, duration: float, late: int = 1) -> tuple[Array, Array, Array]:
    """Times (ticks,) [s], states (ticks, states, runs) and torques (ticks, runs) of runs that begin at ``start``.

    ``law`` takes the states (states, runs) of a tick and its time; its torque acts ``late`` periods later and is held.
    ``rates`` takes states, torques, and the time of the last tick.
    """
    x, step, record = start.astype(float), PERIOD / SUBSTEPS, []
    times = np.arange(round(duration / PERIOD)) * PERIOD
    waiting = [law(x, 0.0)] * late
    for time in times:
        waiting.append(law(x, time))
        u = waiting.pop(0)
        record.append((x, u))
        for _ in range(SUBSTEPS):
            k1 = rates(x, u, time)
            k2 = rates(x + step / 2 * k1, u, time)
            k3 = rates(x + step / 2 * k2, u, time)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + rates(x + step * k3, u, time))
    return times, np.array([x for x, _ in record]), np.array([u for _, u in record])


def overshoot(values: Array, goal: Array | float, start: Array | float) -> Array:
    """How far runs (ticks, runs) went beyond the goal, as a share of the way to it."""
    way = np.asarray(goal, float) - start
    beyond: Array = np.maximum(((values - goal) / way).max(axis=0), 0.0)
    return beyond


def settling(times: Array, values: Array, goal: Array | float, start: Array | float, band: float = 0.02) -> Array:
    """When runs (ticks, runs) came within a share of the way to stay there [s]; infinite for those that did not."""
    away = np.abs(values - goal) > band * np.abs(np.asarray(goal, float) - start)
    last = len(times) - 1 - np.argmax(away[::-1], axis=0)
    found: Array = np.where(away[-1], np.inf, np.where(away.any(axis=0), times[last], 0.0))
    return found
