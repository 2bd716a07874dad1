"""A finger prepared for recursion: every number in the axes where it costs least.

*Axes that turn late.* Consecutive joints about one axis add their angles, so their bodies are described in common
working axes, those in which the first of them turns. Vectors are rotated only where the axis changes direction.

*Mass moments.* A body is m, h = integral of r dm and S = integral of r r' dm about its joint. They are linear in the
mass distribution, so composite bodies are sums; the inertia tensor is trace(S) 1 - S.

*Joints that slide.* A joint's place on its axis is free, so it is put where the offset from the joint before has no
component along the axis. Offsets between parallel joints become planar.

*Mass moved towards the palm.* What lies on a joint's axis does not notice the joint turning, so m, h_z and S_zz are
given to the body before: the energies stay the same, hence the dynamics. Three of ten numbers per link become zero, and
so does the mass of every composite body.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.models.linkage import FourBar, Vector
from awiwi_gen.models.tree import Finger, coordinates, leaders, quarter_turns, radius

_ZERO, _Z = SX(0), SX([0, 0, 1])


@dataclass(frozen=True)
class Moments:
    """Mass moments of a body: m [kg], h (3) [kg m], S (3 x 3) [kg m^2], and the trace of S, which rotations keep."""

    mass: SX
    first: SX
    second: SX
    trace: SX

    @classmethod
    def none(cls) -> "Moments":
        """No body."""
        return cls(SX(0), SX.zeros(3), SX.zeros(3, 3), SX(0))

    def __add__(self, other: "Moments") -> "Moments":
        return Moments(
            self.mass + other.mass, self.first + other.first, self.second + other.second, self.trace + other.trace
        )

    def moved(self, by: SX) -> "Moments":
        """The same body about a point from which the old reference point lies at `by` (3) [m]."""
        mixed, squared = self.first @ by.T, self.mass * by @ by.T
        return Moments(
            self.mass,
            self.first + self.mass * by,
            self.second + mixed + mixed.T + squared,
            self.trace + 2 * ca.trace(mixed) + ca.trace(squared),
        )

    def turned(self, rotation: SX) -> "Moments":
        """The same body in other axes."""
        return Moments(self.mass, rotation @ self.first, rotation @ self.second @ rotation.T, self.trace)

    def turned_about_z(self, c: SX, s: SX) -> "Moments":
        """`turned` by the angle with this cosine and sine: 8 products for S, by the double angle, instead of 24."""
        x, y, z = ca.vertsplit(self.first)
        xx, xy, xz, yy, yz, zz = (self.second[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
        swing = (xx - yy) * c - 2 * xy * s
        first = (c * x - s * y, s * x + c * y, z)
        second = _symmetric(yy + c * swing, xx - c * swing, zz, xy + s * swing, c * xz - s * yz, s * xz + c * yz)
        return Moments(self.mass, ca.vertcat(*first), second, self.trace)

    def split(self) -> tuple["Moments", "Moments"]:
        """What does not notice a turn about z, as mass on the z axis, and the rest."""
        z = SX.zeros(3, 3)
        z[2, 2] = 1
        axis = Moments(self.mass, z @ self.first, z @ self.second @ z, self.second[2, 2])
        first, second = SX(self.first), SX(self.second)
        first[2] = second[2, 2] = 0
        return axis, Moments(SX(0), first, second, second[0, 0] + second[1, 1])

    def inertia(self, axis: SX) -> SX:
        """Angular momentum (3) about the reference point per angular velocity along `axis` (3) [kg m^2]."""
        return self.trace * axis - self.second @ axis


@dataclass(frozen=True)
class Joint:
    """One joint of the chain and the body it moves, in the body's working axes.

    The chain angle changes with coordinate number `coordinate` at `rate`, which itself changes at `bend`. Where the
    next joint turns about another axis, the working axes turn with this joint, by the angle with cosine and sine
    `spin`, and then by the `turn` (3 x 3) of the next; otherwise they are those before the joint, and `turn` is
    None. In them, `axis` (3) is the joint's, `offset` (3) [m] leads to the next joint, and `rotation` (3 x 3) takes
    the body's own axes to them; in its own, these are `own_offset` and `own_body`. The body is link number `link`, or
    its crank. Its frame lies on the axis, `slid` [m] beyond the joint.
    """

    coordinate: int
    rate: SX
    bend: SX
    spin: Vector
    turn: SX | None
    axis: SX
    offset: SX
    body: Moments
    rotation: SX
    link: int
    slid: SX
    own_offset: SX
    own_body: Moments

    def forth(self, vectors: SX) -> SX:
        """Vectors (columns) in the axes before the joint, in working axes."""
        return vectors if self.turn is None else self.turn.T @ (_about_z(self.spin).T @ vectors)

    def back(self, vectors: SX) -> SX:
        """Vectors (columns) in working axes, in the axes before the joint."""
        return vectors if self.turn is None else _about_z(self.spin) @ (self.turn @ vectors)

    def body_back(self, body: Moments) -> Moments:
        """A body in working axes, in the axes before the joint."""
        return body if self.turn is None else body.turned(self.turn).turned_about_z(*self.spin)


@dataclass(frozen=True)
class Assembly:
    """The joints of a finger's chain, base to tip.

    `turn` (3 x 3) takes base vectors to the axes before the first joint. `ballast` (3) [kg m], in base axes, is the
    first moment of the mass that was moved into the palm.
    """

    turn: SX
    joints: list[Joint]
    ballast: SX

    def axes(self) -> list[SX]:
        """Rotations (3 x 3) from each joint's working axes to the base."""
        axes = [self.turn.T]
        for joint in self.joints:
            axes.append(joint.forth(axes[-1].T).T)
        return axes[1:]

    def base_point(self, count: int, point: SX) -> SX:
        """Base coordinates (3) [m] of a point (3) given from the end of the first `count` joints, in working axes."""
        for joint in reversed(self.joints[:count]):
            point = joint.back(joint.offset + point)
        return self.turn.T @ point


@dataclass(frozen=True)
class _Part:
    """A joint of the chain as the file gives it: a fixed turn, then a turn about z.

    The latter is `angle`, or for the coupler of a four-bar the angle with cosine and sine `direction`, from the
    turned frame.
    """

    coordinate: int
    turn: SX | None
    angle: SX
    direction: Vector | None
    rate: SX
    bend: SX
    offset: SX
    body: Moments
    link: int
    slid: SX = _ZERO


def assemble(finger: Finger, q: SX) -> Assembly:
    """All that recursions need at joint angles q (n) [rad]."""
    parts = list(_slid(list(_parts(finger, q))))
    bodies, ballast = _lightened(parts)
    joints: list[Joint] = []
    start, angle = (SX(1), SX(0)), SX(0)
    before: Vector = start
    for part, body, following in zip(parts, bodies, [*parts[1:], None], strict=True):
        if part.turn is not None:
            start, angle = (SX(1), SX(0)), SX(0)
        if following is not None and following.direction is not None:  # a crank: its coupler starts from here
            before = _sum_of_angles(start, (ca.cos(angle), ca.sin(angle)))
        angle += part.angle
        if part.direction is not None:
            start, angle = _sum_of_angles(before, part.direction), SX(0)
        spin = _sum_of_angles(start, (ca.cos(angle), ca.sin(angle)))
        turn = following.turn if following is not None else None
        place = (part.link, part.slid, part.offset, body)
        if turn is None:
            rotation, axis, body = _about_z(spin), _Z, body.turned_about_z(*spin)
        else:
            rotation, axis, body = turn.T, turn.T @ _Z, body.turned(turn.T)
        offset = rotation @ part.offset
        joints.append(Joint(part.coordinate, part.rate, part.bend, spin, turn, axis, offset, body, rotation, *place))
    first = parts[0].turn
    return Assembly(SX.eye(3) if first is None else first.T, joints, ballast)


def _parts(finger: Finger, q: SX) -> Iterator[_Part]:
    position, follows = coordinates(finger), leaders(finger)
    for index, link in enumerate(finger.links):
        coordinate = position[link.joint]
        own, turn, offset, body = q[coordinate], _turn(link.turn), ca.vertcat(*link.offset), _body(link)
        if link.four_bar is None:
            ratio = SX(1)
            if link.joint in follows:
                ratio = SX(radius(finger, follows[link.joint])) / radius(finger, link.joint)
            yield _Part(coordinate, turn, ratio * own, None, ratio, SX(0), offset, body, index)
        else:
            crank = own + link.four_bar.reference
            start = SX(link.start + link.four_bar.reference)
            now, (c, s) = FourBar(link.four_bar, crank), FourBar(link.four_bar, start).coupler
            arm = ca.vertcat(link.four_bar.crank, 0, 0)
            yield _Part(coordinate, turn, crank, None, SX(1), SX(0), arm, Moments.none(), index)
            turned = _sum_of_angles(now.coupler, (c, -s))
            yield _Part(coordinate, None, SX(0), turned, now.rate - 1, now.bend, offset, body, index)


def _slid(parts: Sequence[_Part]) -> Iterator[_Part]:
    """The parts, with each joint moved along its axis to where the offset before it has no component along it."""
    slid = SX(0)
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        offset, body = part.offset + _Z * slid, part.body.moved(_Z * slid)
        own = slid
        if following is not None:
            axis = _Z if following.turn is None else following.turn @ _Z
            slid = ca.dot(axis, offset)
            offset = offset - axis * slid
        yield replace(part, offset=offset, body=body, slid=own)


def _lightened(parts: Sequence[_Part]) -> tuple[list[Moments], SX]:
    """The parts' bodies, each with its mass moved to the body before, and the first moment that arrives in the palm."""
    bodies, moved = [], Moments.none()
    for part, before in zip(reversed(parts), [*reversed(parts[:-1]), None], strict=True):
        moved, rest = (part.body + moved).split()
        bodies.append(rest)
        if part.turn is not None:
            moved = moved.turned(part.turn)
        if before is not None:
            moved = moved.moved(before.offset)
    return bodies[::-1], moved.first


def _body(link: Any) -> Moments:
    """A link's mass moments about its joint, in its own axes."""
    i = link.inertia
    tensor = _symmetric(i.xx, i.yy, i.zz, i.xy, i.xz, i.yz)
    second = ca.trace(tensor) / 2 * SX.eye(3) - tensor
    return Moments(SX(link.mass), SX.zeros(3), second, ca.trace(second)).moved(ca.vertcat(*link.com))


def _symmetric(xx: SX, yy: SX, zz: SX, xy: SX, xz: SX, yz: SX) -> SX:
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def _about_z(spin: Vector) -> SX:
    """Rotation (3 x 3) about z by the angle with this cosine and sine."""
    c, s = spin
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def _sum_of_angles(one: Vector, other: Vector) -> Vector:
    """Cosine and sine of a sum, from those of its terms."""
    return one[0] * other[0] - one[1] * other[1], one[1] * other[0] + one[0] * other[1]


def _turn(turn: str) -> SX | None:
    """The fixed rotation (3 x 3) before a joint, a signed permutation; None for none."""
    axis, quarters = quarter_turns(turn)
    if not quarters:
        return None
    first, second = (axis + 1) % 3, (axis + 2) % 3
    c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarters % 4]
    rotation = SX.zeros(3, 3)
    rotation[axis, axis] = 1
    rotation[first, first] = rotation[second, second] = c
    rotation[second, first], rotation[first, second] = s, -s
    return rotation
