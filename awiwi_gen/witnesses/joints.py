"""What acts in the joints themselves, as torques: rotors, springs, damping and friction, each written down directly.

Coordinates move several joints where others follow; a follower's numbers count with the square of its ratio, but for dry
friction, which is not linear.
"""

from collections.abc import Iterator
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, coordinates, leaders, motion


def armature(finger: Finger) -> SX:
    """Inertias (n) [kg m^2] that rotors add to the diagonal of M."""
    result = SX.zeros(_count(finger))
    for link, coordinate, ratio, _ in _joints(finger):
        if link.armature is not None:
            result[coordinate] += link.armature * ratio**2
    return result


def spring_energy(finger: Finger, q: SX) -> SX:
    """Energy [J] in the springs of the joints."""
    total = SX(0)
    for link, coordinate, ratio, rest in _joints(finger):
        if link.spring is not None:
            stretch = ratio * q[coordinate] + rest - link.spring.reference
            total += link.spring.stiffness * stretch * stretch / 2
    return total


def passive_torque(finger: Finger, q: SX, qd: SX) -> SX:
    """Joint torques (n) [N m] that damping, friction and springs take up: on the side of M qdd."""
    result = SX.zeros(_count(finger))
    for link, coordinate, ratio, rest in _joints(finger):
        velocity, torque = ratio * qd[coordinate], SX(0)
        if link.damping is not None:
            torque += link.damping * velocity
        if link.friction is not None:
            half_pi = ca.atan2(link.friction.velocity, SX(0))  # CasADi's own pi is rounded
            torque += link.friction.torque * (ca.atan(velocity / link.friction.velocity) / half_pi)
        if link.spring is not None:
            torque += link.spring.stiffness * (ratio * q[coordinate] + rest - link.spring.reference)
        result[coordinate] += ratio * torque
    return result


def _joints(finger: Finger) -> Iterator[tuple[Any, int, SX, SX]]:
    """Every link, the coordinate of its joint, the joint's angle per unit of that coordinate, and its angle at zero."""
    position, follows = coordinates(finger), leaders(finger)
    for link in finger.links:
        ratio, rest = motion(finger, link.joint) if link.joint in follows else (1, 0)
        yield link, position[link.joint], SX(ratio), SX(rest)


def _count(finger: Finger) -> int:
    return len(finger.links) - len(finger.couplings)
