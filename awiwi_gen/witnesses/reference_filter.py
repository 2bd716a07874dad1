"""The reference filter as a linear differential equation, over one sample by the classical Runge-Kutta method."""

from __future__ import annotations

from typing import Any

from casadi import SX

COEFFICIENTS = (945, 945, 420, 105, 15)


def reference_filter(_: Any, motion: SX, desired: SX, delay: SX, period: SX) -> tuple[SX, list[SX]]:
    """The motion (5) a sample later."""
    error, goal = SX(5, 5), SX(5, 5)
    for i in range(4):
        error[i, i + 1] = goal[i, i + 1] = 1
    for i, coefficient in enumerate(COEFFICIENTS):
        rate = SX(1)
        for _power in range(5 - i):
            rate = rate / delay
        error[4, i] = -coefficient * rate
    return _runge_kutta(error, motion - desired, period) + _runge_kutta(goal, desired, period), [delay, period]


def _runge_kutta(matrix: SX, start: SX, step: SX) -> SX:
    slopes = [matrix @ start]
    for reach in (step / 2, step / 2, step):
        slopes.append(matrix @ (start + reach * slopes[-1]))
    return start + step / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
