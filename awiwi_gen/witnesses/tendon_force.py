"""Control of a tendon's force by energy shaping.

The motor is to move as if in a potential kp (f_des - f)^2 / 2 with the dissipation kd (fd_des - fd)^2 / 2. The torque
for this follows from the equation of motion, by automatic differentiation.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX


def tendon_force_pd(
    _: Any, f: SX, fd: SX, f_des: SX, fd_des: SX, f_hat: SX, friction: SX, r: SX, kp: SX, kd: SX
) -> Any:
    """Motor torque [N m] with fixed gains, and the guards."""
    return _torque(f, fd, f_des, fd_des, f_hat, friction, r, kp, kd), [r, kp, kd]


def tendon_force_scheduled(
    _: Any, f: SX, fd: SX, f_des: SX, fd_des: SX, f_hat: SX, friction: SX,
    r: SX, b: SX, stiffness: SX, stiffness_rate: SX, omega0: SX, xi0: SX,
) -> Any:  # fmt: skip
    """Motor torque [N m], its gains, and the guards."""
    gains = _gains(r, b, stiffness, stiffness_rate, omega0, xi0)
    slow_enough = omega0 * stiffness - 2 * xi0 * stiffness_rate
    tau = _torque(f, fd, f_des, fd_des, f_hat, friction, r, *ca.vertsplit(gains))
    return tau, gains, [r, b, stiffness, omega0, xi0, slow_enough]


def _torque(f: SX, fd: SX, f_des: SX, fd_des: SX, f_hat: SX, friction: SX, r: SX, kp: SX, kd: SX) -> SX:
    """The torque that gives the force of the shaped energies once friction and tendon torque are subtracted."""
    force, rate, tau = SX.sym("force"), SX.sym("rate"), SX.sym("tau")
    shaped = -ca.gradient(kp * (f_des - force) ** 2 / 2, force) - ca.gradient(kd * (fd_des - rate) ** 2 / 2, rate)
    balance = tau - friction - r * f_hat - ca.substitute(shaped, ca.vertcat(force, rate), ca.vertcat(f, fd))
    return ca.substitute(-balance, tau, SX(0)) / ca.jacobian(balance, tau)


def _gains(r: SX, b: SX, stiffness: SX, stiffness_rate: SX, omega0: SX, xi0: SX) -> SX:
    """Gains (2) from the linearised loop: its coefficients are linear in the gains, so two equations give both."""
    x, v, gains = SX.sym("x"), SX.sym("v"), SX.sym("gains", 2)
    slope, slope_rate = r * stiffness, r * stiffness_rate  # of the force over the motor angle
    pull = gains[0] * slope * x + gains[1] * (slope_rate * x + slope * v)
    actual = ca.vertcat(ca.jacobian(pull, x), ca.jacobian(pull, v))
    desired = ca.vertcat(b * omega0**2, 2 * b * xi0 * omega0)
    matrix = ca.jacobian(actual, gains)
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    cofactors = ca.vertcat(
        matrix[1, 1] * desired[0] - matrix[0, 1] * desired[1], matrix[0, 0] * desired[1] - matrix[1, 0] * desired[0]
    )
    return cofactors / determinant
