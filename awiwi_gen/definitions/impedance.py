"""Joint impedance on top of tendon forces: two time scales and the cascade (chapter 11).

The joint law is a passive controller. It has C qd_des, not C qd as in eq. 11.10. So the error e obeys
M e'' + (C + D) e' + K e = 0, and the energy e' M e' / 2 + e K e / 2 falls by e' D e'. As printed, C qd cancels the
Coriolis torques of the joints and leaves e' dM/dt e' / 2, which may have either sign.
"""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix


def joint_impedance(
    _: Any, M: Matrix, C: Matrix, gravity: Matrix, q: Matrix, qd: Matrix, q_des: Matrix, qd_des: Matrix,
    qdd_des: Matrix, K: Matrix, D: Matrix,
) -> Matrix:  # fmt: skip
    """Joint torques (n) [N m]; matrices (n x n) row by row (eq. 11.4, 11.10, mended)."""
    n = len(q)
    inertia, coriolis, stiffness, damping = (Matrix(n, n, list(entries)) for entries in (M, C, K, D))
    motion = inertia * qdd_des + coriolis * qd_des + gravity
    return motion + stiffness * (q_des - q) + damping * (qd_des - qd)


def motor_impedance(
    _: Any, theta: Matrix, thd: Matrix, theta_des: Matrix, f_des: Matrix, friction: Matrix, r: Matrix, motor_kp: Matrix,
    motor_kd: Matrix,
) -> tuple[Expr, list[Expr]]:  # fmt: skip
    """Motor torque [N m] of the fast loop (eq. 11.3, mended), and the guards.

    The desired force is fed forward. Feeding forward the measured force would cancel the spring: then only kp acts on
    the motor's error, and the energy of eq. 11.5 does not fall.
    """
    tau = r[0] * f_des[0] + motor_kp[0] * (theta_des[0] - theta[0]) - motor_kd[0] * thd[0] + friction[0]
    return tau, [r[0], motor_kp[0], motor_kd[0]]


def cascade(
    _: Any, f: Matrix, xd: Matrix, stiffness: Matrix, slope: Matrix, hdd: Matrix, f_des: Matrix, fd_des: Matrix,
    fdd_des: Matrix, friction: Matrix, r: Matrix, B: Matrix, force_kp: Matrix, force_kd: Matrix,
) -> tuple[Expr, list[Expr]]:  # fmt: skip
    """Motor torque [N m] for the error dynamics e'' + force_kd e' + force_kp e = 0 (eq. 11.16), and the guards.

    The elongation is x = r theta + h, so x'' = r theta'' + h''. The force has f' = k x' and f'' = k x'' + dk/dx x'^2.
    The stiffness is a function of the force, so dk/dx is its slope dk/df times k.
    """
    k = stiffness[0]
    fdd = fdd_des[0] + force_kd[0] * (fd_des[0] - k * xd[0]) + force_kp[0] * (f_des[0] - f[0])
    thdd = (fdd / k - slope[0] * xd[0] ** 2 - hdd[0]) / r[0]
    return B[0] * thdd + r[0] * f[0] + friction[0], [k, r[0], B[0], force_kp[0], force_kd[0]]
