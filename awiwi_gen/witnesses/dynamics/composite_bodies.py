"""Mass matrix and Coriolis matrix of a chain, in one recursion from the tip to the base.

Unit velocity of a coordinate gives every point beyond its joint a velocity: the coordinate's velocity field. With the
fields as columns of J, M is the integral of J' J dm, and C by Christoffel symbols is that of J' dJ/dt dm. So M needs the
momenta of the fields, and C needs those of their time derivatives. All bodies beyond a joint are one composite body.
(Echeandia and Wensing 2021 factor the Coriolis terms body by body; the matrix is the same.)
"""

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Assembly, Joint, Moments

_Z = SX([0, 0, 1])


@dataclass(frozen=True)
class _Motion:
    """Motion of a body [rad/s]: `frame` (3) is the angular velocity of its working axes, `frame_rate` their rate about
    the joint relative to the axes before it, `body_rate` the body's rate relative to its working axes, and `slip` (3)
    [m/s] the velocity with which a slide moves it."""

    frame: SX
    frame_rate: SX
    body_rate: SX
    slip: SX


@dataclass(frozen=True)
class _Composite:
    """All bodies beyond a joint: their mass moments, their `momentum`, the integral of v dm, and their `dyad`, that of
    v r' dm; r leads from the joint to a mass and v is the rate of r in the joint's working axes."""

    body: Moments
    momentum: SX
    dyad: SX

    def extended(self, joint: Joint, motion: _Motion) -> "_Composite":
        """With the joint's own body added, and about the joint."""
        rate, own = motion.body_rate * ca.skew(joint.axis), joint.body
        next_momentum = self.body.mass * (rate @ joint.offset + motion.slip)
        dyad = (self.momentum + next_momentum) @ joint.offset.T + motion.slip @ (self.body.first + own.first).T
        dyad += rate @ (joint.offset @ self.body.first.T + own.second)
        momentum = self.momentum + next_momentum + rate @ own.first + own.mass * motion.slip
        return _Composite(own + self.body.moved(joint.offset), momentum, self.dyad + dyad)

    def inward(self, joint: Joint, motion: _Motion) -> "_Composite":
        """In the axes before the joint, which do not rotate with it."""
        body, rate = joint.body_inward(self.body), motion.frame_rate * ca.skew(_Z)
        dyad = joint.inward(joint.inward(self.dyad).T).T
        return _Composite(body, joint.inward(self.momentum) + rate @ body.first, dyad + rate @ body.second)

    def column(self, joint: Joint, motion: _Motion, speed: SX) -> "_Column":
        """The part of the coordinate's field that this joint contributes."""
        axis, body, frame = joint.axis, self.body, motion.frame
        turned = ca.cross(frame, axis)
        if joint.slides:  # the field is the axis, everywhere
            force, moment = body.mass * axis, ca.cross(body.first, axis)
            force_rate, moment_rate = body.mass * turned, ca.cross(body.first, turned)
            velocity_moment = ca.cross(self.momentum + ca.cross(frame, body.first), axis)
        else:
            force, moment = ca.cross(axis, body.first), body.inertia(axis)
            # The field is axis x r. Its rate in space is that in the working axes plus that of the axes.
            stretch = ca.trace(self.dyad) * axis
            force_rate = ca.cross(axis, self.momentum) + ca.cross(frame, force)
            moment_rate = stretch - self.dyad @ axis + ca.cross(body.second @ frame, axis)
            velocity_moment = stretch - self.dyad.T @ axis + body.second @ turned
        ratio, ratio_rate = joint.ratio, joint.ratio_derivative * speed
        return _Column(
            force=ratio * force,
            moment=ratio * moment,
            force_rate=ratio * force_rate + ratio_rate * force,
            moment_rate=ratio * moment_rate + ratio_rate * moment,
            velocity_moment=ratio * velocity_moment,
            row=None if joint.slides else ratio * ca.dot(axis, moment_rate),
        )


@dataclass(frozen=True)
class _Column:
    """The field of one coordinate, integrated over all masses beyond a joint.

    `force` and `moment` (3 each) are its momentum and angular momentum, `force_rate` and `moment_rate` those of its time
    derivative. `velocity_moment` (3) is the integral of v x field dm, with v the velocity relative to the joint. `row`
    is the entry of this coordinate's row of C per unit rate of the joint; it is None once an axis was not parallel or
    a joint slid, where the general formula is needed.
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

    def moved(self, joint: Joint, spin: SX, slip: SX) -> "_Column":
        """About this joint, whose body turns with `spin` (3) and slides with `slip` (3), instead of about the next one."""
        row = None
        if self.row is not None and joint.next_rotation is None and not joint.slides:
            row = self.row - spin[2] * ca.dot(joint.offset, self.force)
        return _Column(
            self.force,
            self.moment + ca.cross(joint.offset, self.force),
            self.force_rate,
            self.moment_rate + ca.cross(joint.offset, self.force_rate),
            self.velocity_moment + ca.cross(ca.cross(spin, joint.offset) + slip, self.force),
            row,
        )

    def inward(self, joint: Joint) -> "_Column":
        """In the axes before the joint."""
        return _Column(
            joint.inward(self.force),
            joint.inward(self.moment),
            joint.inward(self.force_rate),
            joint.inward(self.moment_rate),
            joint.inward(self.velocity_moment),
            self.row,
        )


def mass_and_coriolis(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    """M (n x n) [kg m^2] and C (n x n) [N m s]; for velocities of zero, C costs no operation."""
    n = qd.numel()
    mass, coriolis = SX.zeros(n, n), SX.zeros(n, n)
    columns: dict[int, _Column] = {}
    beyond = _Composite(Moments.none(), SX.zeros(3), SX.zeros(3, 3))
    for joint, motion in reversed(list(zip(assembly.joints, _motions(assembly, qd), strict=True))):
        i, axis, spin = joint.coordinate, joint.axis, motion.frame + motion.body_rate * joint.axis
        columns = {other: column.moved(joint, spin, motion.slip) for other, column in columns.items()}
        for other, column in columns.items():
            entry = joint.power(column.force, column.moment)
            row = column.row
            if joint.slides:
                row = ca.dot(ca.cross(spin, axis), column.force)
            elif row is None:
                row = ca.dot(axis, column.velocity_moment) + ca.dot(ca.cross(spin, axis), column.moment)
            mass[i, other] += joint.ratio * entry
            mass[other, i] += joint.ratio * entry
            coriolis[i, other] += joint.ratio * joint.power(column.force_rate, column.moment_rate)
            coriolis[other, i] += joint.ratio * row + joint.ratio_derivative * qd[i] * entry

        beyond = beyond.extended(joint, motion)
        column = beyond.column(joint, motion, qd[i])
        mass[i, i] += joint.ratio * joint.power(column.force, column.moment)
        coriolis[i, i] += joint.ratio * joint.power(column.force_rate, column.moment_rate)
        columns[i] = columns[i] + column if i in columns else column

        columns = {other: column.inward(joint) for other, column in columns.items()}
        beyond = beyond.inward(joint, motion)
    return ca.triu2symm(ca.triu(mass)), coriolis


def _motions(assembly: Assembly, qd: SX) -> list[_Motion]:
    motions, frame, body_rate = [], SX.zeros(3), SX(0)
    for joint in assembly.joints:
        rate, slip = joint.ratio * qd[joint.coordinate], SX.zeros(3)
        if joint.slides:
            slip = rate * joint.axis
        else:
            body_rate = body_rate + rate
        if joint.next_rotation is None:
            motions.append(_Motion(frame, SX(0), body_rate, slip))
        else:
            frame = joint.outward(frame + _Z * body_rate)
            motions.append(_Motion(frame, body_rate, SX(0), slip))
            body_rate = SX(0)
    return motions
