"""The adaptive law by inverse dynamics: the closed loop with all errors but one eliminated, solved for the motor."""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX


def backstepping_adaptive(
    _: Any, joint: SX, torques: SX, desired: SX, pretension: SX, external: SX, inertias: SX,
    springs: SX, damping: SX, impedance: SX, tunings: SX, resistance: SX,
) -> tuple[SX, list[SX]]:  # fmt: skip
    """Torques of both motors.

    With the error e of the link and t of a torque: (D + K_4) (t' + K_3 t +- e' / C_t) + (C_t / C_s) t = 0.
    """
    m, sides = inertias[0], (1, -1)
    net = ca.vertcat(torques[0] - torques[2], torques[1] - torques[3]) + external
    accelerated = (net[0] - damping * joint[1]) / m
    jerk = (net[1] - damping * accelerated) / m
    motion = ca.vertcat(joint, accelerated, jerk)
    error = motion - desired[:4]
    link_torque = m * desired[2:] + damping * desired[1:4] - impedance[0] * error[:3] - impedance[1] * error[1:]
    motors = []
    for i, side in enumerate(sides):
        fast, slow, link, last = ca.vertsplit(tunings[4 * i : 4 * i + 4])
        slope, curvature = springs[2 * i], springs[2 * i + 1]
        target = pretension + side * link_torque / 2
        t, dt = torques[2 * i] - target[0], torques[2 * i + 1] - target[1]
        decay = (fast + slow) * dt + (fast * slow + link / last) * t + side * (error[2] + slow * error[1]) / link
        torque_dd = target[2] - decay
        theta_dd = side * accelerated + (torque_dd - curvature * (torques[2 * i + 1] / slope) ** 2) / slope
        motors.append(torques[2 * i] + inertias[i + 1] * theta_dd + resistance[i])
    positive = (inertias, springs[::2], impedance, tunings)
    return ca.vertcat(*motors), [x for parameters in positive for x in ca.vertsplit(parameters)]
