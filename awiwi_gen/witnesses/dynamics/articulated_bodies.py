"""Forward dynamics of a chain by articulated bodies (Featherstone 1983): the effort grows with the number of joints.

An articulated body is a link with all beyond it, whose joints are free to move. Its inertia maps the acceleration of the
link to the force that this takes. From tip to base, each joint takes away what it cannot transmit.

The accelerations are differences to a nominal motion, that of joints without acceleration under gravity (`skew_chain`).
So all terms with velocities are in the nominal forces, which are passed on together with those of the joint torques.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Moments, Turn
from awiwi_gen.witnesses.dynamics.skew_chain import Link, SkewChain, motions
from awiwi_gen.witnesses.four_bar import Vector


@dataclass(frozen=True)
class _Inertia:
    """Inertia about a joint. The force is coupling' angular + mass linear, the moment rotary angular + coupling linear.

    `angular` and `linear` are the accelerations (3 each); `rotary` [kg m^2], `coupling` [kg m] and `mass` [kg] are 3 x 3,
    and all but the coupling are symmetric.
    """

    rotary: SX
    coupling: SX
    mass: SX

    @classmethod
    def of(cls, body: Moments) -> _Inertia:
        """Inertia of a rigid body whose mass was moved inward."""
        return cls(body.trace * SX.eye(3) - body.second, ca.skew(body.first), SX.zeros(3, 3))

    def __add__(self, other: _Inertia) -> _Inertia:
        return _Inertia(self.rotary + other.rotary, self.coupling + other.coupling, self.mass + other.mass)

    def inward(self, link: Link) -> _Inertia:
        """In the axes of the link before, from those of the link."""
        blocks = self.rotary, self.coupling, self.mass
        return _Inertia(*(_about_x(_about_z(block, link.turn), link.lean) for block in blocks))

    def moved(self, by: SX) -> _Inertia:
        """About a point from which the old joint lies at `by` (3) [m]."""
        cross = ca.skew(by)
        coupling = self.coupling + cross @ self.mass
        before, behind = self.coupling @ cross.T, cross @ coupling.T
        return _Inertia(_symmetric(self.rotary + before + behind), coupling, self.mass)


@dataclass(frozen=True)
class _FreeJoint:
    """An articulated body seen through its joint about z, which a torque drives.

    `reciprocal` [1/(kg m^2)] is that of the inertia about the joint, with the rotor; `rest` is the rotor's part of this
    inertia. `rotary` (3) and `linear` (3) [1/m] are the moment and the force that the body takes per acceleration of the
    joint, times the reciprocal. `inertia` is what the joint transmits.
    """

    reciprocal: SX
    rest: SX
    rotary: SX
    linear: SX
    inertia: _Inertia

    @classmethod
    def of(cls, inertia: _Inertia, rotor: SX) -> _FreeJoint:
        """The joint of an articulated body, with a rotor's inertia [kg m^2]."""
        reciprocal = 1 / (inertia.rotary[2, 2] + rotor)
        rest = rotor * reciprocal
        moment, force = inertia.rotary[:, 2], inertia.coupling[2, :].T
        rotary, linear = moment * reciprocal, force * reciprocal
        transmitted = _Inertia(
            _symmetric(inertia.rotary - moment @ rotary.T),
            inertia.coupling - rotary @ force.T,
            _symmetric(inertia.mass - force @ linear.T),
        )
        # Without a rotor nothing about z is transmitted: written as such, these zeros cost nothing further in.
        transmitted.rotary[2, :] = transmitted.rotary[:, 2] = moment * rest
        transmitted.coupling[2, :] = force * rest
        return cls(reciprocal, rest, rotary, linear, transmitted)


def accelerations(chain: SkewChain, rotors: SX, qd: SX, tau: SX, g: SX) -> SX:
    """Joint accelerations (n) [rad/s^2]; `rotors` (n) [kg m^2] are inertias at the joints, `tau` (n) [N m] torques."""
    joints: list[tuple[_FreeJoint, SX]] = []
    beyond = _Inertia(SX.zeros(3, 3), SX.zeros(3, 3), SX.zeros(3, 3))
    force, moment = SX.zeros(3), SX.zeros(3)
    nominal = motions(chain, qd, SX.zeros(qd.numel()), g)
    steps = zip(chain.links, nominal, ca.vertsplit(rotors), ca.vertsplit(tau), strict=True)
    for link, motion, rotor, torque in reversed(list(steps)):
        force, moment = motion.load(link, force, moment)
        joint = _FreeJoint.of(_Inertia.of(link.body) + beyond.moved(link.offset), rotor)
        excess = torque - moment[2]
        joints.insert(0, (joint, excess * joint.reciprocal))
        moment, force = moment + joint.rotary * excess, force + joint.linear * excess
        moment[2] = torque - joint.rest * excess
        force, moment, beyond = link.inward(force), link.inward(moment), joint.inertia.inward(link)

    result, angular, linear, offset = [], SX.zeros(3), SX.zeros(3), SX.zeros(3)
    for link, (joint, free) in zip(chain.links, joints, strict=True):
        linear, angular = link.outward(linear + ca.cross(angular, offset)), link.outward(angular)
        carried, offset = angular[2], link.offset
        angular[2] = free - ca.dot(joint.rotary[:2], angular[:2]) - ca.dot(joint.linear, linear) + joint.rest * carried
        result.append(angular[2] - carried)
    return ca.vertcat(*result)


def _about_z(matrix: SX, turn: Vector) -> SX:
    """A matrix (3 x 3) in the axes from which its own are rotated about z: 8 products, by the double angle."""
    (c, s), ((xx, xy, xz), (yx, yy, yz), (zx, zy, zz)) = turn, map(ca.horzsplit, ca.vertsplit(matrix))
    difference = (xx - yy) * c - (xy + yx) * s
    return ca.vertcat(
        ca.horzcat(yy + c * difference, xy + s * difference, c * xz - s * yz),
        ca.horzcat(yx + s * difference, xx - c * difference, s * xz + c * yz),
        ca.horzcat(c * zx - s * zy, s * zx + c * zy, zz),
    )


def _about_x(matrix: SX, turn: Vector) -> SX:
    """The same for axes that are rotated about x."""
    to_z = Turn(0, None, None).permutation()
    return to_z.T @ _about_z(to_z @ matrix @ to_z.T, turn) @ to_z


def _symmetric(matrix: SX) -> SX:
    """A symmetric matrix by the entries of its upper triangle: each is computed once."""
    return ca.triu2symm(ca.triu(matrix))
