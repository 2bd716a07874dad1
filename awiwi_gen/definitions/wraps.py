"""Tendons that wrap round spheres and cylinders: the shortest line between two points outside, on one side of the body.

Everything is seen from the body. In the plane of a sphere's centre and both points, or across a cylinder's axis, the line
is a tangent, an arc and a tangent, as long as the arc is not negative; else it is straight. Both have the same length and
the same arms where the arc is zero, to the third and second order in the arc. So the arc may also be slightly negative:
many models are drawn with strings that just touch, and there the stiffness would be undecided. Unrolled, the line on a
cylinder is straight too, so its length is the hypotenuse of the length in the plane and the distance along the axis.
"""

from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.kinematics import Frame
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.hand.wraps import LEAST_ARC
from awiwi_gen.structure import Finger, link_number


@dataclass(frozen=True)
class Wrap:
    """A run of tendon in the frame of the body's link: `start` and `end` (3 x 1) [m] from its centre, across the axis.

    `rise` [m] is the distance from the start to the end along the axis, zero for a sphere; `side` (3 x 1) [m] leads from
    the centre to the side point, if there is one.
    """

    body: Any
    start: Matrix
    end: Matrix
    rise: Expr
    side: Matrix | None

    @property
    def directions(self) -> tuple[Matrix, Matrix]:
        """Unit vectors (3 x 1) to the start and to the end."""
        return self.start / _length(self.start), self.end / _length(self.end)


def seen_from_body(finger: Finger, run: Any, links: list[Frame], derivation: Derivation) -> Wrap:
    """A run, from the frames of the base and of all links."""
    body = run.body
    home = links[link_number(finger, body.link) + 1]

    def relative(link: str, at: Any) -> Matrix:
        if link == body.link:
            return Matrix(at) - Matrix(body.at)
        place = links[link_number(finger, link) + 1].point(Matrix(at))
        return home.axes.T * derivation.name_all(place - home.origin) - Matrix(body.at)

    start, end = (derivation.name_all(relative(point.link, point.at)) for point in (run.start, run.end))
    side = None if body.side is None else derivation.name_all(relative(body.carrier or body.link, body.side))
    if body.axis is None:
        return Wrap(body, start, end, sympy.S.Zero, side)
    axis = _unit(body.axis)
    heights = [derivation.name(axis.dot(point)) for point in (start, end)]
    start, end = (
        derivation.name_all(point - axis * height) for point, height in zip((start, end), heights, strict=True)
    )
    return Wrap(body, start, end, derivation.name(heights[1] - heights[0]), side)


def wrapped_length(wrap: Wrap, derivation: Derivation) -> Expr:
    """Length [m] of a run."""
    name, radius = derivation.name, wrap.body.radius
    straight = name(_length(derivation.name_all(wrap.end - wrap.start)))
    distances = [name(_length(point)) for point in (wrap.start, wrap.end)]
    tangents = [name(sympy.sqrt(distance**2 - radius**2)) for distance in distances]
    angle = _angle(wrap, distances, derivation)
    arc = name(angle - sum(sympy.atan2(tangent, radius) for tangent in tangents))
    touches = name((1 + sympy.sign(arc - sympy.Rational(LEAST_ARC))) / 2)
    across = name(straight + touches * (sum(tangents) + radius * arc - straight))
    return across if wrap.body.axis is None else name(sympy.sqrt(across**2 + wrap.rise**2))


def clearance(wrap: Wrap, point: Matrix) -> Expr:
    """How far a point (3 x 1) [m] is outside the body: (distance / radius)^2 - 1."""
    return point.dot(point) / wrap.body.radius**2 - 1


def passing(wrap: Wrap) -> Expr:
    """On which side the run passes the body: positive where the side point is, or with the same turn about the axis."""
    first, last = wrap.directions
    side = wrap.side / wrap.body.radius
    if wrap.body.axis is None:
        return side.dot(first + last)
    return _unit(wrap.body.axis).dot(side.cross(last - first))


def same_side(wrap: Wrap, other: Wrap) -> Expr:
    """Positive where a run passes the body on the same side in two poses.

    Without a side point, or past half a turn round a sphere, the vectors tell about which the run turns. Such a vector may
    also change where both ends are in nearly one direction from the body, for there the run is straight.
    """
    if wrap.body.side is None:
        sides = wrap.directions[0].dot(wrap.directions[1])
    else:
        sides = passing(wrap) * passing(other)
        if wrap.body.axis is not None:
            return sides
    turns = _turn(wrap).dot(_turn(other))
    return (sides + turns + abs(sides - turns)) / 2


def _turn(wrap: Wrap) -> Matrix:
    """A vector (3 x 1) about which the run turns, as long as the sine of its angle."""
    first, last = wrap.directions
    return first.cross(last) * (1 if wrap.body.side is None else sympy.sign(passing(wrap)))


def _angle(wrap: Wrap, distances: list[Expr], derivation: Derivation) -> Expr:
    """The angle [rad] at the body from the start to the end, on the side of the side point; else the smaller one.

    Half of it has the sine and the cosine of half the difference and half the sum of the unit vectors.
    """
    first, last = (
        derivation.name_all(point / distance) for point, distance in zip((wrap.start, wrap.end), distances, strict=True)
    )
    sine, cosine = (derivation.name(_length(derivation.name_all(each))) for each in (last - first, last + first))
    if wrap.body.side is not None:
        if wrap.body.axis is not None:  # smooth where both points and the axis are in a plane
            cosine = 2 * _unit(wrap.body.axis).dot(first.cross(last)) / sine
        cosine *= derivation.name(sympy.sign(passing(wrap)))
    return 2 * sympy.atan2(sine, derivation.name(cosine))


def _unit(vector: Any) -> Matrix:
    """The unit vector (3 x 1) of a direction."""
    return Matrix(vector) / _length(Matrix(vector))


def _length(vector: Matrix) -> Expr:
    return sympy.sqrt(vector.dot(vector))
