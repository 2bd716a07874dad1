"""Plants for control laws: elastic joints and tendons with friction, by Newton's and Euler's equations.

Angles and torques of motors are reflected to the joint: a motor of inertia B with a pulley r on a joint's pulley R has
the reflected inertia B (R / r)^2. So joints of a hand differ by numbers only, and these are inputs. A tendon pulls or is
slack. Its spring has the torque

    phi(d) = k1 p + k2 p^2 + k3 p^3    where p = max(d, 0) is the positive part of the elongation d

and dry friction is the arc tangent of eq. 3.8, which is smooth at rest.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Abs, Expr, Matrix

from awiwi_gen.definitions.naming import Derivation

SIDES = (1, -1)  # tendon 1 pulls the link forward, tendon 2 pulls it back


def plant_tendon(
    _: Any, x: Matrix, u: Matrix, path: Matrix, motor: Matrix, line: Matrix, friction: Matrix
) -> tuple[Matrix, Expr]:
    """Rates of x = (theta, theta') and the force [N] of a tendon whose joint is held (eq. 10.1, mended)."""
    inertia, radius = motor
    names = Derivation()
    force = names.name(pull(line, names.name(taut(radius * x[0] + path[0]))))
    return Matrix([x[1], (u[0] - resistance(friction, x[1]) - radius * force) / inertia]), force


def plant_joint_linear(
    _: Any, x: Matrix, u: Matrix, load: Matrix, plant: Matrix, damping: Matrix
) -> tuple[Matrix, Matrix]:
    """Rates of x = (q, q', theta, theta') behind a linear spring; its torque and the rate of that (eq. 15.11, 15.12)."""
    torques = plant[2] * Matrix([x[2] - x[0], x[3] - x[1]])
    return _joint(x, u, load, plant, damping, torques[0]), torques


def plant_joint_nonlinear(
    _: Any, x: Matrix, u: Matrix, load: Matrix, bodies: Matrix, curve: Matrix, damping: Matrix
) -> tuple[Matrix, Matrix, Matrix]:
    """The same behind a spring phi(d) = k1 d + k3 d^3; and phi', phi'' (eq. 15.71)."""
    stretch, speed = x[2] - x[0], x[3] - x[1]
    slope = curve[0] + 3 * curve[1] * stretch**2
    torque = stretch * (curve[0] + curve[1] * stretch**2)
    local = Matrix([slope, 6 * curve[1] * stretch])
    return _joint(x, u, load, bodies, damping, torque), Matrix([torque, slope * speed]), local


def plant_antagonistic(
    _: Any, x: Matrix, u: Matrix, load: Matrix, inertias: Matrix, tendons: Matrix, damping: Matrix, friction: Matrix
) -> tuple[Matrix, Matrix, Matrix]:
    """Rates of x = (q, q', theta1, theta1', theta2, theta2'), and elongation and torque of both springs (eq. 15.82)."""
    names = Derivation()
    stretches = Matrix([x[2 * i + 2] - side * x[0] for i, side in enumerate(SIDES)])
    parts = names.name_all(stretches.applyfunc(taut))
    torques = [names.name(pull(spring, p)) for spring, p in zip(_rows(tendons), parts, strict=True)]
    rates = [x[1], (torques[0] - torques[1] + load[0] - damping[0] * x[1]) / inertias[0]]
    for i, torque in enumerate(torques):
        speed = x[2 * i + 3]
        rates += [speed, (u[i] - resistance(friction, speed) - torque) / inertias[i + 1]]
    return Matrix(rates), stretches, Matrix(torques)


def antagonistic_springs(_: Any, stretches: Matrix, speeds: Matrix, tendons: Matrix) -> tuple[Matrix, Matrix]:
    """Torque and its rate, slope and curvature of each spring; a slack one has those of elongation zero."""
    names = Derivation()
    torques, local = [], []
    for spring, stretch, speed in zip(_rows(tendons), stretches, speeds, strict=True):
        p = names.name(taut(stretch))
        slope = names.name(spring[0] + p * (2 * spring[1] + 3 * p * spring[2]))
        torques.append([pull(spring, p), slope * speed])
        local.append([slope, 2 * spring[1] + 6 * p * spring[2]])
    return Matrix(torques), Matrix(local)


def plant_finger_forces(_: Any, thetas: Matrix, path: Matrix, slack: Matrix, motor: Matrix, line: Matrix) -> Matrix:
    """Forces [N] of a finger's tendons between its motors and its joints."""
    names = Derivation()
    stretches = motor[1] * thetas + path - slack
    return Matrix([pull(line, names.name(taut(stretch))) for stretch in stretches])


def plant_finger(
    _: Any, qd: Matrix, qdd: Matrix, thds: Matrix, f: Matrix, u: Matrix, motor: Matrix, friction: Matrix
) -> Matrix:
    """Rates of (q, q', theta, theta') of a finger whose joints accelerate with qdd."""
    thdds = [(u[i] - resistance(friction, thds[i]) - motor[1] * f[i]) / motor[0] for i in range(len(u))]
    return Matrix([*qd, *qdd, *thds, *thdds])


def resistance(friction: Matrix, speed: Expr) -> Expr:
    """Friction torque [N m] at a speed [rad/s]; friction is (steepness, level, viscosity) (eq. 3.8)."""
    return sympy.atan(friction[0] * speed) * friction[1] + friction[2] * speed


def taut(stretch: Expr) -> Expr:
    """The positive part of an elongation: zero where the tendon is slack."""
    return (stretch + Abs(stretch)) / 2


def pull(spring: Matrix, p: Expr) -> Expr:
    """Torque or force of a spring (k1, k2, k3) stretched by p."""
    return p * (spring[0] + p * (spring[1] + p * spring[2]))


def _joint(x: Matrix, u: Matrix, load: Matrix, bodies: Matrix, damping: Matrix, torque: Expr) -> Matrix:
    link = (torque + load[0] - damping[0] * x[1]) / bodies[0]
    return Matrix([x[1], link, x[3], (u[0] - torque - damping[1] * x[3]) / bodies[1]])


def _rows(tendons: Matrix) -> list[Matrix]:
    return [tendons[:3, :], tendons[3:, :]]
