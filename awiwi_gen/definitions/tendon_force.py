"""Control of a tendon's force by its motor (chapter 10).

    B theta'' = tau - friction - r f(theta)

As printed, eq. 10.1 adds friction and tendon torque, and eq. 10.2 adds their estimates again: together they double what
they should cancel. Here both oppose the motor, and their estimates are added to its torque.
"""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix


def effort(kp: Expr, kd: Expr, error: Expr, rate: Expr, r: Expr, f_hat: Expr, friction: Expr) -> Expr:
    """Motor torque [N m] on a force error [N] and its rate [N/s]; the estimates are cancelled (eq. 10.2)."""
    return kp * error + kd * rate + friction + r * f_hat


def scheduled_gains(inertia: Expr, alpha: Expr, beta: Expr, omega: Expr, xi: Expr) -> Matrix:
    """Gains kp [m] and kd [m s] for errors of the motor angle that decay with omega and xi (eq. 10.9 to 10.11, mended).

    `alpha` [N/rad] is the slope of the force over the motor angle, `beta` [N/(rad s)] its rate along the reference:
    the error obeys B x'' + kd alpha x' + (kp alpha + kd beta) x = 0.
    """
    kd = 2 * xi * omega * inertia / alpha
    return Matrix([(omega**2 * inertia - kd * beta) / alpha, kd])


def tendon_force_pd(
    _: Any, f: Matrix, fd: Matrix, f_des: Matrix, fd_des: Matrix, f_hat: Matrix, friction: Matrix,
    r: Matrix, kp: Matrix, kd: Matrix,
) -> Any:  # fmt: skip
    """Motor torque [N m] with fixed gains, and the guards."""
    error, rate = f_des[0] - f[0], fd_des[0] - fd[0]
    return effort(kp[0], kd[0], error, rate, r[0], f_hat[0], friction[0]), [r[0], kp[0], kd[0]]


def tendon_force_scheduled(
    _: Any, f: Matrix, fd: Matrix, f_des: Matrix, fd_des: Matrix, f_hat: Matrix, friction: Matrix,
    r: Matrix, b: Matrix, stiffness: Matrix, stiffness_rate: Matrix, omega0: Matrix, xi0: Matrix,
) -> Any:  # fmt: skip
    """Motor torque [N m], its gains, and the guards."""
    kp, kd = gains = scheduled_gains(b[0], r[0] * stiffness[0], r[0] * stiffness_rate[0], omega0[0], xi0[0])
    error, rate = f_des[0] - f[0], fd_des[0] - fd[0]
    tau = effort(kp, kd, error, rate, r[0], f_hat[0], friction[0])
    slow_enough = omega0[0] * stiffness[0] - 2 * xi0[0] * stiffness_rate[0]  # has the sign of kp
    return tau, gains, [r[0], b[0], stiffness[0], omega0[0], xi0[0], slow_enough]
