"""A motor with its gear from energies alone: inertias and torques are derivatives, found automatically.

Rotor and gear store kinetic energy, friction has Rayleigh's dissipation function, and each ripple a potential of the
shaft's angle. Harmonics of one shaft come from the sine and cosine of its angle, by de Moivre's formula.
"""

from typing import Any

import casadi as ca
from casadi import SX


def energy(motor: Any, thd: SX) -> SX:
    """Kinetic energy [J] of the rotor and of the gear, each at its own speed."""
    rotor = thd * SX(motor.gear_ratio)
    return (rotor**2 * SX(motor.rotor_inertia) + thd**2 * SX(motor.gear_inertia)) / 2


def friction(motor: Any, thd: SX) -> SX:
    """Friction torque [N m] (eq. 3.8): gradient of the dissipation."""
    return ca.gradient(_dissipation(motor, thd), thd)


def damping(motor: Any, thd: SX) -> SX:
    """Slope of the friction torque [N m s/rad]: curvature of the dissipation."""
    return ca.hessian(_dissipation(motor, thd), thd)[0]


def ripple(motor: Any, theta: SX) -> SX:
    """Torque [N m] of the periodic disturbances."""
    waves = {"input": _circle(motor.gear_ratio * theta), "output": _circle(theta)}
    total = SX(0)
    for wave in motor.ripple:
        c, s = _power(waves[wave.shaft], wave.harmonic)
        total += s * (wave.amplitude * ca.cos(wave.phase)) + c * (wave.amplitude * ca.sin(wave.phase))
    return total


def compensation(motor: Any, theta: SX, thd: SX) -> SX:
    """Motor torque [N m] that compensates a share of friction and ripple."""
    share = SX(motor.compensation)
    return share * friction(motor, thd) + share * ripple(motor, theta)


def torque(motor: Any, theta: SX, thd: SX, thdd: SX, f: SX) -> SX:
    """Motor torque [N m] of a motion: rate of the momentum plus friction, ripple and load."""
    momentum = ca.gradient(energy(motor, thd), thd)
    return ca.jtimes(momentum, thd, thdd) + _resistance(motor, theta, thd, f)


def acceleration(motor: Any, theta: SX, thd: SX, tau: SX, f: SX) -> SX:
    """Acceleration [rad/s^2] under a motor torque: the remaining torque changes the momentum."""
    inertia = ca.hessian(energy(motor, thd), thd)[0]
    return (tau - _resistance(motor, theta, thd, f)) / inertia


def _resistance(motor: Any, theta: SX, thd: SX, f: SX) -> SX:
    return friction(motor, thd) + ripple(motor, theta) + f * SX(motor.pulley)


def _dissipation(motor: Any, thd: SX) -> SX:
    """Rayleigh's function [W]: its gradient is the friction torque."""
    numbers = motor.friction
    steepness, level, viscosity = SX(numbers.steepness), SX(numbers.level), SX(numbers.viscosity)
    dry = thd * ca.atan(steepness * thd) - ca.log(1 + (steepness * thd) ** 2) / (2 * steepness)
    return level * dry + viscosity * thd**2 / 2


def _circle(angle: SX) -> tuple[SX, SX]:
    return ca.cos(angle), ca.sin(angle)


def _power(base: tuple[SX, SX], exponent: int) -> tuple[SX, SX]:
    """A power of a complex number of modulus 1, by squaring."""
    if exponent == 1:
        return base
    c, s = _power(base, exponent // 2)
    c, s = 1 - 2 * s**2, 2 * c * s
    return (c * base[0] - s * base[1], c * base[1] + s * base[0]) if exponent % 2 else (c, s)
