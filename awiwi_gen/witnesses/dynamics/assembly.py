"""A finger prepared for recursion: every number in the axes where it costs least.

*Working axes.* Consecutive joints about one axis add their angles. Their bodies are described in common working axes,
those before the first of these joints. Vectors are rotated only where the axis changes direction.

*Mass moments.* A body is m, h = integral of r dm and S = integral of r r' dm about its joint. They are linear in the
mass distribution, so composite bodies are sums; the inertia tensor is trace(S) 1 - S.

*Joints shifted along their axes.* A joint may sit anywhere on its axis. It is put where the offset from the joint
before has no component along the axis. So offsets between parallel joints become planar.

*Mass moved towards the palm.* A rotation about an axis does not move the mass on that axis. So m, h_z and S_zz of a
body are given to the body before it. The energies stay the same, hence the dynamics. Three of the ten inertial
parameters of a link become zero, and so does the mass of every composite body.

*Slides.* A slide turns nothing and carries its whole body along, so mass stays with it. Its body and its offset are those
about the place where it has not moved yet, and so contain how far it has. What lies beyond is not shifted past it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, coordinates, fixed_turns
from awiwi_gen.witnesses.four_bar import FourBar, Vector
from awiwi_gen.witnesses.joints import followed

_ZERO, _Z = SX(0), SX([0, 0, 1])


@dataclass(frozen=True)
class Moments:
    """Mass moments of a body: m [kg], h (3) [kg m], S (3 x 3) [kg m^2], and the trace of S, constant under rotations."""

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

    def rotated(self, rotation: SX) -> "Moments":
        """The same body in other axes."""
        return Moments(self.mass, rotation @ self.first, rotation @ self.second @ rotation.T, self.trace)

    def rotated_about_z(self, c: SX, s: SX) -> "Moments":
        """`rotated` by the angle with this cosine and sine: 8 products for S, by the double angle, instead of 24."""
        x, y, z = ca.vertsplit(self.first)
        xx, xy, xz, yy, yz, zz = (self.second[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
        difference = (xx - yy) * c - 2 * xy * s
        first = (c * x - s * y, s * x + c * y, z)
        second = _symmetric(
            yy + c * difference, xx - c * difference, zz, xy + s * difference, c * xz - s * yz, s * xz + c * yz
        )
        return Moments(self.mass, ca.vertcat(*first), second, self.trace)

    def turned(self, turn: "Turn") -> "Moments":
        """`rotated` about one axis: a quarter turn costs nothing, another one as much as about z."""
        if all(entry.is_constant() for entry in turn.cos_sin):
            return self.rotated(turn.matrix())
        to_z = turn.permutation()
        return self.rotated(to_z).rotated_about_z(*turn.cos_sin).rotated(to_z.T)

    def split(self) -> tuple["Moments", "Moments"]:
        """The part that a rotation about z does not change, as mass on the z axis, and the rest."""
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
class Turn:
    """A fixed rotation about coordinate axis number `axis`: so many quarter turns, or by an angle if that is None."""

    axis: int
    quarters: int | None
    angle: Any

    @property
    def cos_sin(self) -> Vector:
        """Cosine and sine of its angle; exact for quarter turns."""
        if self.quarters is None:
            return ca.cos(self.angle), ca.sin(self.angle)
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][self.quarters % 4]
        return SX(c), SX(s)

    def permutation(self) -> SX:
        """The rotation (3 x 3) that makes its axis the z axis: a cyclic permutation."""
        return SX.eye(3)[[(self.axis + 1 + k) % 3 for k in range(3)], :]

    def matrix(self) -> SX:
        """The rotation (3 x 3)."""
        to_z = self.permutation()
        return ca.densify(to_z.T @ about_z(self.cos_sin) @ to_z)


def turns_of(link: Any) -> tuple[list[Turn], Any]:
    """The fixed rotations of a link in front of its joint, in order, and an angle [rad] that its joint's angle takes up.

    Any rotation is one about z, one about x and one about z. The last one is the joint's, so a rotation about several
    axes costs as much as one about x: the first is taken up by the joint before (`assemble`).
    """
    turns = [Turn(*step) for step in fixed_turns(link)]
    if link.four_bar is not None:  # its coupler starts where the crank's angle is not zero
        return turns, 0
    if sum(turn.quarters is None for turn in turns) > 1:
        rotation = _product(turns)
        across = ca.sqrt(rotation[0, 2] ** 2 + rotation[1, 2] ** 2)
        first, last = _turn(2, rotation[0, 2], -rotation[1, 2]), _turn(2, rotation[2, 0], rotation[2, 1])
        # Across is never negative: axes at right angles are a quarter turn apart, whatever the other numbers are.
        lean = Turn(0, 1, None) if rotation[2, 2].is_zero() else _turn(0, across, rotation[2, 2])
        both = [first, lean]
        return (both, last.angle) if last.quarters is None else ([*both, last], 0)
    if turns and turns[-1].axis == 2 and turns[-1].quarters is None:
        return turns[:-1], turns[-1].angle
    return turns, 0


def _turn(axis: int, y: SX, x: SX) -> Turn:
    """The rotation by atan2(y, x). Numbers come from quarter turns, and stay such: CasADi would round the angle."""
    if y.is_constant() and x.is_constant():
        return Turn(axis, [(0, 1), (1, 0), (0, -1), (-1, 0)].index((int(y), int(x))), None)
    return Turn(axis, None, ca.atan2(y, x))


def _product(turns: Sequence[Turn]) -> SX:
    product = SX.eye(3)
    for turn in turns:
        product = product @ turn.matrix()
    return product


@dataclass(frozen=True)
class Joint:
    """One joint of the chain and the body it moves, in the body's working axes.

    The joint's angle, or the travel of one that `slides`, is a function of coordinate number `coordinate`, with the
    derivative `ratio` and the second derivative `ratio_derivative`. If the next joint has another axis, the working axes
    rotate with this joint, by the angle with cosine and sine `cos_sin`, and then by `next_rotation` (3 x 3), the fixed
    rotation of the next joint, which is the product of `next_turns`. A first turn about z is part of `cos_sin` instead.
    Otherwise they are the axes before the joint, and `next_rotation` is None.

    In working axes, `axis` (3) is the joint's axis, `offset` (3) [m] leads to the next joint, and `rotation` (3 x 3)
    takes the link's own axes to the working axes. `link_body` is the body in the link's own axes, and so is the offset,
    `link_offset`, if the next joint is parallel. The body is link number `link`, or its crank. The link's frame lies on
    the axis, `shift` [m] beyond the joint and by the `travel` [m] of a slide beyond that.
    """

    coordinate: int
    ratio: SX
    ratio_derivative: SX
    cos_sin: Vector
    next_rotation: SX | None
    next_turns: Sequence[Turn]
    axis: SX
    offset: SX
    body: Moments
    rotation: SX
    link: int
    shift: SX
    slides: bool
    travel: SX
    link_offset: SX
    link_body: Moments

    def point_velocity(self, lever: SX) -> SX:
        """Velocity (3) of a point at `lever` (3) [m] from the joint, per unit rate of the joint."""
        return self.axis if self.slides else ca.cross(self.axis, lever)

    def power(self, force: SX, moment: SX) -> SX:
        """Power of a force (3) and of a moment (3) about the joint, per unit rate of the joint."""
        return ca.dot(self.axis, force if self.slides else moment)

    def outward(self, vectors: SX) -> SX:
        """Vectors (columns) of the axes before the joint, in working axes."""
        return vectors if self.next_rotation is None else self.next_rotation.T @ (about_z(self.cos_sin).T @ vectors)

    def inward(self, vectors: SX) -> SX:
        """Vectors (columns) of the working axes, in the axes before the joint."""
        return vectors if self.next_rotation is None else about_z(self.cos_sin) @ (self.next_rotation @ vectors)

    def body_inward(self, body: Moments) -> Moments:
        """A body of the working axes, in the axes before the joint."""
        if self.next_rotation is None:
            return body
        for turn in reversed(self.next_turns):
            body = body.turned(turn)
        return body.rotated_about_z(*self.cos_sin)


@dataclass(frozen=True)
class Assembly:
    """The joints of a finger's chain, base to tip.

    `base_rotation` (3 x 3) takes base vectors to the axes before the first joint. `palm_moment` (3) [kg m], in base
    axes, is the first moment of the mass that was moved into the palm.
    """

    base_rotation: SX
    joints: list[Joint]
    palm_moment: SX

    def axes(self) -> list[SX]:
        """Rotations (3 x 3) from each joint's working axes to the base."""
        axes = [self.base_rotation.T]
        for joint in self.joints:
            axes.append(joint.outward(axes[-1].T).T)
        return axes[1:]

    def base_point(self, count: int, point: SX) -> SX:
        """Base coordinates (3) [m] of a point (3) given from the end of the first `count` joints, in working axes."""
        for joint in reversed(self.joints[:count]):
            point = joint.inward(joint.offset + point)
        return self.base_rotation.T @ point


@dataclass(frozen=True)
class Part:
    """A joint of the chain as the hand file gives it: its fixed rotations, then a rotation about z or a `travel` along it.

    The angle about z is `angle`, or for the coupler of a four-bar the angle with cosine and sine `cos_sin`. `offset` leads
    to the next joint, in the link's axes, or once joints are shifted in those in front of the next joint.
    """

    coordinate: int
    turns: Sequence[Turn]
    angle: SX
    cos_sin: Vector | None
    ratio: SX
    ratio_derivative: SX
    offset: SX
    body: Moments
    link: int
    shift: SX = _ZERO
    slides: bool = False
    travel: SX = _ZERO

    @property
    def fixed_rotation(self) -> SX | None:
        """The fixed rotation (3 x 3); None if there is none."""
        return fixed_rotation(self.turns)


def assemble(finger: Finger, q: SX) -> Assembly:
    """All that recursions need at joint angles q (n) [rad], or [m] of slides."""
    parts = list(_shifted(list(parts_of(finger, q))))
    bodies, palm_moment = _masses_moved_inward(parts)
    joints: list[Joint] = []
    start, angle = (SX(1), SX(0)), SX(0)
    before_crank: Vector = start
    for part, body, following in zip(parts, bodies, [*parts[1:], None], strict=True):
        if part.fixed_rotation is not None:
            start, angle = (SX(1), SX(0)), SX(0)
        if following is not None and following.cos_sin is not None:  # a crank: its coupler starts from here
            before_crank = sum_of_angles(start, (ca.cos(angle), ca.sin(angle)))
        angle += part.angle
        if part.cos_sin is not None:
            start, angle = sum_of_angles(before_crank, part.cos_sin), SX(0)
        next_turns = following.turns if following is not None else []
        to_next, taken = fixed_rotation(next_turns), SX(0)
        if len(next_turns) > 1 and next_turns[0].axis == 2 and next_turns[0].quarters is None:
            taken, next_turns = next_turns[0].angle, next_turns[1:]
        cos_sin = sum_of_angles(start, (ca.cos(angle + taken), ca.sin(angle + taken)))
        in_link = (part.link, part.shift, part.slides, part.travel, part.offset, body)
        if to_next is None:
            next_rotation, rotation, axis, body = None, about_z(cos_sin), _Z, body.rotated_about_z(*cos_sin)
        else:
            next_rotation, rotation, axis, body = (
                _product(next_turns),
                to_next.T,
                to_next.T @ _Z,
                body.rotated(to_next.T),
            )
        offset = part.offset if to_next is not None else rotation @ part.offset
        how = (part.coordinate, part.ratio, part.ratio_derivative, cos_sin, next_rotation, next_turns)
        joints.append(Joint(*how, axis, offset, body, rotation, *in_link))
    first = parts[0].fixed_rotation
    return Assembly(SX.eye(3) if first is None else first.T, joints, palm_moment)


def parts_of(finger: Finger, q: SX) -> Iterator[Part]:
    """The joints of a finger's chain, base to tip, at joint angles q (n) [rad], or [m] of slides: as in the hand file."""
    position = coordinates(finger)
    for index, link in enumerate(finger.links):
        coordinate = position[link.joint]
        angle, offset, body = q[coordinate], ca.vertcat(*link.offset), _body(link)
        turns, yaw = turns_of(link)
        if link.four_bar is None:
            own, ratio, change = followed(finger, link.joint, angle)
            moved = own if link.reference is None else own - link.reference
            angle, travel = (SX(yaw), moved) if link.slides else (moved + yaw, _ZERO)
            yield Part(
                coordinate, turns, angle, None, ratio, change, offset, body, index, slides=link.slides, travel=travel
            )
        else:
            crank = angle + link.four_bar.reference
            start = SX(link.start + link.four_bar.reference)
            now, (c, s) = FourBar(link.four_bar, crank), FourBar(link.four_bar, start).coupler
            arm = ca.vertcat(link.four_bar.crank, 0, 0)
            yield Part(coordinate, turns, crank, None, SX(1), SX(0), arm, Moments.none(), index)
            relative = sum_of_angles(now.coupler, (c, -s))
            yield Part(coordinate, [], SX(0), relative, now.ratio - 1, now.ratio_derivative, offset, body, index)


def _shifted(parts: Sequence[Part]) -> Iterator[Part]:
    """The parts, each joint shifted along its axis to where the offset before it has no component along that axis."""
    shift = SX(0)
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        along = _Z * (shift + part.travel)
        offset, body = part.offset + along, part.body.moved(along)
        before, shift = shift, SX(0)
        if following is not None:
            if following.fixed_rotation is not None:
                offset = following.fixed_rotation.T @ offset
            if not part.slides:
                shift, offset = offset[2], ca.vertcat(offset[:2], 0)
        yield replace(part, offset=offset, body=body, shift=before)


def _masses_moved_inward(parts: Sequence[Part]) -> tuple[list[Moments], SX]:
    """The parts' bodies, each with its mass moved to the body before, and the first moment moved into the palm."""
    bodies, moved = [], Moments.none()
    for part, before in zip(reversed(parts), [*reversed(parts[:-1]), None], strict=True):
        whole = part.body + moved
        moved, rest = (Moments.none(), whole) if part.slides else whole.split()
        bodies.append(rest)
        if before is not None:
            moved = moved.moved(before.offset)
        if part.fixed_rotation is not None:
            moved = moved.rotated(part.fixed_rotation)
    return bodies[::-1], moved.first


def _body(link: Any) -> Moments:
    """A link's mass moments about its joint, in its own axes."""
    if link.mass is None:
        return Moments.none()
    i = link.inertia
    tensor = _symmetric(i.xx, i.yy, i.zz, i.xy, i.xz, i.yz)
    second = ca.trace(tensor) / 2 * SX.eye(3) - tensor
    return Moments(SX(link.mass), SX.zeros(3), second, ca.trace(second)).moved(ca.vertcat(*link.com))


def _symmetric(xx: SX, yy: SX, zz: SX, xy: SX, xz: SX, yz: SX) -> SX:
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def about_z(cos_sin: Vector) -> SX:
    """Rotation (3 x 3) about z by the angle with this cosine and sine."""
    c, s = cos_sin
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def sum_of_angles(one: Vector, other: Vector) -> Vector:
    """Cosine and sine of a sum, from those of its terms."""
    return one[0] * other[0] - one[1] * other[1], one[1] * other[0] + one[0] * other[1]


def fixed_rotation(turns: Sequence[Turn]) -> SX | None:
    """The product (3 x 3) of fixed rotations; None if it is no rotation."""
    product = _product(turns)
    return None if ca.sparsify(product).is_eye() else product
