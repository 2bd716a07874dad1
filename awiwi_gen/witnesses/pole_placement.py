"""Gains that place the poles of a joint, by Ackermann's formula on the state matrices.

K = e' C^-1 p(A), where C = (B, A B, ...) and p is the desired polynomial, applied factor by factor. The plants' matrices
are derivatives of their equations of motion.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX


def pole_placement_motor(_: Any, b: SX, dtheta: SX, k: SX, omega0: SX, xi0: SX) -> Any:
    """Gains K (2) [N m/rad, N m s/rad] of a motor on a grounded spring, and the guards."""
    x, u = SX.sym("x", 2), SX.sym("u")
    rate = ca.vertcat(x[1], (u - dtheta * x[1] - k * x[0]) / b)
    return _ackermann(x, u, rate, [(omega0, xi0)]), [b, omega0, xi0]


def pole_placement(_: Any, m: SX, b: SX, k: SX, dq: SX, dtheta: SX, omega: SX, xi: SX) -> Any:
    """Gains K (4) of the flexible joint, and the guards."""
    x, u = SX.sym("x", 4), SX.sym("u")
    spring = k * (x[2] - x[0])
    rate = ca.vertcat(x[1], (spring - dq * x[1]) / m, x[3], (u - dtheta * x[3] - spring) / b)
    oscillators = list(zip(ca.vertsplit(omega), ca.vertsplit(xi), strict=True))
    return _ackermann(x, u, rate, oscillators), [m, b, k, *ca.vertsplit(omega), *ca.vertsplit(xi)]


def pole_placement_law(_: Any, K: SX, x: SX, x_des: SX, u_des: SX) -> SX:
    """Torque [N m] at the state x: an affine function from its slope and its value at x_des."""
    at = SX.sym("at", 4)
    work = ca.dot(K, at)
    return u_des + ca.jtimes(work, at, x_des - x)


def _ackermann(x: SX, u: SX, rate: SX, oscillators: list[tuple[SX, SX]]) -> SX:
    A, column = ca.jacobian(rate, x), ca.jacobian(rate, u)
    columns = [column]
    for _ in range(x.numel() - 1):
        columns.append(A @ columns[-1])
    row = _last_row_of_inverse(columns)
    for omega, xi in oscillators:
        once = row @ A
        row = once @ A + 2 * xi * omega * once + omega**2 * row
    return row.T


def _last_row_of_inverse(columns: list[SX]) -> SX:
    """The row y with y C = (0, ..., 0, 1) for the columns of C, which is triangular from its last row up:
    the input reaches one more derivative with every column."""
    n = len(columns)
    y = SX.zeros(1, n)
    for j in range(n):  # the first nonzero entry of column j is in row reach(j)
        i = _reach(columns[j])
        y[i] = ((1.0 if j == n - 1 else 0.0) - y @ columns[j]) / columns[j][i]
    return y


def _reach(column: SX) -> int:
    return next(i for i in range(column.numel()) if column[i].nnz())
