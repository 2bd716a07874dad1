"""Mass matrix and Coriolis matrix of a chain, both in one recursion from the tip to the base.

Unit velocity of a coordinate gives every point beyond its joint a velocity. The momentum of this field is what the mass matrix is made of
(composite bodies); the momentum of its derivative in time makes the Coriolis matrix of Christoffel symbols, because that is the sum over all masses
of J' dJ/dt (the body-level factorisation of Echeandia and Wensing 2021 gives the same matrix).
"""

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.models.assembly import Assembly, Joint, nothing

_Z = SX([0, 0, 1])


@dataclass
class _Motion:
    """Of a body's working axes: angular velocity `frame`, and `turned`, their rate against those before the joint. Of the body:
    `swing`, its rate against its working axes."""

    frame: SX
    turned: SX
    swing: SX

    def spin(self, joint: Joint) -> SX:
        """Angular velocity (3) of the body."""
        return self.frame + self.swing * joint.axis


@dataclass
class _Column:
    """The velocity field of one coordinate, integrated over all masses beyond a joint.

    `force` and `moment` are the momentum of the field, `force_rate` and `moment_rate` that of its derivative, `turn_rate` the
    integral of v x field dm with the velocities v relative to the joint. As long as all axes since are parallel, `row` is the
    entry of the Coriolis matrix in the row of this coordinate and the column of the joint, up to the latter's rate.
    """

    force: SX
    moment: SX
    force_rate: SX
    moment_rate: SX
    turn_rate: SX
    row: SX | None

    def __add__(self, other: "_Column") -> "_Column":
        return _Column(
            self.force + other.force, self.moment + other.moment, self.force_rate + other.force_rate,
            self.moment_rate + other.moment_rate, self.turn_rate + other.turn_rate,
            None if self.row is None or other.row is None else self.row + other.row)

    def moved(self, joint: Joint, spin: SX) -> "_Column":
        """The same, seen from a joint whose body turns with `spin`, instead of from the next."""
        row = None
        if self.row is not None and joint.turn is None:
            row = self.row - spin[2] * ca.dot(joint.offset, self.force)
        return _Column(
            self.force, self.moment + ca.cross(joint.offset, self.force), self.force_rate,
            self.moment_rate + ca.cross(joint.offset, self.force_rate),
            self.turn_rate + ca.cross(ca.cross(spin, joint.offset), self.force), row)

    def back(self, joint: Joint) -> "_Column":
        """The same in the axes before the joint."""
        return _Column(*map(joint.back, (self.force, self.moment, self.force_rate, self.moment_rate, self.turn_rate)), self.row)


def mass_and_coriolis(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    """M (n x n) [kg m^2] and C (n x n) [N m s]; without velocities C costs nothing."""
    n = qd.numel()
    mass, coriolis = SX.zeros(n, n), SX.zeros(n, n)
    columns: dict[int, _Column] = {}
    # Integrals over the masses beyond the joint: of r', and of r' r^T, with velocities r' relative to the working axes.
    beyond, flow, whirl = nothing(), SX.zeros(3), SX.zeros(3, 3)
    for joint, motion in reversed(list(zip(assembly.joints, _motions(assembly, qd)))):
        own, axis, spin = joint.coordinate, joint.axis, motion.spin(joint)
        around = motion.swing * ca.skew(axis)
        whirl = whirl + flow @ joint.offset.T + around @ joint.offset @ beyond.first.T + around @ joint.body.second
        flow = flow + around @ joint.body.first
        beyond = joint.body + beyond.moved(joint.offset)

        columns = {other: column.moved(joint, spin) for other, column in columns.items()}
        for other, column in columns.items():
            entry = ca.dot(axis, column.moment)
            row = column.row
            if row is None:
                row = ca.dot(axis, column.turn_rate) + ca.dot(ca.cross(spin, axis), column.moment)
            mass[own, other] += joint.rate * entry
            mass[other, own] += joint.rate * entry
            coriolis[own, other] += joint.rate * ca.dot(axis, column.moment_rate)
            coriolis[other, own] += joint.rate * row + joint.bend * qd[own] * entry

        force, moment = ca.cross(axis, beyond.first), beyond.inertia(axis)
        stretch = ca.trace(whirl) * axis
        force_rate = ca.cross(motion.frame, force) + ca.cross(axis, flow)
        moment_rate = ca.cross(beyond.second @ motion.frame, axis) + stretch - whirl @ axis
        turn_rate = beyond.second @ ca.cross(motion.frame, axis) + stretch - whirl.T @ axis
        rate, bend = joint.rate, joint.bend * qd[own]
        column = _Column(
            rate * force, rate * moment, rate * force_rate + bend * force, rate * moment_rate + bend * moment,
            rate * turn_rate, rate * ca.dot(axis, moment_rate))
        mass[own, own] += rate * ca.dot(axis, column.moment)
        coriolis[own, own] += rate * ca.dot(axis, column.moment_rate)
        columns[own] = columns[own] + column if own in columns else column

        columns = {other: column.back(joint) for other, column in columns.items()}
        beyond, flow, whirl = joint.body_back(beyond), joint.back(flow), joint.back(joint.back(whirl).T).T
        flow = flow + motion.turned * ca.cross(_Z, beyond.first)
        whirl = whirl + motion.turned * ca.skew(_Z) @ beyond.second
    return ca.triu2symm(ca.triu(mass)), coriolis


def _motions(assembly: Assembly, qd: SX) -> list[_Motion]:
    motions, frame, swing = [], SX.zeros(3), SX(0)
    for joint in assembly.joints:
        swing = swing + joint.rate * qd[joint.coordinate]
        if joint.turn is None:
            motions.append(_Motion(frame, SX(0), swing))
        else:
            frame = joint.forth(frame + _Z * swing)
            motions.append(_Motion(frame, swing, SX(0)))
            swing = SX(0)
    return motions
