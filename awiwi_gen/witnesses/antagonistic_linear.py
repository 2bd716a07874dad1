"""Linear control of a joint between two tendons, by its differential mode, which moves the link, and common mode."""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX

MIX = ca.DM([[1, 1], [1, -1]])  # (common, differential) mode to (motor 1, motor 2)


def antagonistic_setpoint(
    _: Any, desired: SX, pretension: SX, elongations: SX, slopes: SX, inertias: SX, damping: SX
) -> tuple[SX, SX, list[SX]]:
    """State and torques of a desired motion: the link's motion as a polynomial of time, differentiated."""
    time = ca.SX.sym("t")
    taylor = [SX(1), time, time**2 / 2, time * time**2 / 6, time**2 * time**2 / 24]
    q = sum((d * p for d, p in zip(ca.vertsplit(desired), taylor, strict=True)), SX(0))
    differential = (inertias[0] * _rate(_rate(q, time), time) + damping * _rate(q, time)) / 2
    springs = MIX @ ca.vertcat(pretension[0], differential)
    strain = ca.vertcat(differential, -differential) / slopes
    motors = elongations + strain + ca.vertcat(q, -q)
    speeds = _rate(motors, time)
    torques = springs + inertias[1:] * _rate(speeds, time)
    state = ca.vertcat(q, _rate(q, time), motors[0], speeds[0], motors[1], speeds[1])
    state, torques = ca.substitute([state, torques], [time], [SX(0)])
    return state, torques, ca.vertsplit(slopes)


def _rate(moving: SX, time: SX) -> SX:
    return ca.jacobian(moving, time)


def antagonistic_feedback(_: Any, x: SX, x_des: SX, u_des: SX, feedback: SX, resistance: SX) -> SX:
    """Torques of both motors."""
    gains = ca.reshape(feedback, 6, 2).T
    return resistance + u_des + gains @ x_des - gains @ x


def antagonistic_modes(_: Any, motors: SX) -> tuple[SX, SX]:
    """(Angle, speed) of the differential and of the common mode."""
    modes = MIX @ ca.reshape(motors, 2, 2).T / 2
    return modes[1, :].T, modes[0, :].T


def antagonistic_sharing(_: Any, torque: SX, pretension: SX) -> SX:
    """Torque of each spring."""
    return MIX @ ca.vertcat(pretension[0], torque / 2)
