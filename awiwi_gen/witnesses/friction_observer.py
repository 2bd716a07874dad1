"""The friction observer's implicit step as two linear equations, solved by Cramer's rule."""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX


def friction_observer(_: Any, momentum: SX, u: SX, tau: SX, thd: SX, B: SX, gain: SX, period: SX) -> Any:
    """Momentum [N m s] and friction [N m] at the end of a sample, and the guards."""
    z, friction = SX.sym("z"), SX.sym("friction")
    unknowns = ca.vertcat(z, friction)
    step = ca.vertcat(z - momentum - period * (u - tau - friction), friction - gain * (z - B * thd))
    matrix, rest = ca.jacobian(step, unknowns), -ca.substitute(step, unknowns, SX.zeros(2))

    def cramer(column: int) -> SX:
        columns = ca.horzsplit(matrix)
        columns[column] = rest
        return ca.det(ca.horzcat(*columns)) / ca.det(matrix)

    return cramer(0), cramer(1), [B, gain, period]
