"""The lever spring by the balance of moments about its pivot, with vectors and without derivatives.

The tendon pulls at the roller along both runs, u1 towards it and u2 away from it. The spring pulls at its hook. When
the lever rotates, a run of length t rotates by the sideways motion of its end divided by t. This gives the second
derivative of dL, and so the stiffness. Arcs are angles between directions.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
from casadi import SX


@dataclass(frozen=True)
class Pose:
    """dL [m], force [N] and stiffness [N/m] of the tendon at one lever angle, and the guards that must be positive."""

    length: SX
    force: SX
    stiffness: SX
    guards: list[SX]


@dataclass(frozen=True)
class Run:
    """A straight run of the tendon: its length [m] and the square of that, its direction (2)."""

    square: SX
    length: SX
    direction: SX


def lever(spring: Any, theta: SX) -> tuple[SX, SX, SX, list[SX]]:
    """dL [m], force [N] and stiffness [N/m] of the tendon at the lever angle theta [rad]."""
    pose = pose_at(spring, theta)
    return pose.length, pose.force, pose.stiffness, pose.guards


def pose_at(spring: Any, angle: SX) -> Pose:
    """The mechanism at a lever angle."""
    pivot = ca.vertcat(*spring.pivot)
    arm, hook = spring.arm * _direction(angle), spring.spring_arm * _direction(angle + spring.spring_angle)
    before, after = _runs(spring, pivot + arm)

    # Tendon: first and second derivative of dL by the lever angle. The roller moves across its arm.
    leverage = _cross(arm, before.direction - after.direction)
    sideways1, sideways2 = ca.dot(arm, before.direction), ca.dot(arm, after.direction)
    curvature = sideways1**2 / before.length + sideways2**2 / after.length - (sideways1 - sideways2)

    # Spring: its stretch, with first and second derivative.
    pull = ca.vertcat(*spring.anchor) - pivot - hook
    distance = ca.norm_2(pull)
    stretch = distance - spring.free_length
    slope = -_cross(hook, pull) / distance
    slope_derivative = (spring.spring_arm**2 + ca.dot(pull, hook) - slope**2) / distance

    force = -spring.rate * stretch * slope / leverage
    stiffness = (spring.rate * (slope**2 + stretch * slope_derivative) + force * curvature) / leverage**2
    guards = [before.square, after.square, leverage * (spring.slack - spring.taut), stretch]
    return Pose(_path(spring, before, after), force, stiffness, guards)


def _path(spring: Any, before: Run, after: Run) -> SX:
    """dL [m]: both runs, the arc on the roller, and what the outer pulleys have wound up since the slack end."""
    slack_before, slack_after = _runs(spring, ca.vertcat(*spring.pivot) + spring.arm * _direction(SX(spring.slack)))
    first = _angle(slack_before.direction, before.direction)
    second = _angle(slack_after.direction, after.direction)
    motor, roller, fixed = _radii(spring)
    wrapped = _angle(slack_before.direction, slack_after.direction) + second - first
    return before.length + after.length + motor * first + roller * wrapped - fixed * second


def _runs(spring: Any, centre: SX) -> tuple[Run, Run]:
    """The runs before and after the roller with the given centre (2)."""
    motor, roller, fixed = _radii(spring)
    before = _run(centre - ca.vertcat(*spring.motor.centre), roller - motor)
    return before, _run(ca.vertcat(*spring.fixed.centre) - centre, fixed - roller)


def _run(chord: SX, gap: SX) -> Run:
    """The common tangent of two circles: it is tilted against the line of centres by the difference of their radii."""
    across = ca.dot(chord, chord)
    square = across - gap**2
    length = ca.sqrt(square)
    direction = (length * chord + gap * ca.vertcat(chord[1], -chord[0])) / across
    return Run(square, length, direction)


def _radii(spring: Any) -> tuple[SX, SX, SX]:
    motor, roller, fixed = (SX(wheel.winding * wheel.radius) for wheel in (spring.motor, spring.roller, spring.fixed))
    return motor, roller, fixed


def _direction(angle: SX) -> SX:
    return ca.vertcat(ca.cos(angle), ca.sin(angle))


def _cross(a: SX, b: SX) -> SX:
    return a[0] * b[1] - a[1] * b[0]


def _angle(a: SX, b: SX) -> SX:
    """The angle [rad] from one direction to another."""
    return ca.atan2(_cross(a, b), ca.dot(a, b))
