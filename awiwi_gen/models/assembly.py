"""A finger prepared for recursion: every number in the axes where it costs least.

Three choices make the recursions short.

*Axes that turn late.* Consecutive joints about one axis add their angles, so all of them are described in the axes of the link that
carries them; vectors are rotated only where the axis changes direction.

*Mass moments.* A body is m, h = integral of r dm and S = integral of r r' dm about its joint. They are linear in the mass distribution, so
composite bodies are sums, and the inertia tensor is trace(S) 1 - S.

*Mass moved towards the palm.* What lies on a joint's axis does not notice the joint turning: m, h_z and S_zz go to the body
before. They keep all energies, so they keep the dynamics, and three of ten numbers per link become zero.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.models.tree import Finger, coordinates, leaders, quarter_turns, radius


@dataclass
class Moments:
    """Mass moments of a body: m [kg], h (3) [kg m], S (3 x 3) [kg m^2] and its trace, which no rotation changes."""

    mass: SX
    first: SX
    second: SX
    trace: SX

    def __add__(self, other: "Moments") -> "Moments":
        return Moments(self.mass + other.mass, self.first + other.first, self.second + other.second, self.trace + other.trace)

    def moved(self, by: SX) -> "Moments":
        """The same body about a point from which its old reference point lies at `by`."""
        mixed, squared = self.first @ by.T, self.mass * by @ by.T
        return Moments(self.mass, self.first + self.mass * by, self.second + mixed + mixed.T + squared,
                       self.trace + 2 * ca.trace(mixed) + ca.trace(squared))

    def turned(self, rotation: SX) -> "Moments":
        """The same body in other axes."""
        return Moments(self.mass, rotation @ self.first, rotation @ self.second @ rotation.T, self.trace)

    def inertia(self, spin: SX) -> SX:
        """Angular momentum (3) [kg m^2] about the reference point, per unit of `spin`."""
        return self.trace * spin - self.second @ spin


@dataclass
class Joint:
    """One joint of the chain and the body it moves, in the body's working axes.

    The chain angle changes with its coordinate at the rate `rate`, which itself changes at `bend`. Working axes before and after the
    joint are the same unless the next joint is about another axis: then they turn with the joint (by `spin`, its cosine and sine), and
    by the fixed `turn` of the next.
    """

    coordinate: int
    rate: SX
    bend: SX
    spin: tuple[SX, SX]
    turn: SX | None
    axis: SX
    offset: SX
    body: Moments
    rotation: SX
    link: int | None

    def forth(self, vector: SX) -> SX:
        """From the axes before the joint into its body's working axes."""
        return vector if self.turn is None else self.turn.T @ (about_z(*self.spin).T @ vector)

    def back(self, vector: SX) -> SX:
        """From the body's working axes into the axes before the joint."""
        return vector if self.turn is None else about_z(*self.spin) @ (self.turn @ vector)

    def body_back(self, body: Moments) -> Moments:
        """`back`, for the moments of a body."""
        return body if self.turn is None else _turned_about_z(body.turned(self.turn), *self.spin)


@dataclass
class Assembly:
    """A finger's chain of joints, base to tip. `turn` rotates base vectors into the first working axes, `ballast` is the first
    moment (3) [kg m] of what the finger's mass leaves in the palm (of use only for the potential energy)."""

    turn: SX
    joints: list[Joint]
    ballast: SX


@dataclass
class _Part:
    """One joint of the chain as given: the fixed `turn` before it, then either a turn by `angle` about z, or `direction`, the cosine and
    sine of the body's turn since the working axes."""

    coordinate: int
    turn: SX | None
    angle: SX | None
    direction: tuple[SX, SX] | None
    rate: SX
    bend: SX
    offset: SX
    body: Moments
    link: int | None


def assemble(finger: Finger, q: SX) -> Assembly:
    """All that the recursions need at joint angles q (n) [rad]."""
    parts = list(_parts(finger, q))
    ballast = _move_towards_palm(parts)
    joints: list[Joint] = []
    base, angle = (SX(1), SX(0)), SX(0)
    for part, following in zip(parts, [*parts[1:], None]):
        if part.turn is not None:
            base, angle = (SX(1), SX(0)), SX(0)
        if part.direction is not None:
            base, angle = part.direction, SX(0)
        else:
            angle = angle + part.angle
        spin = _sum_of_angles(base, (ca.cos(angle), ca.sin(angle)))
        turn = None if following is None else following.turn
        if turn is None:
            rotation, axis, body = about_z(*spin), SX([0, 0, 1]), _turned_about_z(part.body, *spin)
        else:
            rotation, axis, body = turn.T, turn.T @ SX([0, 0, 1]), part.body.turned(turn.T)
        joints.append(Joint(part.coordinate, part.rate, part.bend, spin, turn, axis, rotation @ part.offset, body, rotation,
                            part.link))
    first = parts[0].turn
    return Assembly(SX.eye(3) if first is None else first.T, joints, ballast)


def about_z(c: SX, s: SX) -> SX:
    """Rotation (3 x 3) about z."""
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def _parts(finger: Finger, q: SX) -> Iterator[_Part]:
    position, follows = coordinates(finger), leaders(finger)
    for index, link in enumerate(finger.links):
        coordinate = position[link.joint]
        own, turn = q[coordinate], _turn(link.turn)
        offset = ca.vertcat(*link.offset)
        if link.four_bar is not None:
            reference = SX(link.four_bar.reference)
            loop, at_rest = _FourBar(link.four_bar, own + reference), _FourBar(link.four_bar, reference)
            crank = ca.vertcat(link.four_bar.crank, 0, 0)
            yield _Part(coordinate, turn, own + reference, None, SX(1), SX(0), crank, nothing(), None)
            turned = _sum_of_angles(loop.direction, (at_rest.direction[0], -at_rest.direction[1]))
            yield _Part(coordinate, None, None, turned, loop.rate - 1, loop.bend, offset, _body(link), index)
        else:
            ratio = SX(1)
            if link.joint in follows:
                ratio = SX(radius(finger, follows[link.joint])) / radius(finger, link.joint)
            yield _Part(coordinate, turn, ratio * own, None, ratio, SX(0), offset, _body(link), index)


class _FourBar:
    """A four-bar as vectors in its plane: no angles, no inverse functions.

    Crank a, coupler b and rocker d close the loop a + b = ground + d. Coupler and rocker stand over the diagonal from the end of the
    crank to the rocker's pivot; `area` is twice that of their triangle, positive if the coupler lies to the right.
    """

    def __init__(self, bar: Finger, crank: SX) -> None:
        a = (bar.crank * ca.cos(crank), bar.crank * ca.sin(crank))
        diagonal = (bar.ground - a[0], -a[1])
        squared = bar.ground**2 + bar.crank**2 - 2 * bar.ground * a[0]
        along = (squared + bar.coupler**2 - bar.rocker**2) / 2
        area = bar.branch * ca.sqrt(bar.coupler**2 * squared - along**2)
        b = ((along * diagonal[0] + area * diagonal[1]) / squared, (along * diagonal[1] - area * diagonal[0]) / squared)
        self.direction = (b[0] / bar.coupler, b[1] / bar.coupler)
        """Cosine and sine of the coupler's angle."""
        # The velocity of the loop, a x' + b x' t3' = d x' t4' where x' turns by a quarter, taken along d and along b.
        coupler_crank = a[0] * b[1] - a[1] * b[0]
        rocker_rate = coupler_crank / area
        self.rate = (coupler_crank + bar.ground * a[1]) / area
        """Turn of the coupler per turn of the crank."""
        crank_rocker = a[0] * (b[0] - diagonal[0]) + a[1] * (b[1] - diagonal[1])
        centripetal = crank_rocker + (bar.coupler**2 - along) * self.rate**2 - (bar.rocker * rocker_rate) ** 2
        self.bend = -centripetal / area
        """Change of `rate` per turn of the crank."""


def nothing() -> Moments:
    return Moments(SX(0), SX.zeros(3), SX.zeros(3, 3), SX(0))


def _body(link: Finger) -> Moments:
    """A link's mass moments about its joint, in its own axes."""
    i, centre = link.inertia, ca.vertcat(*link.com)
    tensor = ca.vertcat(ca.horzcat(i.xx, i.xy, i.xz), ca.horzcat(i.xy, i.yy, i.yz), ca.horzcat(i.xz, i.yz, i.zz))
    second = ca.trace(tensor) / 2 * SX.eye(3) - tensor
    return Moments(SX(link.mass), SX.zeros(3), second, ca.trace(second)).moved(centre)


def _move_towards_palm(parts: list[_Part]) -> SX:
    """Move what lies on each joint's axis to the body before; returns the first moment the palm receives, in base axes."""
    for part, previous in reversed(list(zip(parts, [None, *parts[:-1]]))):
        turn = SX.eye(3) if part.turn is None else part.turn
        body = part.body
        on_axis = Moments(body.mass, SX.zeros(3), SX.zeros(3, 3), body.second[2, 2])
        on_axis.first[2], on_axis.second[2, 2] = body.first[2], body.second[2, 2]
        part.body = Moments(SX(0), SX(body.first), SX(body.second), body.second[0, 0] + body.second[1, 1])
        part.body.first[2] = part.body.second[2, 2] = 0
        on_axis = on_axis.turned(turn)
        if previous is not None:
            previous.body = previous.body + on_axis.moved(previous.offset)
    return on_axis.first


def _turned_about_z(body: Moments, c: SX, s: SX) -> Moments:
    """`body.turned` for a rotation about z, with the double angle factored: 8 products instead of 16 for the second moments."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = ([body.second[i, j] for j in range(3)] for i in range(3))
    swing = (xx - yy) * c - 2 * xy * s
    xx, yy, xy = yy + c * swing, xx - c * swing, xy + s * swing
    xz, yz = c * xz - s * yz, s * xz + c * yz
    second = ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))
    x, y, z = ca.vertsplit(body.first)
    return Moments(body.mass, ca.vertcat(c * x - s * y, s * x + c * y, z), second, body.trace)


def _sum_of_angles(one: tuple[SX, SX], other: tuple[SX, SX]) -> tuple[SX, SX]:
    """Cosine and sine of a sum, from those of its terms."""
    return one[0] * other[0] - one[1] * other[1], one[1] * other[0] + one[0] * other[1]


def _turn(turn: str) -> SX | None:
    """The fixed rotation before a joint, body to base: a signed permutation."""
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
