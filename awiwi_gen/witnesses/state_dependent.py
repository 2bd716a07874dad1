"""Optimal gains on a spring whose stiffness depends on the state, by spectral factorisation.

The spring's polynomial of the matrix (x 1; 0 y) has its torques at x and y on the diagonal and the secant beside them.
The closed loop's polynomial c is the stable factor of c(s) c(-s) = a(s) a(-s) + the states' share of the cost. The gains
are the difference of c and the open loop's polynomial a.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX


def secant_stiffness(_: Any, spring: SX, deflexion: SX, deflexion_des: SX) -> tuple[SX, SX]:
    """Secant between two deflexions, and the torque at the second, by the spring's polynomial of a matrix (Opitz)."""
    both = ca.vertcat(ca.horzcat(deflexion, 1), ca.horzcat(0, deflexion_des))
    torque = SX.zeros(2, 2)
    for coefficient in reversed(ca.vertsplit(spring)):
        torque = both @ (coefficient * SX.eye(2) + torque)
    return torque[0, 1], torque[1, 1]


def sdre_tendon(
    _: Any, theta: SX, thd: SX, theta_des: SX, b: SX, dtheta: SX, spring: SX, weights: SX, R: SX
) -> tuple[SX, SX, list[SX]]:
    """Gains (2), motor torque [N m], and the guards."""
    k, hold = secant_stiffness(_, spring, theta, theta_des)
    a0, a1 = k / b, dtheta / b
    c0 = ca.sqrt(a0**2 + weights[0] / (R * b**2))
    c1 = ca.sqrt(a1**2 + 2 * (c0 - a0) + weights[1] / (R * b**2))
    K = b * ca.vertcat(c0 - a0, c1 - a1)
    return K, hold - ca.dot(K, ca.vertcat(theta - theta_des, thd)), [b, R, *ca.vertsplit(weights)]
