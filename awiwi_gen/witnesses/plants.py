"""Plants for control laws from energies: all forces are gradients of stored energies and of dissipation functions.

With the kinetic energy T of the velocities v, the springs' energy V, Rayleigh's dissipation D and external torques Q,
Lagrange's equations are (d2T/dv2) v' = Q - dV/dx - dD/dv, as the inertias do not depend on the position.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
from casadi import SX


def plant_tendon(_: Any, x: SX, u: SX, path: SX, motor: SX, line: SX, friction: SX) -> tuple[SX, SX]:
    """Rates of (theta, theta'), and the force of the tendon."""
    position, speed = x[0], x[1]
    stretch = motor[1] * position + path
    force = gradients(pulling(line), taut(stretch))[0]
    external = u - ca.jacobian(stretch, position) * force
    return _rates(speed, motor[0], dry(friction, speed), external), force


def plant_joint_linear(part: Any, x: SX, u: SX, load: SX, plant: SX, damping: SX) -> tuple[SX, SX]:
    """Rates of (q, q', theta, theta'), torque of the spring and its rate."""
    return plant_joint_nonlinear(part, x, u, load, plant[:2], ca.vertcat(plant[2], 0), damping)[:2]


def plant_joint_nonlinear(_: Any, x: SX, u: SX, load: SX, bodies: SX, curve: SX, damping: SX) -> tuple[SX, SX, SX]:
    """Rates of (q, q', theta, theta'), torque of the spring and its rate, slope and curvature."""
    position, speed = x[0::2], x[1::2]
    stretch = position[1] - position[0]
    torque, slope, curvature = gradients(lambda d: 6 * curve[0] * d**2 + 3 * curve[1] * (d**2) ** 2, stretch)
    external = ca.vertcat(load, u) - ca.jacobian(stretch, position).T * torque
    rates = _rates(speed, bodies, ca.dot(damping, speed**2) / 2, external)
    return rates, ca.vertcat(torque, slope * ca.jtimes(stretch, position, speed)), ca.vertcat(slope, curvature)


def plant_antagonistic(
    _: Any, x: SX, u: SX, load: SX, inertias: SX, tendons: SX, damping: SX, friction: SX
) -> tuple[SX, SX, SX]:
    """Rates of (q, q', theta1, theta1', theta2, theta2'), elongation and torque of both springs."""
    position, speed = x[0::2], x[1::2]
    stretches = ca.vertcat(position[1] - position[0], position[2] + position[0])
    torques = ca.vertcat(*(gradients(pulling(tendons[3 * i :]), taut(stretches[i]))[0] for i in (0, 1)))
    external = ca.vertcat(load, u) - ca.jacobian(stretches, position).T @ torques
    dissipated = damping * speed[0] ** 2 / 2 + dry(friction, speed[1]) + dry(friction, speed[2])
    return _rates(speed, inertias, dissipated, external), stretches, torques


def antagonistic_springs(_: Any, stretches: SX, speeds: SX, tendons: SX) -> tuple[SX, SX]:
    """Torque and its rate, slope and curvature of each spring."""
    torques, local = [], []
    for i in (0, 1):
        torque, slope, curvature = gradients(pulling(tendons[3 * i :]), taut(stretches[i]))
        torques += [torque, slope * speeds[i]]
        local += [slope, curvature]
    return ca.vertcat(*torques), ca.vertcat(*local)


def plant_finger_forces(_: Any, thetas: SX, path: SX, slack: SX, motor: SX, line: SX) -> SX:
    """Forces [N] of a finger's tendons between its motors and its joints."""
    stretches = ca.jtimes(motor[1] * thetas + path, thetas, thetas) + path - slack
    return ca.vertcat(*(gradients(pulling(line), taut(stretch))[0] for stretch in ca.vertsplit(stretches)))


def plant_finger(_: Any, qd: SX, qdd: SX, thds: SX, f: SX, u: SX, motor: SX, friction: SX) -> SX:
    """Rates of (q, q', theta, theta') of a finger whose joints accelerate with qdd."""
    dissipated = sum(dry(friction, speed) for speed in ca.vertsplit(thds))
    momentum = ca.gradient(motor[0] * ca.sumsqr(thds) / 2, thds)
    forces = ca.gradient(ca.dot(u - motor[1] * f, thds), thds) - ca.gradient(dissipated, thds)
    return ca.vertcat(qd, qdd, thds, ca.solve(ca.jacobian(momentum, thds), forces))


def _rates(speed: SX, inertias: SX, dissipated: SX, external: SX) -> SX:
    """Rates of position and speed of each body, one body after the other."""
    kinetic = ca.dot(inertias, speed**2) / 2
    momentum = ca.diag(ca.hessian(kinetic, speed)[0])
    accelerated = (external - ca.gradient(dissipated, speed)) / momentum
    return ca.vec(ca.horzcat(speed, accelerated).T)


def dry(friction: SX, speed: SX) -> SX:
    """Rayleigh's function [W] of a motor's friction; its gradient is the friction torque."""
    steepness, level, viscosity = ca.vertsplit(friction)
    dry = speed * ca.atan(steepness * speed) - ca.log(1 + (steepness * speed) ** 2) / (2 * steepness)
    return level * dry + viscosity * speed**2 / 2


def pulling(spring: SX) -> Callable[[SX], SX]:
    """Twelve times the energy [J] of a spring (k1, k2, k3) over its stretch; the factor keeps coefficients integer."""
    return lambda p: 6 * spring[0] * p**2 + 4 * spring[1] * p * p**2 + 3 * spring[2] * (p**2) ** 2


def taut(stretch: SX) -> SX:
    """The positive part of an elongation: zero where the tendon is slack."""
    return (ca.sqrt(stretch**2) + stretch) / 2


def gradients(energy12: Callable[[SX], SX], at: SX) -> tuple[SX, SX, SX]:
    """The first three derivatives of an energy at a position, from twelve times that energy."""
    d = ca.SX.sym("d")
    first = ca.gradient(energy12(d), d)
    second = ca.gradient(first, d)
    found = ca.substitute([first, second, ca.gradient(second, d)], [d], [at])
    return found[0] / 12, found[1] / 12, found[2] / 12
