"""Gains that place the poles of a joint, in closed form (chapter 12).

The flexible joint, with x = (q, dq/dt, theta, dtheta/dt):

    m q''     = -dq q' + k (theta - q)
    b theta'' = -dtheta theta' - k (theta - q) + u,   u = -K x

Gains are those of negative feedback; eq. 12.12 to 12.18 print alpha = -K.
"""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix


def motor_gains(b: Expr, dtheta: Expr, k: Expr, omega: Expr, xi: Expr) -> Matrix:
    """Gains K (2) [N m/rad, N m s/rad] of a motor b on a grounded spring k: poles of frequency omega and damping
    ratio xi (eq. 12.7)."""
    return Matrix([b * omega**2 - k, 2 * b * xi * omega - dtheta])


def target(omega: Matrix, xi: Matrix) -> list[Expr]:
    """Coefficients c0 to c3 of s^4 + c3 s^3 + c2 s^2 + c1 s + c0, two damped oscillators (eq. 12.13)."""
    (w1, w2), (x1, x2) = omega, xi
    return [
        w1**2 * w2**2,
        2 * w1 * w2 * (x2 * w1 + x1 * w2),
        w1**2 + 4 * x1 * x2 * w1 * w2 + w2**2,
        2 * (x1 * w1 + x2 * w2),
    ]


def joint_gains(m: Expr, b: Expr, k: Expr, dq: Expr, dtheta: Expr, polynomial: list[Expr]) -> Matrix:
    """Gains K (4) that give the flexible joint the characteristic polynomial c0 to c3.

    Eq. 12.15, solved from its last row up. Its third row has k (m + b), where eq. 12.14 prints (m b/k) (m + b).
    """
    c0, c1, c2, c3 = polynomial
    K4 = b * c3 - dtheta - dq * b / m
    K3 = b * c2 - (k * (m + b) + dq * dtheta + dq * K4) / m
    K2 = (m * b * c1 - dq * K3) / k - dq - dtheta - K4
    K1 = m * b * c0 / k - K3
    return Matrix([K1, K2, K3, K4])


def pole_placement_motor(_: Any, b: Matrix, dtheta: Matrix, k: Matrix, omega0: Matrix, xi0: Matrix) -> Any:
    """Gains of the second-order plant, and the guards."""
    return motor_gains(b[0], dtheta[0], k[0], omega0[0], xi0[0]), [b[0], omega0[0], xi0[0]]


def pole_placement(
    _: Any, m: Matrix, b: Matrix, k: Matrix, dq: Matrix, dtheta: Matrix, omega: Matrix, xi: Matrix
) -> Any:
    """Gains of the flexible joint, and the guards."""
    K = joint_gains(m[0], b[0], k[0], dq[0], dtheta[0], target(omega, xi))
    return K, [m[0], b[0], k[0], *omega, *xi]


def pole_placement_law(_: Any, K: Matrix, x: Matrix, x_des: Matrix, u_des: Matrix) -> Expr:
    """Torque [N m] at the state x (4): u_des holds the desired state, and -K acts on the error."""
    return u_des[0] - (K.T * (x - x_des))[0]
