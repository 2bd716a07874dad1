"""A finger's pose and tendons in plain floats: what the checks of a hand file need before anything is derived.

Frames are those of the definition of the kinematics: offset, fixed rotation, rotation about z (eq. 5.2, 5.3); a four-bar
is a crank of angle q + reference and a coupler. Everything is a function of the n independent joint angles q [rad].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from awiwi_gen.hand.parts import Finger, FourBar, Link

__all__ = ["Chain", "point"]

Vector = tuple[float, float, float]
Axes = tuple[Vector, Vector, Vector]  # unit vectors of a frame, in base axes
Frame = tuple[Axes, Vector]  # with its origin

_SAMPLES = 24
# Their square roots spread samples evenly over up to 32 joints.
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103, 107,
           109, 113, 127, 131)  # fmt: skip
_STEP = 1e-5  # rad, of central differences: errors of 1e-10 relative
_SWEEPS, _SECTIONS = 3, 24  # of a search for the shortest length, joint by joint
_SHORTENING = 0.5  # a length that falls below this share of its mean is searched for zero


class Chain:
    """One finger, as functions of its joint angles."""

    def __init__(self, finger: Finger) -> None:
        self.finger = finger
        self.joints = finger.joints
        free = [link for link in finger.links if link.joint in finger.joints]
        self.low = [float(link.low or 0) for link in free]
        self.high = [float(link.high or 0) for link in free]
        radii = {joint: float(radius) for joint, radius in finger.radii.items()}
        self._angles = []  # of every link: column in q, and its angle per angle in that column
        for link in finger.links:
            leader = finger.leaders.get(link.joint, link.joint)
            factor = radii[leader] / radii[link.joint] if leader != link.joint else 1.0
            self._angles.append((self.joints.index(leader), factor))
        self._links = [
            (_elementary(link), _floats(link.offset), float(link.reference or 0), float(link.start), link.four_bar)
            for link in finger.links
        ]
        self._order = {link.joint: index for index, link in enumerate(finger.links)}
        self._radii = radii
        self._spans = [
            (self._order[tendon.span.joint], _floats(tendon.span.from_), _floats(tendon.span.to))
            if tendon.span
            else None
            for tendon in finger.tendons
        ]

    def poses(self) -> list[list[float]]:
        """Joint angles spread over the range: the middle, both ends, and an even sequence between them [rad]."""
        shares = [[0.5] * len(self.joints), [0.0] * len(self.joints), [1.0] * len(self.joints)]
        shares += [[i * math.sqrt(prime) % 1.0 for prime in _PRIMES[: len(self.joints)]] for i in range(1, _SAMPLES)]
        return [[a + (b - a) * x for a, b, x in zip(self.low, self.high, each, strict=True)] for each in shares]

    def couplings(self) -> Iterator[list[list[float]]]:
        """The coupling in all `poses`; once if there are no spans, for pulleys have the same arms everywhere."""
        yield from map(self.coupling, self.poses() if any(self._spans) else self.poses()[:1])

    def coupling(self, q: Sequence[float]) -> list[list[float]]:
        """P = dh/dq (m x n) [m/rad]: senses times radii, and central differences of the spans' lengths."""
        rows = []
        for tendon, span in zip(self.finger.tendons, self._spans, strict=True):
            row = [0.0] * len(self.joints)
            for name in tendon.over:
                column, factor = self._angles[self._order[name[1:]]]
                row[column] += math.copysign(self._radii[name[1:]] * factor, 1.0 if name[0] == "+" else -1.0)
            if span:
                for column in range(len(row)):
                    ends = [list(q), list(q)]
                    ends[0][column] -= _STEP
                    ends[1][column] += _STEP
                    before, after = (self._distance(end, *span) for end in ends)
                    row[column] += (after - before) / (2 * _STEP)
            rows.append(row)
        return rows

    def shortest(self, tendon: int) -> tuple[float, list[float]]:
        """The shortest length of a tendon's span over the range [m], and the joint angles of it [rad]."""
        span = self._spans[tendon]
        if span is None:
            raise ValueError(f"tendon {tendon} has no span")
        distance = partial(self._distance, seat=span[0], start=span[1], end=span[2])
        found = sorted((distance(q), q) for q in self.poses())
        length, q = found[0]
        if length > _SHORTENING * sum(each for each, _ in found) / len(found):
            return length, q
        for _ in range(_SWEEPS):
            for column, ends in enumerate(zip(self.low, self.high, strict=True)):
                q = _least(distance, q, column, ends)
        return distance(q), q

    def _distance(self, q: Sequence[float], seat: int, start: Vector, end: Vector) -> float:
        """Length of a straight run from a point of the base frame to one before the joint of link `seat` [m]."""
        axes, origin = self._seat(q, seat)
        return math.dist(point(axes, origin, end), start)

    def _seat(self, q: Sequence[float], joint: int) -> Frame:
        """The frame in which a joint rotates: after its fixed rotation, before its own."""
        return next(seat for number, (seat, _) in enumerate(self.frames(q)) if number == joint)

    def frames(self, q: Sequence[float]) -> Iterator[tuple[Frame, Frame]]:
        """Of every link, the frame in which its joint rotates, and its own."""
        axes: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        origin: Vector = (0.0, 0.0, 0.0)
        offset: Vector = (0.0, 0.0, 0.0)
        for (turns, following, drawn, start, bar), (column, factor) in zip(self._links, self._angles, strict=True):
            origin = point(axes, origin, offset)
            for axis, angle in turns:
                axes = _rotated(axes, angle, axis)
            seat, angle = (axes, origin), q[column] * factor
            if bar:
                reference = float(bar.reference)
                origin = point(_rotated(axes, angle + reference), origin, (float(bar.crank), 0.0, 0.0))
                angle = _coupler(bar, angle + reference) - _coupler(bar, start + reference)
            axes, offset = _rotated(axes, angle - drawn), following
            yield seat, (axes, origin)


def _elementary(link: Link) -> list[tuple[int, float]]:
    """The fixed rotations in front of a joint: axis and angle [rad], in order."""
    turn = [] if link.turn == "none" else [("xyz".index(link.turn[0]), math.radians(float(link.turn[1:])))]
    roll, pitch, yaw = link.rpy or (0, 0, 0)
    return [*turn, *((axis, float(angle)) for axis, angle in ((2, yaw), (1, pitch), (0, roll)) if angle)]


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


def _rotated(axes: Axes, angle: float, about: int = 2) -> Axes:
    """The axes after a rotation about one of them."""
    first, second = axes[(about + 1) % 3], axes[(about + 2) % 3]
    c, s = math.cos(angle), math.sin(angle)
    new = list(axes)
    new[(about + 1) % 3] = (c * first[0] + s * second[0], c * first[1] + s * second[1], c * first[2] + s * second[2])
    new[(about + 2) % 3] = (c * second[0] - s * first[0], c * second[1] - s * first[1], c * second[2] - s * first[2])
    return new[0], new[1], new[2]


def _coupler(bar: FourBar, crank: float) -> float:
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
