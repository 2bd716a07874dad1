"""Mass matrix and Coriolis matrix of a chain, in one recursion from the tip to the base.

Unit velocity of a coordinate gives every point beyond its joint a velocity: the coordinate's field. With J the
fields as columns, M is the integral of J' J dm and C, of Christoffel symbols, that of J' dJ/dt dm. So M needs the
momenta of fields, and C those of their derivatives. Bodies beyond a joint enter as one composite body. (Echeandia
and Wensing 2021 factor the Coriolis terms body by body; the matrix is the same.)
"""

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Assembly, Joint, Moments

_Z = SX([0, 0, 1])


@dataclass(frozen=True)
class _Motion:
    """How a body moves: its working axes turn with `frame` (3) and, against those before the joint, at `step` about the
    joint; the body turns at `swing` against its working axes. All in rad/s."""

    frame: SX
    step: SX
    swing: SX


@dataclass(frozen=True)
class _Composite:
    """All that lies beyond a joint: its mass moments, and the integrals of v dm and of v r' dm, where r leads from the
    joint to a mass and v is the rate of r in the joint's working axes."""

    body: Moments
    flow: SX
    whirl: SX

    def extended(self, joint: Joint, motion: _Motion) -> "_Composite":
        """With the joint's own body, and about the joint."""
        swing = motion.swing * ca.skew(joint.axis)
        whirl = self.flow @ joint.offset.T + swing @ (joint.offset @ self.body.first.T + joint.body.second)
        return _Composite(
            joint.body + self.body.moved(joint.offset), self.flow + swing @ joint.body.first, self.whirl + whirl
        )

    def back(self, joint: Joint, motion: _Motion) -> "_Composite":
        """In the axes before the joint, which do not turn with it."""
        body, step = joint.body_back(self.body), motion.step * ca.skew(_Z)
        whirl = joint.back(joint.back(self.whirl).T).T
        return _Composite(body, joint.back(self.flow) + step @ body.first, whirl + step @ body.second)

    def column(self, joint: Joint, motion: _Motion, speed: SX) -> "_Column":
        """The field of the joint's coordinate, as far as this joint makes it."""
        axis, body, frame = joint.axis, self.body, motion.frame
        force, moment = ca.cross(axis, body.first), body.inertia(axis)
        # The field is axis x r. Its rate in space: that in the working axes, and what their turning adds.
        stretch = ca.trace(self.whirl) * axis
        force_rate = ca.cross(axis, self.flow) + ca.cross(frame, force)
        moment_rate = stretch - self.whirl @ axis + ca.cross(body.second @ frame, axis)
        velocity_moment = stretch - self.whirl.T @ axis + body.second @ ca.cross(frame, axis)
        rate, bend = joint.rate, joint.bend * speed
        return _Column(
            force=rate * force,
            moment=rate * moment,
            force_rate=rate * force_rate + bend * force,
            moment_rate=rate * moment_rate + bend * moment,
            velocity_moment=rate * velocity_moment,
            row=rate * ca.dot(axis, moment_rate),
        )


@dataclass(frozen=True)
class _Column:
    """The field of one coordinate, integrated over all masses beyond a joint.

    `force` and `moment` (3 each) are its momentum, `force_rate` and `moment_rate` that of its derivative.
    `velocity_moment` (3) is the integral of v x field dm, with v the velocity relative to the joint. `row` is the entry
    that this coordinate's row of C has for a unit rate of the joint, kept for as long as all axes since were parallel:
    there it costs less than in general.
    """

    force: SX
    moment: SX
    force_rate: SX
    moment_rate: SX
    velocity_moment: SX
    row: SX | None

    def __add__(self, other: "_Column") -> "_Column":
        return _Column(
            self.force + other.force,
            self.moment + other.moment,
            self.force_rate + other.force_rate,
            self.moment_rate + other.moment_rate,
            self.velocity_moment + other.velocity_moment,
            None if self.row is None or other.row is None else self.row + other.row,
        )

    def moved(self, joint: Joint, spin: SX) -> "_Column":
        """About this joint, whose body turns with `spin` (3), instead of about the next one."""
        row = None
        if self.row is not None and joint.turn is None:
            row = self.row - spin[2] * ca.dot(joint.offset, self.force)
        return _Column(
            self.force,
            self.moment + ca.cross(joint.offset, self.force),
            self.force_rate,
            self.moment_rate + ca.cross(joint.offset, self.force_rate),
            self.velocity_moment + ca.cross(ca.cross(spin, joint.offset), self.force),
            row,
        )

    def back(self, joint: Joint) -> "_Column":
        """In the axes before the joint."""
        return _Column(
            joint.back(self.force),
            joint.back(self.moment),
            joint.back(self.force_rate),
            joint.back(self.moment_rate),
            joint.back(self.velocity_moment),
            self.row,
        )


def mass_and_coriolis(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    """M (n x n) [kg m^2] and C (n x n) [N m s]; where velocities are zero C costs nothing."""
    n = qd.numel()
    mass, coriolis = SX.zeros(n, n), SX.zeros(n, n)
    columns: dict[int, _Column] = {}
    beyond = _Composite(Moments.none(), SX.zeros(3), SX.zeros(3, 3))
    for joint, motion in reversed(list(zip(assembly.joints, _motions(assembly, qd), strict=True))):
        own, axis, spin = joint.coordinate, joint.axis, motion.frame + motion.swing * joint.axis
        columns = {other: column.moved(joint, spin) for other, column in columns.items()}
        for other, column in columns.items():
            entry = ca.dot(axis, column.moment)
            row = column.row
            if row is None:
                row = ca.dot(axis, column.velocity_moment) + ca.dot(ca.cross(spin, axis), column.moment)
            mass[own, other] += joint.rate * entry
            mass[other, own] += joint.rate * entry
            coriolis[own, other] += joint.rate * ca.dot(axis, column.moment_rate)
            coriolis[other, own] += joint.rate * row + joint.bend * qd[own] * entry

        beyond = beyond.extended(joint, motion)
        column = beyond.column(joint, motion, qd[own])
        mass[own, own] += joint.rate * ca.dot(axis, column.moment)
        coriolis[own, own] += joint.rate * ca.dot(axis, column.moment_rate)
        columns[own] = columns[own] + column if own in columns else column

        columns = {other: column.back(joint) for other, column in columns.items()}
        beyond = beyond.back(joint, motion)
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
