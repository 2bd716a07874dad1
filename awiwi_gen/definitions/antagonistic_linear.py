"""Linear control of a joint between two tendons: desired state, state feedback, and distribution of a torque."""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.plants import SIDES


def antagonistic_setpoint(
    _: Any, desired: Matrix, pretension: Matrix, elongations: Matrix, slopes: Matrix, inertias: Matrix, damping: Matrix
) -> tuple[Matrix, Matrix, list[Expr]]:
    """The state (q, q', theta1, theta1', theta2, theta2') of a desired motion, the motors' torques for it,
    and the guards.

    Both springs share the torque on the link. They are linearised about their ``elongations`` under the pretension.
    """
    names = Derivation()
    load = names.name_all(inertias[0] * desired[2:, :] + damping[0] * desired[1:4, :])  # and two derivatives
    state, torques = [*desired[:2]], []
    for i, side in enumerate(SIDES):
        state += [side * desired[n] + side * load[n] / (2 * slopes[i]) for n in (0, 1)]
        state[-2] += elongations[i]
        accelerated = side * (desired[2] + load[2] / (2 * slopes[i]))
        torques.append(pretension[0] + side * load[0] / 2 + inertias[i + 1] * accelerated)
    return Matrix(state), Matrix(torques), [*slopes]


def antagonistic_feedback(
    _: Any, x: Matrix, x_des: Matrix, u_des: Matrix, feedback: Matrix, resistance: Matrix
) -> Matrix:
    """Torques of both motors u_des - K (x - x_des) + resistance; K (2 x 6) row by row."""
    return u_des - Matrix(2, 6, list(feedback)) * (x - x_des) + resistance


def antagonistic_modes(_: Any, motors: Matrix) -> tuple[Matrix, Matrix]:
    """Differential and common mode of both motors: (angle, speed) of half their difference and of half their sum."""
    first, second = motors[:2, :], motors[2:, :]
    return (first - second) / 2, (first + second) / 2


def antagonistic_sharing(_: Any, torque: Matrix, pretension: Matrix) -> Matrix:
    """Torque of each spring for a torque on the link (eq. 15.88)."""
    return Matrix([pretension[0] + side * torque[0] / 2 for side in SIDES])
