"""The lever spring by its definition: lengths, and the principle of virtual work (table 4.1, figure 4.6).

The tendon runs from the motor's pulley over the roller on the lever to the fixed pulley; dL is its length between the
two pulleys. A lever rotation d theta shortens it by -d dL and stretches the spring by ds, so

    f = -K (s - s0) (ds/d theta) / (d dL/d theta)        k = -(df/d theta) / (d dL/d theta)

Pulleys have signed radii, positive where the tendon bends to the left. A `spring` is the hand file's `Spring` or its
symbolic copy. An `angle` is a symbol, since results are differentiated by it.
"""

from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation


@dataclass(frozen=True)
class Pose:
    """dL [m], force [N] and stiffness [N/m] of the tendon at one lever angle, and the guards that must be positive."""

    length: Expr
    force: Expr
    stiffness: Expr
    guards: list[Expr]


@dataclass(frozen=True)
class Run:
    """A straight run of the tendon: `chord` is the line of centres of two pulleys, `gap` the difference of their radii,
    `length` [m] that of their common tangent."""

    chord: tuple[Expr, Expr]
    square: Expr
    length: Expr
    gap: Expr

    def angle_from(self, other: "Run") -> Expr:
        """Angle [rad] from another run's direction to this one's; each is tilted against its line of centres."""
        (x, y), (u, v) = self.chord, other.chord
        tilt, other_tilt = sympy.atan2(self.gap, self.length), sympy.atan2(other.gap, other.length)
        return sympy.atan2(u * y - v * x, u * x + v * y) - (tilt - other_tilt)


def lever(spring: Any, theta: Matrix) -> tuple[Expr, Expr, Expr, list[Expr]]:
    """dL [m], force [N] and stiffness [N/m] of the tendon at the lever angle theta [rad]."""
    pose = pose_at(spring, theta[0], Derivation("s"))
    return pose.length, pose.force, pose.stiffness, pose.guards


def pose_at(spring: Any, angle: Expr, derivation: Derivation) -> Pose:
    """The mechanism at a lever angle."""
    before, after = runs(spring, angle, derivation)
    length = path(spring, angle, derivation)
    stretch = spring_length(spring, angle, derivation) - spring.free_length
    leverage = derivation.name(derivation.partial(length, angle))
    force = derivation.name(-spring.rate * stretch * derivation.partial(stretch, angle) / leverage)
    stiffness = -derivation.partial(force, angle) / leverage
    guards = [before.square, after.square, (spring.slack - spring.taut) * leverage, stretch]
    return Pose(length, force, stiffness, guards)


def path(spring: Any, angle: Expr, derivation: Derivation) -> Expr:
    """dL [m]: both runs, the arc on the roller, and what the outer pulleys have wound up since the slack end."""
    before, after = runs(spring, angle, derivation)
    slack_before, slack_after = runs(spring, spring.slack, derivation)
    first, second = before.angle_from(slack_before), after.angle_from(slack_after)
    motor, roller, fixed = radii(spring)
    wrapped = slack_after.angle_from(slack_before) + second - first
    return before.length + after.length + motor * first + roller * wrapped - fixed * second


def runs(spring: Any, angle: Expr, derivation: Derivation) -> tuple[Run, Run]:
    """The runs before and after the roller."""
    centre = spring.pivot[0] + spring.arm * sympy.cos(angle), spring.pivot[1] + spring.arm * sympy.sin(angle)
    motor, roller, fixed = radii(spring)

    def run(start: tuple[Expr, Expr], end: tuple[Expr, Expr], gap: Expr) -> Run:
        x, y = derivation.name(end[0] - start[0]), derivation.name(end[1] - start[1])
        square = derivation.name(x**2 + y**2 - gap**2)
        return Run((x, y), square, derivation.name(sympy.sqrt(square)), gap)

    return run(spring.motor.centre, centre, roller - motor), run(centre, spring.fixed.centre, fixed - roller)


def radii(spring: Any) -> tuple[Expr, Expr, Expr]:
    """Signed radii of the motor's pulley, the roller and the fixed pulley [m]."""
    motor, roller, fixed = (wheel.winding * wheel.radius for wheel in (spring.motor, spring.roller, spring.fixed))
    return motor, roller, fixed


def spring_length(spring: Any, angle: Expr, derivation: Derivation) -> Expr:
    """s [m]: from the anchor to the point of the lever where the spring is attached."""
    hook = angle + spring.spring_angle
    x = spring.pivot[0] + spring.spring_arm * sympy.cos(hook) - spring.anchor[0]
    y = spring.pivot[1] + spring.spring_arm * sympy.sin(hook) - spring.anchor[1]
    return derivation.name(sympy.sqrt(derivation.name(x) ** 2 + derivation.name(y) ** 2))
