"""Optimal gains on a spring whose stiffness depends on the state (chapter 14).

A spring's torque is phi(x) = s1 x + s2 x^2 + s3 x^3. The secant between the state and the desired state replaces the
slope: then A(x) x is the plant itself and not its linearisation. The source calls the secant "joint stiffness".
"""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix, sqrt


def torque(spring: Matrix, x: Expr) -> Expr:
    """phi(x) [N m]."""
    s1, s2, s3 = spring
    return x * (s1 + x * (s2 + x * s3))


def secant(spring: Matrix, x: Expr, y: Expr) -> Expr:
    """(phi(x) - phi(y))/(x - y) [N m/rad] with the division carried out; for x = y it is the slope."""
    s1, s2, s3 = spring
    return s1 + s2 * (x + y) + s3 * (x * (x + y) + y**2)


def motor_regulator(b: Expr, k: Expr, dtheta: Expr, weights: Matrix, R: Expr) -> Matrix:
    """Optimal gains (2) of b x'' = -dtheta x' - k x + u for the cost weights . (x^2, x'^2) + R u^2.

    With k K1 and b K1 for two entries of S, the diagonal of the Riccati equation (eq. 13.5) is
        K1^2 + 2 k K1 = weights[0]/R,   K2^2 + 2 dtheta K2 = 2 b K1 + weights[1]/R.
    """
    w1, w2 = weights / R
    K1 = w1 / (k + sqrt(k**2 + w1))
    w2 += 2 * b * K1
    return Matrix([K1, w2 / (dtheta + sqrt(dtheta**2 + w2))])


def secant_stiffness(_: Any, spring: Matrix, deflexion: Matrix, deflexion_des: Matrix) -> tuple[Expr, Expr]:
    """Secant between two deflexions, and the torque at the second."""
    return secant(spring, deflexion[0], deflexion_des[0]), torque(spring, deflexion_des[0])


def sdre_tendon(
    _: Any, theta: Matrix, thd: Matrix, theta_des: Matrix, b: Matrix, dtheta: Matrix, spring: Matrix, weights: Matrix,
    R: Matrix,
) -> tuple[Matrix, Expr, list[Expr]]:  # fmt: skip
    """Gains (2), motor torque [N m], and the guards."""
    k = secant(spring, theta[0], theta_des[0])
    K = motor_regulator(b[0], k, dtheta[0], weights, R[0])
    u = torque(spring, theta_des[0]) - K[0] * (theta[0] - theta_des[0]) - K[1] * thd[0]
    return K, u, [b[0], R[0], *weights]
