"""The lever spring in plain floats: what the checks of a hand file need before anything is derived.

The tendon pulls the roller with two forces f along its straight runs, u1 towards it and u2 away from it; the spring
pulls the lever's other arm. Their moments about the pivot balance. All functions but arcs are analytic, so one
evaluation with an imaginary step gives a derivative with negligible rounding error.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from awiwi_gen.hand.actuation import Spring

__all__ = ["BEYOND", "CURVE_NODES", "POWERS", "READING_NODES", "Lever", "Pose", "chebyshev"]

CURVE_NODES = 17  # samples for curves over elongation or force; each two more make the error ten times smaller
READING_NODES = 9  # samples for curves over sensor readings, which are smoother
POWERS = 7  # coefficients of a measured calibration polynomial: degree 6 is finer than the data
BEYOND = Fraction(65, 64)  # square of how far curves may be followed, in halves of the travel: an 0.8 % margin

Vector = tuple[complex, complex]

_STEP = 1e-30  # of the imaginary part: its square is far below the rounding error


@dataclass(frozen=True)
class Pose:
    """The lever at one angle.

    `path` is the tendon's length from the motor's pulley to the fixed one [m], `leverage` = d path/d angle [m/rad],
    `stretch` the spring's elongation [m], `wrap` the angle the tendon lies on the roller, in the sense of its winding
    [rad], `force` the tendon's [N], `stiffness` = - d force/d path [N/m].
    """

    angle: float
    path: float
    leverage: float
    stretch: float
    wrap: float
    force: float
    stiffness: float


class Lever:
    """A spring's mechanism. Raises `ValueError` where a pulley is too close for a straight run of the tendon."""

    def __init__(self, spring: Spring) -> None:
        self.motor, self.roller, self.fixed = (
            wheel.winding * float(wheel.radius) for wheel in (spring.motor, spring.roller, spring.fixed)
        )
        self.start, self.end, self.pivot, self.anchor = (
            (complex(float(x)), complex(float(y)))
            for x, y in (spring.motor.centre, spring.fixed.centre, spring.pivot, spring.anchor)
        )
        self.arm, self.spring_arm = float(spring.arm), float(spring.spring_arm)
        self.spring_angle = float(spring.spring_angle)
        self.rate, self.free_length = float(spring.rate), float(spring.free_length)
        self.slack, self.taut = float(spring.slack), float(spring.taut)

    @property
    def travel(self) -> float:
        """Length of tendon that the mechanism pays out between its slack and its taut end [m]."""
        return self._path(self.slack) - self._path(self.taut)

    def angles(self, steps: int) -> list[float]:
        """Equal steps of the angle from slack to taut, both included [rad]."""
        return [self.slack + (self.taut - self.slack) * i / steps for i in range(steps + 1)]

    def curve_error(self) -> float:
        """Largest error of the force by a polynomial through `CURVE_NODES` samples, over the largest force."""
        slack = self._path(self.slack)
        samples = [self.at(self.slack + float(share) * (self.taut - self.slack)) for share in chebyshev(CURVE_NODES)]
        nodes = [(slack - pose.path) / self.travel for pose in samples]
        differences = [pose.force for pose in samples]  # Newton's divided differences, in place
        for order in range(1, CURVE_NODES):
            for i in range(CURVE_NODES - 1, order - 1, -1):
                differences[i] = (differences[i] - differences[i - 1]) / (nodes[i] - nodes[i - order])

        def missed(pose: Pose) -> float:
            place, force = (slack - pose.path) / self.travel, 0.0
            for node, difference in zip(reversed(nodes), reversed(differences), strict=True):
                force = force * (place - node) + difference
            return abs(force - pose.force)

        return max(map(missed, map(self.at, self.angles(4 * CURVE_NODES)))) / max(pose.force for pose in samples)

    def at(self, angle: float) -> Pose:
        """The lever at one angle."""
        leverage, stretch, force = self._balance(complex(angle))
        rate = self._balance(complex(angle, _STEP))[2].imag / _STEP
        along = leverage.real
        stiffness = -rate / along if along else math.inf
        return Pose(angle, self._path(angle), along, stretch.real, self._wrap(angle), force.real, stiffness)

    def _balance(self, angle: complex) -> tuple[complex, complex, complex]:
        """Leverage, stretch and force at a real or complex angle."""
        (_, u1), (_, u2) = self._runs(angle)
        sideways = (-self.arm * cmath.sin(angle), self.arm * cmath.cos(angle))
        leverage = _dot((u1[0] - u2[0], u1[1] - u2[1]), sideways)
        direction = angle + self.spring_angle
        hook = _sum(self.pivot, (self.spring_arm * cmath.cos(direction), self.spring_arm * cmath.sin(direction)))
        pull = (self.anchor[0] - hook[0], self.anchor[1] - hook[1])
        length = cmath.sqrt(_dot(pull, pull))
        if not length.real > 0:
            raise ValueError("the lever has reached the spring's anchor")
        stretch = length - self.free_length
        moment = self.rate * stretch / length * _cross((hook[0] - self.pivot[0], hook[1] - self.pivot[1]), pull)
        return leverage, stretch, moment / leverage if leverage else complex(math.inf)

    def _runs(self, angle: complex) -> tuple[tuple[complex, Vector], tuple[complex, Vector]]:
        """Length and direction of the straight runs before and after the roller."""
        roller = _sum(self.pivot, (self.arm * cmath.cos(angle), self.arm * cmath.sin(angle)))
        before = _tangent(self.start, roller, self.roller - self.motor)
        return before, _tangent(roller, self.end, self.fixed - self.roller)

    def _path(self, angle: float) -> float:
        """Both runs and what lies on the roller; arcs on the outer pulleys count from where they begin when slack."""
        (_, d1), (_, d2) = self._runs(complex(self.slack))
        (t1, u1), (t2, u2) = self._runs(complex(angle))
        turn1, turn2 = _angle(d1, u1), _angle(d2, u2)
        return (t1 + t2).real + self.motor * turn1 + self.roller * (_angle(d1, d2) + turn2 - turn1) - self.fixed * turn2

    def _wrap(self, angle: float) -> float:
        (_, u1), (_, u2) = self._runs(complex(angle))
        return math.copysign(1.0, self.roller) * _angle(u1, u2)


def chebyshev(count: int) -> list[Fraction]:
    """Where to take samples of a smooth function on [0, 1] for a polynomial through them: the Chebyshev points.

    Rounded to short fractions, which move the polynomial far less than it errs anyway.
    """
    return [Fraction(round((1 - math.cos(math.pi * (i + 0.5) / count)) * 2**19), 2**20) for i in range(count)]


def _tangent(start: Vector, end: Vector, gap: float) -> tuple[complex, Vector]:
    """Length and direction of the common tangent of two circles whose signed radii differ by `gap`."""
    x, y = end[0] - start[0], end[1] - start[1]
    square = _dot((x, y), (x, y))
    if not square.real > gap * gap:
        raise ValueError("the roller is too close to a pulley for the tendon to run straight between them")
    length = cmath.sqrt(square - gap * gap)
    return length, ((length * x + gap * y) / square, (length * y - gap * x) / square)


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1]


def _dot(a: Vector, b: Vector) -> complex:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Vector, b: Vector) -> complex:
    return a[0] * b[1] - a[1] * b[0]


def _angle(a: Vector, b: Vector) -> float:
    """The angle from a to b, between -pi and pi."""
    return math.atan2(_cross(a, b).real, _dot(a, b).real)
