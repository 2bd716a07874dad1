"""Joint impedance by virtual work, motor impedance by energies, and the cascade by the equation of motion."""

from __future__ import annotations

from math import isqrt
from typing import Any

import casadi as ca
from casadi import SX


def joint_impedance(
    _: Any, M: SX, C: SX, gravity: SX, q: SX, qd: SX, q_des: SX, qd_des: SX, qdd_des: SX, K: SX, D: SX
) -> SX:
    """Joint torques (n) [N m]: gradient of the work of a virtual motion (eq. 11.10, mended)."""
    virtual = SX.sym("virtual", q.numel())
    pairs = ((M, qdd_des), (C, qd_des), (K, q_des - q), (D, qd_des - qd))
    work = ca.dot(virtual, gravity)
    for matrix, vector in pairs:
        work += ca.bilin(_square(matrix), virtual, vector)
    return ca.gradient(work, virtual)


def motor_impedance(
    _: Any, theta: SX, thd: SX, theta_des: SX, f_des: SX, friction: SX, r: SX, motor_kp: SX, motor_kd: SX
) -> tuple[SX, list[SX]]:
    """Motor torque [N m]: minus the gradients of potential and dissipation (eq. 11.3, 11.5), and the guards."""
    potential = motor_kp * (theta_des - theta) ** 2 / 2 - r * f_des * theta
    dissipation = motor_kd * thd**2 / 2
    return friction - ca.gradient(potential, theta) - ca.gradient(dissipation, thd), [r, motor_kp, motor_kd]


def cascade(
    _: Any, f: SX, xd: SX, stiffness: SX, slope: SX, hdd: SX, f_des: SX, fd_des: SX, fdd_des: SX, friction: SX, r: SX,
    B: SX, force_kp: SX, force_kd: SX,
) -> tuple[SX, list[SX]]:  # fmt: skip
    """Motor torque [N m] that solves the force's equation of motion for the desired f'', and the guards.

    The spring is expanded to second order about its elongation: f + k y + k dk/df y^2 / 2, with y' = x'.
    """
    tau, y, rate = SX.sym("tau"), SX.sym("y"), SX.sym("rate")
    force = f + stiffness * y + stiffness * slope * y**2 / 2
    fd = ca.jacobian(force, y) * rate
    acceleration = r * (tau - r * f - friction) / B + hdd
    fdd = ca.jacobian(fd, y) * rate + ca.jacobian(fd, rate) * acceleration
    error = fdd_des - fdd + force_kd * (fd_des - fd) + force_kp * (f_des - f)
    here = ca.substitute(error, ca.vertcat(y, rate), ca.vertcat(SX(0), xd))
    torque = -ca.substitute(here, tau, SX(0)) / ca.jacobian(here, tau)
    return torque, [stiffness, r, B, force_kp, force_kd]


def _square(entries: SX) -> SX:
    n = isqrt(entries.numel())
    return ca.reshape(entries, n, n).T
