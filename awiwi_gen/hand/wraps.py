"""Bodies that tendons wrap round, in plain floats: what the checks of a hand file need before anything is derived."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

__all__ = ["INSIDE_CLEARANCE", "LEAST_ARC", "Body", "Vector"]

LEAST_ARC = Fraction(-1, 1000000)
"""Arc [rad] down to which kernels compute a string as touching its body; see `definitions/wraps.py`."""

INSIDE_CLEARANCE = Fraction(1, 64)
"""Least (distance / radius)^2 - 1 of both ends where a string bends inside a body, a power of two.

Down to there the fixed number of iterations converges; see `definitions/inside_wraps.py`.
"""

Vector = tuple[float, float, float]


_SECTIONS = 60  # of a search: down to rounding


class Turn(NamedTuple):
    """How a line passes a body: on which side (by sign; None without a side), the cosine of its angle, and its axis."""

    side: float | None
    cosine: float
    axis: list[float]

    def is_like(self, other: Turn) -> bool:
        """Whether a line goes round the body as another does, as the kernels' guards see it."""
        near = self.cosine if self.side is None or other.side is None else self.side * other.side
        return max(near, _dot(self.axis, other.axis)) > 0


class Body(NamedTuple):
    """A sphere, or a cylinder if it has an axis, in the frame of a link (-1: the base): lengths in metres."""

    link: int
    centre: Vector
    radius: float
    axis: Vector | None
    side: Vector | None
    inside: bool = False

    def across(self, place: Vector) -> tuple[list[float], float]:
        """A point of the frame from the centre, across the axis, and its height along the axis [m]."""
        from_centre = [a - b for a, b in zip(place, self.centre, strict=True)]
        if self.axis is None:
            return from_centre, 0.0
        unit = [a / math.hypot(*self.axis) for a in self.axis]
        height = _dot(unit, from_centre)
        return [a - height * b for a, b in zip(from_centre, unit, strict=True)], height

    def distance(self, place: Vector) -> float:
        """Distance [m] of a point of the frame from the axis, or from a sphere's centre."""
        return math.hypot(*self.across(place)[0])

    def turn(self, start: Vector, end: Vector) -> Turn:
        """How a line passes the body between two points of the frame."""
        one, other = ([x / math.hypot(*each) for x in each] for each in (self.across(start)[0], self.across(end)[0]))
        if self.side is None:
            return Turn(None, _dot(one, other), _cross(one, other))
        side = self.across(self.side)[0]
        if self.axis is not None:
            change = [b - a for a, b in zip(one, other, strict=True)]
            return Turn(_dot(self.axis, _cross(side, change)), 0.0, [0.0] * 3)
        passing = _dot(side, [a + b for a, b in zip(one, other, strict=True)])
        return Turn(passing, 0.0, [math.copysign(1, passing) * each for each in _cross(one, other)])

    def clearance(self, start: Vector, end: Vector) -> float:
        """(distance / radius)^2 - 1 of the nearer one of two points."""
        return (min(self.distance(start), self.distance(end)) / self.radius) ** 2 - 1

    def bends(self, start: Vector, end: Vector) -> bool:
        """Whether a string through the inside of the body bends there: both ends are outside, and a straight line misses."""
        if self.clearance(start, end) <= 0:
            return False
        seen = sum(math.acos(self.radius / self.distance(each)) for each in (start, end))
        return self._angle(start, end) < seen

    def _angle(self, start: Vector, end: Vector) -> float:
        """The smaller angle [rad] between two points, seen from the body."""
        first, last = self.across(start)[0], self.across(end)[0]
        return math.atan2(math.hypot(*_cross(first, last)), _dot(first, last))

    def _bent(self, start: Vector, end: Vector) -> float:
        """Length [m], across the axis, of a string that bends inside the body: as short as the surface permits.

        On the side that both ends see, the length is a convex function of the point's angle.
        """
        angle, radius = self._angle(start, end), self.radius
        first, last = self.distance(start), self.distance(end)

        def length(turned: float) -> float:
            squares = (
                first**2 - 2 * first * radius * math.cos(turned),
                last**2 - 2 * last * radius * math.cos(angle - turned),
            )
            return sum(math.sqrt(square + radius**2) for square in squares)

        low, high = max(0.0, angle - math.acos(radius / last)), min(angle, math.acos(radius / first))
        for _ in range(_SECTIONS):
            third = (high - low) / 3
            low, high = (low, high - third) if length(low + third) < length(high - third) else (low + third, high)
        return length((low + high) / 2)

    def length(self, start: Vector, end: Vector) -> float:
        """Length [m] of the line past the body between two points of the frame; straight where one is inside."""
        (first, low), (last, high) = self.across(start), self.across(end)
        distances = math.hypot(*first), math.hypot(*last)
        straight = math.dist(first, last)
        if self.inside and self.bends(start, end):
            return math.hypot(self._bent(start, end), high - low)
        if self.inside or min(distances) <= self.radius:
            return math.hypot(straight, high - low)
        one, other = ([x / distance for x in each] for each, distance in zip((first, last), distances, strict=True))
        middle = [a + b for a, b in zip(one, other, strict=True)]
        half = math.atan2(math.dist(one, other), math.hypot(*middle))
        if self.side is not None and _dot(self.across(self.side)[0], middle) < 0:
            half = math.pi - half
        arc = 2 * half - sum(math.acos(self.radius / distance) for distance in distances)
        if arc <= 0:
            return math.hypot(straight, high - low)
        tangents = sum(math.sqrt(distance**2 - self.radius**2) for distance in distances)
        return math.hypot(tangents + self.radius * arc, high - low)


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
