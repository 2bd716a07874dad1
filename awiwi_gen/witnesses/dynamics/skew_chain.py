"""A finger whose joints' axes are all askew: no two that follow each other are parallel or a quarter turn apart.

Its bodies are those of `assembly`, but in their own axes: behind the rotation about the joint, before the next fixed one.
There the mass moments keep their zeros (m, h_z and S_zz), and the torque is a component of the moment. A fixed rotation
by quarter turns moves such zeros about; any other one fills them, so these chains have axes of their own.

*Axes.* z is the joint's axis and x is normal to the next one as well. So the fixed rotation to the next joint is one
about x, by the `lean`; the rest of it is part of the joints' angles.

*Joints shifted along their axes.* From tip to base, each joint is put where the offset to the next one has no component
along its own axis. So the offset is planar in the axes in which the body is, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, fixed_turns
from awiwi_gen.witnesses.dynamics.assembly import Moments, Part, Turn, about_z, parts_of, sum_of_angles
from awiwi_gen.witnesses.dynamics.newton_euler import inertial_moment
from awiwi_gen.witnesses.four_bar import Vector

_Z = SX([0, 0, 1])


@dataclass(frozen=True)
class Link:
    """One joint of the chain and the body it moves, in the body's own axes.

    `turn` has the cosine and the sine of the joint's angle, `lean` those of the angle of its axis to the one before.
    `offset` (3) [m] leads to the next joint; like `body`'s first moment it has no z component.
    """

    turn: Vector
    lean: Vector
    offset: SX
    body: Moments

    @property
    def _leaning_turn(self) -> Vector:
        """Cosine and sine of the joint's angle, times the cosine of the lean: computed once for all vectors."""
        return self.turn[0] * self.lean[0], self.turn[1] * self.lean[0]

    def outward(self, vector: SX) -> SX:
        """A vector (3) of the link before, in the link's axes: 7 products, as y is divided by the cosine of the lean."""
        (c, s), (cy, sy), (c_lean, s_lean) = self.turn, self._leaning_turn, self.lean
        x, y, z = ca.vertsplit(vector)
        scaled = y + s_lean / c_lean * z
        return ca.vertcat(c * x + sy * scaled, cy * scaled - s * x, c_lean * z - s_lean * y)

    def inward(self, vector: SX) -> SX:
        """A vector (3) of the link's axes, in those of the link before: 7 products likewise."""
        (c, s), (cy, sy), (c_lean, s_lean) = self.turn, self._leaning_turn, self.lean
        x, y, z = ca.vertsplit(vector)
        scaled = sy * x + cy * y
        return ca.vertcat(c * x - s * y, scaled - s_lean * z, s_lean / c_lean * scaled + c_lean * z)

    def body_inward(self, body: Moments) -> Moments:
        """A body of the link's axes, in those of the link before."""
        to_z = Turn(0, None, None).permutation()
        return body.rotated_about_z(*self.turn).rotated(to_z).rotated_about_z(*self.lean).rotated(to_z.T)


@dataclass(frozen=True)
class SkewChain:
    """The links, base to tip. `base_turns` are the fixed rotations of the first, whose own lean is zero."""

    base_turns: Sequence[Turn]
    links: list[Link]

    def in_first_axes(self, vector: SX) -> SX:
        """A vector (3) of the base, in the axes before the first joint."""
        for turn in self.base_turns:
            vector = turn.matrix().T @ vector
        return vector


def skew_chain(finger: Finger, q: SX) -> SkewChain | None:
    """The finger as such a chain, or None if it is none.

    It is one if it has several joints, each rotates by a coordinate of its own and without a four-bar, and the fixed
    rotation of each but the first is one about x or y by an angle, between rotations about z. Two quarter turns about
    x or y in one fixed rotation are left out: there, numbers alone could put two axes at a right angle, where `outward`
    would divide by zero.
    """
    if len(finger.links) < 2 or finger.couplings or any(link.slides or link.four_bar for link in finger.links):
        return None
    parts = list(parts_of(finger, q))
    leans = [lean for part in parts[1:] if (lean := _Lean.of(part.turns)) is not None]
    if len(leans) < len(parts) - 1 or any(_bent_twice(link) for link in finger.links[1:]):
        return None
    offsets, bodies = _shifted(parts)
    links = []
    before, bodies = _NO_LEAN, _masses_moved_inward(parts, offsets, bodies)
    for part, offset, body, lean in zip(parts, offsets, bodies, [*leans, _NO_LEAN], strict=True):
        angle, quarters = part.angle + lean.angle, Turn(2, before.quarters_behind + lean.quarters_before, None)
        turn = sum_of_angles((ca.cos(angle), ca.sin(angle)), quarters.cos_sin)
        to_own = about_z(lean.cos_sin_before).T
        links.append(Link(turn, before.cos_sin, to_own @ offset, body.rotated(to_own)))
        before = lean
    # One body is rotated for less than all the vectors of a motion: the last one stays in the axes before its joint.
    last = links[-1]
    links[-1] = replace(last, turn=(SX(1), SX(0)), body=last.body.rotated_about_z(*last.turn))
    return SkewChain(parts[0].turns, links)


def _bent_twice(link: Any) -> bool:
    """Whether the fixed rotation of a link has several quarter turns about x or y."""
    return sum(axis != 2 and (quarters or 0) % 2 for axis, quarters, _ in fixed_turns(link)) > 1


@dataclass(frozen=True)
class _Lean:
    """A fixed rotation: about z by an `angle` and by quarter turns, about x, and about z by quarter turns again."""

    angle: SX
    quarters_before: int
    cos_sin: Vector
    quarters_behind: int

    @property
    def cos_sin_before(self) -> Vector:
        """Cosine and sine of the first rotation about z."""
        return sum_of_angles((ca.cos(self.angle), ca.sin(self.angle)), Turn(2, self.quarters_before, None).cos_sin)

    @classmethod
    def of(cls, turns: Sequence[Turn]) -> _Lean | None:
        """The product of turns as such a rotation; None if it is none, or by quarter turns about x."""
        across = [number for number, turn in enumerate(turns) if turn.axis != 2]
        if len(across) != 1 or turns[across[0]].quarters is not None:
            return None
        lean, before, behind = turns[across[0]], turns[: across[0]], turns[across[0] + 1 :]
        if any(turn.quarters is None for turn in behind):
            return None
        angle = sum((SX(turn.angle) for turn in before if turn.quarters is None), SX(0))
        # A rotation about y is one about x between quarter turns about z.
        first, last = (sum(turn.quarters or 0 for turn in part) for part in (before, behind))
        return cls(angle, first + lean.axis, lean.cos_sin, last - lean.axis)


_NO_LEAN = _Lean(SX(0), 0, (SX(1), SX(0)), 0)


def _shifted(parts: Sequence[Part]) -> tuple[list[SX], list[Moments]]:
    """Offsets and bodies, each joint put where the offset behind it has no component along its axis."""
    offsets, bodies, beyond = [], [], SX.zeros(3)
    for part in reversed(parts):
        offset = part.offset + beyond
        shift, rotation = offset[2], part.fixed_rotation
        offsets.append(ca.vertcat(offset[:2], 0))
        bodies.append(part.body.moved(-shift * _Z))
        beyond = shift * (_Z if rotation is None else rotation @ _Z)
    return offsets[::-1], bodies[::-1]


def _masses_moved_inward(parts: Sequence[Part], offsets: Sequence[SX], bodies: Sequence[Moments]) -> list[Moments]:
    """The bodies, each with its mass moved to the body before."""
    found, moved = [], Moments.none()
    for part, body, before in zip(
        reversed(parts), reversed(bodies), [*reversed(offsets[:-1]), SX.zeros(3)], strict=True
    ):
        moved, rest = (body + moved).split()
        found.append(rest)
        if part.fixed_rotation is not None:
            moved = moved.rotated(part.fixed_rotation)
        moved = moved.moved(before)
    return found[::-1]


@dataclass(frozen=True)
class Motion:
    """Motion of a link in its own axes: angular velocity `spin` (3), angular acceleration (3), gradient (3 x 3) as in
    `newton_euler`, and the acceleration (3) of its joint."""

    spin: SX
    angular: SX
    gradient: SX
    linear: SX

    def load(self, link: Link, force: SX, moment: SX) -> tuple[SX, SX]:
        """Force (3) [N] and moment (3) [N m] about the joint: those at the next joint, and what moves the link's body."""
        body = link.body
        own = inertial_moment(body, self.spin, self.gradient) + ca.cross(body.first, self.linear)
        return self.gradient @ body.first + force, own + moment + ca.cross(link.offset, force)


def motions(chain: SkewChain, qd: SX, qdd: SX, g: SX) -> list[Motion]:
    """Motion of each link; the base has the acceleration -g."""
    found: list[Motion] = []
    spin, angular, linear = SX.zeros(3), SX.zeros(3), -chain.in_first_axes(g)
    for link, rate, change in zip(chain.links, ca.vertsplit(qd), ca.vertsplit(qdd), strict=True):
        before = link.outward(spin)
        spin = before + _Z * rate
        angular = link.outward(angular) + ca.cross(before, _Z) * rate + _Z * change
        gradient = ca.skew(angular) + ca.skew(spin) @ ca.skew(spin)
        found.append(Motion(spin, angular, gradient, link.outward(linear)))
        linear = found[-1].linear + gradient @ link.offset
    return found


def skew_torques(chain: SkewChain, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion; arguments that are zero cost no operation."""
    result = []
    force, moment = SX.zeros(3), SX.zeros(3)
    for link, motion in reversed(list(zip(chain.links, motions(chain, qd, qdd, g), strict=True))):
        force, moment = motion.load(link, force, moment)
        result.append(moment[2])
        force, moment = link.inward(force), link.inward(moment)
    return ca.vertcat(*reversed(result))


def skew_mass_matrix(chain: SkewChain) -> SX:
    """M (n x n) [kg m^2] by composite bodies, as in `composite_bodies`."""
    n = len(chain.links)
    result, beyond = SX.zeros(n, n), Moments.none()
    columns: dict[int, tuple[SX, SX]] = {}  # force and moment per acceleration of each joint further out
    for i, link in reversed(list(enumerate(chain.links))):
        columns = {j: (force, moment + ca.cross(link.offset, force)) for j, (force, moment) in columns.items()}
        beyond = link.body + beyond.moved(link.offset)
        columns[i] = ca.cross(_Z, beyond.first), beyond.inertia(_Z)
        for j, (_, moment) in columns.items():
            result[i, j] = result[j, i] = moment[2]
        columns = {j: (link.inward(force), link.inward(moment)) for j, (force, moment) in columns.items()}
        beyond = link.body_inward(beyond)
    return result


def skew_weight(chain: SkewChain, g: SX) -> SX:
    """Joint torques (n) [N m] against gravity, from first moments: no body has mass."""
    down, downs = chain.in_first_axes(g), []
    for link in chain.links:
        down = link.outward(down)
        downs.append(down)
    result, first = [], SX.zeros(3)
    for link, down in reversed(list(zip(chain.links, downs, strict=True))):
        first = link.body.first + first
        result.append(ca.cross(down, first)[2])
        first = link.inward(first)
    return ca.vertcat(*reversed(result))
