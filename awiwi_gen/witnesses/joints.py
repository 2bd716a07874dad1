"""What acts in the joints themselves, as torques: rotors, springs, damping and friction, each written down directly.

Coordinates move several joints where others follow; a follower's numbers count with the square of its ratio, but for dry
friction, which is not linear. The ratio is the slope of the follower's angle over its leader's.
"""

from collections.abc import Iterator
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, coordinates, leaders, motion


def armature(finger: Finger, q: SX) -> SX:
    """Inertias (n) [kg m^2] that rotors add to the diagonal of M."""
    result = SX.zeros(_count(finger))
    for link, coordinate, (_, ratio, _) in _joints(finger, q):
        if link.armature is not None:
            result[coordinate] += link.armature * ratio**2
    return result


def armature_rate(finger: Finger, q: SX, qd: SX) -> SX:
    """What rotors add to the diagonal (n) [N m s] of C: they turn faster where followers run ahead of their leaders."""
    result = SX.zeros(_count(finger))
    for link, coordinate, (_, ratio, change) in _joints(finger, q):
        if link.armature is not None:
            result[coordinate] += link.armature * ratio * change * qd[coordinate]
    return result


def spring_energy(finger: Finger, q: SX) -> SX:
    """Energy [J] in the springs of the joints."""
    total = SX(0)
    for link, _, (angle, _, _) in _joints(finger, q):
        if link.spring is not None:
            stretch = angle - link.spring.reference
            total += link.spring.stiffness * stretch * stretch / 2
    return total


def passive_springs(finger: Finger, q: SX) -> SX:
    """Joint torques (n) [N m] that the springs of the joints take up."""
    result = SX.zeros(_count(finger))
    for link, coordinate, (angle, ratio, _) in _joints(finger, q):
        if link.spring is not None:
            result[coordinate] += ratio * link.spring.stiffness * (angle - link.spring.reference)
    return result


def passive_torque(finger: Finger, q: SX, qd: SX) -> SX:
    """Joint torques (n) [N m] that damping, friction and springs take up: on the side of M qdd."""
    result = SX.zeros(_count(finger))
    for link, coordinate, (angle, ratio, _) in _joints(finger, q):
        velocity, torque = ratio * qd[coordinate], SX(0)
        if link.damping is not None:
            torque += link.damping * velocity
        if link.friction is not None:
            half_pi = ca.atan2(link.friction.velocity, SX(0))  # CasADi's own pi is rounded
            torque += link.friction.level * (ca.atan(velocity / link.friction.velocity) / half_pi)
        if link.spring is not None:
            torque += link.spring.stiffness * (angle - link.spring.reference)
        result[coordinate] += ratio * torque
    return result


def _joints(finger: Finger, q: SX) -> Iterator[tuple[Any, int, tuple[SX, SX, SX]]]:
    """Every link, the coordinate of its joint, and the joint's angle with its derivatives by that coordinate."""
    position = coordinates(finger)
    for link in finger.links:
        yield link, position[link.joint], followed(finger, link.joint, q[position[link.joint]])


def followed(finger: Finger, joint: str, angle: SX) -> tuple[SX, SX, SX]:
    """Angle [rad] of a joint whose coordinate has an angle, and its first two derivatives, by Horner's scheme."""
    if joint not in leaders(finger):
        return angle, SX(1), SX(0)
    value, slope, half_curvature = SX(0), SX(0), SX(0)
    for coefficient in reversed(motion(finger, joint)):
        half_curvature = half_curvature * angle + slope
        slope = slope * angle + value
        value = value * angle + coefficient
    return value, slope, 2 * half_curvature


def _count(finger: Finger) -> int:
    return len(finger.links) - len(finger.couplings)
