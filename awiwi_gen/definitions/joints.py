"""What acts in the joints themselves, by energies: rotors, springs, and Rayleigh's dissipation of damping and friction.

Angles and velocities are those of all joints, so followers count with what they move per motion of their leaders; a
four-bar's joint is its crank. Dry friction is torque * 2/pi * atan(velocity of the joint / velocity), smooth at rest like
that of motors (eq. 3.8).
"""

from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.kinematics import joint_angles, joint_rates
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.structure import Finger


def rotor_energy(finger: Finger, q: Matrix, qd: Matrix) -> Expr:
    """Kinetic energy [J] of the rotors that joints see as their armature."""
    rates = joint_rates(finger, q, qd)
    return sum((k.armature * rates[k.joint] ** 2 / 2 for k in finger.links if k.armature is not None), sympy.S.Zero)


def spring_energy(finger: Finger, q: Matrix) -> Expr:
    """Energy [J] in the springs of the joints."""
    angles = joint_angles(finger, q)
    springs = [(link.spring, angles[link.joint]) for link in finger.links if link.spring is not None]
    return sum((spring.stiffness * (angle - spring.reference) ** 2 / 2 for spring, angle in springs), sympy.S.Zero)


def dissipation(finger: Finger, q: Matrix, qd: Matrix) -> Expr:
    """Rayleigh's function [W], whose gradient by qd are the torques of damping and friction."""
    rates, total = joint_rates(finger, q, qd), sympy.S.Zero
    for link in finger.links:
        if link.damping is not None:
            total += link.damping * rates[link.joint] ** 2 / 2
        if link.friction is not None:
            total += _dry(link.friction, rates[link.joint])
    return total


def passive_torque(finger: Finger, q: Matrix, qd: Matrix) -> Matrix:
    """Joint torques (n) [N m] that damping, friction and springs take up: on the side of M qdd."""
    derive, springs, lost = Derivation(), spring_energy(finger, q), dissipation(finger, q, qd)
    pairs = zip(q, qd, strict=True)
    return Matrix([derive.partial(springs, angle) + derive.partial(lost, rate) for angle, rate in pairs])


def _dry(friction: Any, rate: Expr) -> Expr:
    """Integral of the friction torque, or of a slide's force, over the velocity."""
    share = rate / friction.velocity
    half_pi = sympy.atan2(friction.velocity, 0, evaluate=False)  # exact in every arithmetic
    area = rate * sympy.atan(share) - friction.velocity * sympy.log(1 + share**2) / 2
    return friction.level * area / half_pi
