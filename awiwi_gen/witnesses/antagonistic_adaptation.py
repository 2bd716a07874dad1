"""The learnt inertia and springs, and the planned pretension, with matrices: filters as chains, limits as extrema."""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX


def antagonistic_identifier(
    _: Any, adaptation: SX, driven: SX, excited: SX, load: SX, inertia: SX,
    learning: SX, ranges: SX, noise: SX, period: SX,
) -> tuple[SX, SX, SX, list[SX]]:  # fmt: skip
    """The memory (11), the link's inertia, the factors (2) of the springs; guards."""
    keep = ca.exp(-learning * period)
    mixed = ca.vertcat(driven, excited)
    filters = ca.reshape(adaptation[2:8], 3, 2)
    lower, powers = SX(3, 3), ca.vertcat(1 - keep[0], (1 - keep[0]) ** 2, (1 - keep[0]) ** 3)
    for row in range(3):  # the response of a chain of three equal filters
        for column in range(row + 1):
            lower[row, column] = keep[0] * (1 - keep[0]) ** (row - column)
    filtered = lower @ filters + powers @ mixed.T
    fast = ca.vertcat(filtered[2, :].T, load)
    slow = keep[1] * adaptation[8:] + (1 - keep[1]) * fast
    quick = fast - slow
    regressors, seen = quick[:2], quick[2]
    step = (1 - keep[2:]) * regressors * seen / (regressors**2 + seen**2 + noise**2)
    share = _median(adaptation[0] + adaptation[0] * step[0], ranges[0], ranges[1])
    unequal = _median(adaptation[1] + step[1], -ranges[2], ranges[2])
    memory = ca.vertcat(share, unequal, ca.vec(filtered), slow)
    return memory, inertia / share, ca.vertcat(1 + unequal, 1 - unequal), [period, inertia, noise, ranges[0]]


def antagonistic_pretension(
    _: Any, plan: SX, torque: SX, stiffness: SX, curves: SX, bounds: SX, rate: SX, period: SX
) -> tuple[SX, list[SX]]:  # fmt: skip
    """The pretension (3) a sample later: the stiffness by the derivative of the mean spring, the filter by its matrix."""
    mean, p = (curves[:3] + curves[3:]) / 2, SX.sym("p")
    force = mean[0] * p + mean[1] * p**2 + mean[2] * p**3
    bend = ca.gradient(ca.gradient(force, p), p)  # linear in p, with the root of the least slope
    softest = -ca.substitute(bend, p, SX(0)) / (6 * mean[2])
    missing = 3 * mean[2] * (stiffness / 2 - ca.substitute(ca.gradient(force, p), p, softest))
    stretch = _largest(softest + ca.sqrt(ca.fabs(missing)) / (3 * mean[2]), 0)
    stiff = (ca.sign(missing) + 1) * ca.substitute(force, p, stretch) / 2
    wanted = _largest(stiff, bounds[0], bounds[1] + ca.fabs(torque) / 2)
    goal = ca.vertcat(-_largest(-wanted, -bounds[2]), 0, 0)
    chain = SX(3, 3)  # of d/dt - pole, nilpotent of order 3
    chain[0, 0] = chain[1, 1] = rate
    chain[0, 1] = chain[1, 2] = 1
    chain[2, 0], chain[2, 1], chain[2, 2] = -(rate**3), -3 * rate**2, -2 * rate
    moved = SX.eye(3) + chain * period + chain @ chain * period**2 / 2
    return goal + ca.exp(-rate * period) * (moved @ (plan - goal)), [period, rate, mean[2], bounds[2]]


def _largest(first: SX, *others: SX | float) -> SX:
    """The largest of several numbers."""
    for other in others:
        first = (first + other + ca.fabs(first - other)) / 2
    return first


def _median(value: SX, low: SX, high: SX) -> SX:
    """The middle of three numbers, of which the last two are in order."""
    return (low + high + ca.fabs(value - low) - ca.fabs(value - high)) / 2
