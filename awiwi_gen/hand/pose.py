"""A finger's pose and tendons in plain floats: what the checks of a hand file need before anything is derived.

Frames are those of the definition of the kinematics: offset, fixed rotation, rotation about z (eq. 5.2, 5.3); a four-bar
is a crank of angle q + reference and a coupler. Everything is a function of the n independent joint angles q [rad], which
are positions [m] of joints that slide along z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

from awiwi_gen.hand.parts import MOST, PALM, Finger, FourBar, Link, Tendon
from awiwi_gen.hand.wraps import Body, Vector

__all__ = ["Chain", "Line", "Spot", "point", "polynomial"]

_ROUNDING = 1e-15  # of the sine of a quarter turn
Axes = tuple[Vector, Vector, Vector]  # unit vectors of a frame, in base axes
Frame = tuple[Axes, Vector]  # with its origin

_SAMPLES = 24
# Square roots of primes spread samples evenly over up to 32 joints.
_PRIMES = [p for p in range(2, 132) if all(p % d for d in range(2, p))][:MOST]
_STEP, _SLIDE_STEP = 1e-5, 1e-7  # rad and m, of central differences: errors of 1e-10 relative
_SWEEPS, _SECTIONS = 3, 24  # of a search for the shortest length, joint by joint
_SHORTENING = 0.5  # a length that falls below this share of its mean is searched for zero


class Spot(NamedTuple):
    """A point of the chain: coordinates in the frame of a link (-1: the base), before or after its joint's rotation."""

    link: int
    rotated: bool
    at: Vector


class Line(NamedTuple):
    """A piece of a tendon from point to point, straight or round a body; its length counts divided by `divisor`."""

    start: Spot
    end: Spot
    body: Body | None
    divisor: float = 1.0
    side: Spot | None = None  # the body's side point, where another link carries it


class Chain:
    """One finger, as functions of its joint angles."""

    def __init__(self, finger: Finger) -> None:
        self.finger = finger
        self.joints = finger.joints
        free = [link for link in finger.links if link.joint in finger.joints]
        self.low = [float(link.low or 0) for link in free]
        self.high = [float(link.high or 0) for link in free]
        radii = {joint: float(radius) for joint, radius in finger.radii.items()}
        self._angles = []  # of every link: column in q, and coefficients of its angle by powers of that in the column
        for link in finger.links:
            leader = finger.leaders.get(link.joint, link.joint)
            self._angles.append((self.joints.index(leader), finger.motion(link.joint)))
        self._links = [
            (_elementary(link), _floats(link.offset), float(link.reference or 0), float(link.start), link)
            for link in finger.links
        ]
        self._order = {link.joint: index for index, link in enumerate(finger.links)}
        self._radii = radii
        # The lines of every tendon: that of its span, if it has one, then those of its path.
        self.lines = [self._lines_of(tendon) for tendon in finger.tendons]

    def poses(self) -> list[list[float]]:
        """Joint angles spread over the range: the middle, both ends, and an even sequence between them [rad]."""
        shares = [[0.5] * len(self.joints), [0.0] * len(self.joints), [1.0] * len(self.joints)]
        shares += [[i * math.sqrt(prime) % 1.0 for prime in _PRIMES[: len(self.joints)]] for i in range(1, _SAMPLES)]
        return [[a + (b - a) * x for a, b, x in zip(self.low, self.high, each, strict=True)] for each in shares]

    def couplings(self) -> Iterator[list[list[float]]]:
        """The coupling in all `poses`; once if it is the same everywhere, as that of pulleys on proportional joints."""
        changes = any(self.lines) or self.finger.curved
        yield from map(self.coupling, self.poses() if changes else self.poses()[:1])

    def coupling(self, q: Sequence[float]) -> list[list[float]]:
        """dh/dq [m/rad], a row for each tendon of the file: senses times radii, arms, and central differences of lines."""
        rows = []
        for tendon, lines in zip(self.finger.tendons, self.lines, strict=True):
            row = [0.0] * len(self.joints)
            for joint, arm in self._arms(tendon):
                column, slope = self.slope(joint, q)
                row[column] += arm * slope
            if lines:
                for column, joint in enumerate(self.joints):
                    ends, step = [list(q), list(q)], _SLIDE_STEP if joint in self.finger.sliding else _STEP
                    ends[0][column] -= step
                    ends[1][column] += step
                    before, after = (sum(self.distance(end, line) / line.divisor for line in lines) for end in ends)
                    row[column] += (after - before) / (2 * step)
            rows.append(row)
        return rows

    def shortest(self, line: Line) -> tuple[float, list[float]]:
        """The shortest length of a line over the range [m], and the joint angles of it [rad]."""
        return self.least(partial(self.distance, line=line))

    def least(self, distance: Callable[[Sequence[float]], float]) -> tuple[float, list[float]]:
        """The least value over the range of what is a length [m] or a distance, and the joint angles of it [rad]."""
        found = sorted((distance(q), q) for q in self.poses())
        length, q = found[0]
        if length > _SHORTENING * sum(each for each, _ in found) / len(found):
            return length, q
        for _ in range(_SWEEPS):
            for column, ends in enumerate(zip(self.low, self.high, strict=True)):
                q = _least(distance, q, column, ends)
        return distance(q), q

    def longest(self, tendon: int) -> float:
        """The longest length of a tendon [m]: at the best ends of the ranges, lines being searched joint by joint."""
        found = max(self.poses(), key=partial(self.length, tendon))
        for _ in range(_SWEEPS):
            for column, ends in enumerate(zip(self.low, self.high, strict=True)):
                found = _least(lambda q: -self.length(tendon, q), found, column, ends)
        return self.length(tendon, found)

    def length(self, number: int, q: Sequence[float]) -> float:
        """Length of a tendon [m]."""
        tendon = self.finger.tendons[number]
        length = float(tendon.rest) + sum(self.distance(q, line) / line.divisor for line in self.lines[number])
        for joint, arm in self._arms(tendon):
            column, coefficients = self._angles[self._order[joint]]
            length += arm * polynomial(coefficients, q[column])
        return length

    def slope(self, joint: str, q: Sequence[float]) -> tuple[int, float]:
        """The column in q that moves a joint, and its angle per angle in that column."""
        column, coefficients = self._angles[self._order[joint]]
        return column, polynomial([k * each for k, each in enumerate(coefficients)][1:], q[column])

    def _arms(self, tendon: Tendon) -> list[tuple[str, float]]:
        """Joints and the length per angle [m/rad] that a tendon has there: signed radii of pulleys, and its own arms."""
        signed = [(over[1:], math.copysign(self._radii[over[1:]], float(f"{over[0]}1"))) for over in tendon.over]
        return signed + [(joint, float(arm)) for joint, arm in tendon.arms.items()]

    def distance(self, q: Sequence[float], line: Line) -> float:
        """Length of a line [m]."""
        if line.body is None:
            return math.dist(self.place(q, line.start), self.place(q, line.end))
        return self.posed(line.body, q, line).length(*self.seen_by(line.body, q, line))

    def seen_by(self, body: Body, q: Sequence[float], line: Line) -> tuple[Vector, Vector]:
        """Both ends of a line [m], in the frame of a body."""
        axes, origin = self._frame(q, body.link, True)
        first, last = (self.place(q, spot) for spot in (line.start, line.end))
        return seen(axes, origin, first), seen(axes, origin, last)

    def posed(self, body: Body, q: Sequence[float], line: Line) -> Body:
        """The body of a line, with its side point where that is in a pose."""
        if line.side is None:
            return body
        return body._replace(side=seen(*self._frame(q, body.link, True), self.place(q, line.side)))

    def place(self, q: Sequence[float], spot: Spot) -> Vector:
        """A point of the chain in base axes [m]."""
        return point(*self._frame(q, spot.link, spot.rotated), spot.at)

    def _lines_of(self, tendon: Tendon) -> list[Line]:
        """A span begins in the base frame and ends before a rotation; points of a path move with their links."""
        span, number = tendon.span, {PALM: -1, **self._order}
        lines = []
        if span:
            end = Spot(number[span.joint], False, _floats(span.to))
            lines.append(Line(Spot(-1, True, _floats(span.from_)), end, None))
        for run in tendon.runs:
            first, last = (Spot(number[each.link], True, _floats(each.at)) for each in (run.start, run.end))
            body = moving = None
            if run.body is not None:
                axis, side = (None if each is None else _floats(each) for each in (run.body.axis, run.body.side))
                body = Body(
                    number[run.body.link],
                    _floats(run.body.at),
                    float(run.body.radius or 0),
                    axis,
                    side,
                    run.body.inside,
                )
                if run.body.carrier and side is not None:
                    moving = Spot(number[run.body.carrier], True, side)
            lines.append(Line(first, last, body, float(run.divisor or 1), moving))
        return lines

    def _frame(self, q: Sequence[float], joint: int, rotated: bool) -> Frame:
        """The frame of a joint after its fixed turn, before or after its rotation; that of the base for joint -1."""
        if joint < 0:
            return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0)
        return next(both[rotated] for number, both in enumerate(self.frames(q)) if number == joint)

    def frames(self, q: Sequence[float]) -> Iterator[tuple[Frame, Frame]]:
        """Of every link, the frame in which its joint rotates, and its own."""
        axes: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        origin: Vector = (0.0, 0.0, 0.0)
        offset: Vector = (0.0, 0.0, 0.0)
        for (turns, following, drawn, start, link), (column, followed) in zip(self._links, self._angles, strict=True):
            origin = point(axes, origin, offset)
            for axis, angle in turns:
                axes = _rotated(axes, angle, axis)
            seat, angle = (axes, origin), polynomial(followed, q[column])
            if link.slides:
                origin, offset = point(axes, origin, (0.0, 0.0, angle - drawn)), following
                yield seat, (axes, origin)
                continue
            if bar := link.four_bar:
                reference = float(bar.reference)
                origin = point(_rotated(axes, angle + reference), origin, (float(bar.crank), 0.0, 0.0))
                angle = coupler_angle(bar, angle + reference) - coupler_angle(bar, start + reference)
            axes, offset = _rotated(axes, angle - drawn), following
            yield seat, (axes, origin)


def _elementary(link: Link) -> list[tuple[int, float]]:
    """The fixed rotations in front of a joint: axis and angle [rad], in order."""
    turn = [] if link.turn == "none" else [("xyz".index(link.turn[0]), math.radians(float(link.turn[1:])))]
    roll, pitch, yaw = link.rpy or (0, 0, 0)
    return [*turn, *((axis, float(angle)) for axis, angle in ((2, yaw), (1, pitch), (0, roll)) if angle)]


def fixed_rotation(part: Any) -> Axes:
    """The axes that `turn` and `rpy` of a part make of those before them; quarter turns are exact."""
    axes: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    for axis, angle in _elementary(part):
        axes = _rotated(axes, angle, axis)
    a, b, c = (tuple(round(x) if abs(x - round(x)) < _ROUNDING else x for x in axis) for axis in axes)
    return (a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2])


def polynomial(coefficients: Sequence[float], x: float) -> float:
    """The sum of coefficients times powers of x, from the zeroth on."""
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * x + coefficient
    return total


def _floats(point: Sequence[object]) -> Vector:
    x, y, z = (float(value) for value in point)  # type: ignore[arg-type]
    return x, y, z


def point(axes: Axes, origin: Vector, local: Vector) -> Vector:
    """A point of a frame in base axes [m]."""
    (a, b, c), (x, y, z) = axes, local
    return (
        origin[0] + x * a[0] + y * b[0] + z * c[0],
        origin[1] + x * a[1] + y * b[1] + z * c[1],
        origin[2] + x * a[2] + y * b[2] + z * c[2],
    )


def seen(axes: Axes, origin: Vector, place: Vector) -> Vector:
    """A point in base axes [m], in those of a frame."""
    x, y, z = (sum(a * (p - o) for a, p, o in zip(axis, place, origin, strict=True)) for axis in axes)
    return x, y, z


def _rotated(axes: Axes, angle: float, about: int = 2) -> Axes:
    """The axes after a rotation about one of them."""
    first, second = axes[(about + 1) % 3], axes[(about + 2) % 3]
    c, s = math.cos(angle), math.sin(angle)
    new = list(axes)
    new[(about + 1) % 3] = (c * first[0] + s * second[0], c * first[1] + s * second[1], c * first[2] + s * second[2])
    new[(about + 2) % 3] = (c * second[0] - s * first[0], c * second[1] - s * first[1], c * second[2] - s * first[2])
    return new[0], new[1], new[2]


def coupler_angle(bar: FourBar, crank: float) -> float:
    """Angle of a four-bar's coupler [rad]; where the bars do not close, of bars that are stretched to close."""
    coupler, rocker = float(bar.coupler), float(bar.rocker)
    east, north = float(bar.ground) - float(bar.crank) * math.cos(crank), -float(bar.crank) * math.sin(crank)
    reach = (coupler**2 - rocker**2 - east**2 - north**2) / (2 * rocker)
    share = max(-1.0, min(1.0, reach / (math.hypot(east, north) or 1.0)))
    angle = math.atan2(north, east) - bar.branch * math.acos(share)
    return math.atan2(north + rocker * math.sin(angle), east + rocker * math.cos(angle))


def _least(
    length: Callable[[Sequence[float]], float], q: Sequence[float], column: int, ends: tuple[float, float]
) -> list[float]:
    """The joint angles with one of them moved to where a length is least, by ternary search."""

    def moved(angle: float) -> list[float]:
        return [*q[:column], angle, *q[column + 1 :]]

    low, high = ends
    for _ in range(_SECTIONS):
        third = (high - low) / 3
        shorter_below = length(moved(low + third)) < length(moved(high - third))
        low, high = (low, high - third) if shorter_below else (low + third, high)
    return min((moved(angle) for angle in (q[column], (low + high) / 2, *ends)), key=length)
