"""Joint torques by Newton and Euler: motions from base to tip, forces from tip to base (eq. 2.4 to 2.15).

The recursion starts with the acceleration -g of the base: this is how gravity enters. Bodies are mass moments. Their
motion is a gradient A (3 x 3) [1/s^2], which takes a vector r fixed to the body to its second time derivative. So the
force is A h, and the moment about the joint is the integral of r x (A r) dm.
"""

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Assembly, Joint, Moments

_Z = SX([0, 0, 1])


@dataclass(frozen=True)
class _Frame:
    """Motion of working axes: angular velocity `spin` (3), angular acceleration (3) and gradient (3 x 3)."""

    spin: SX
    acceleration: SX
    gradient: SX

    def beyond(self, joint: Joint, body_rate: SX, body_acceleration: SX) -> "_Frame":
        """Working axes beyond a joint that rotates about z with `body_rate` [rad/s] and `body_acceleration` [rad/s^2]."""
        spin = joint.outward(self.spin + _Z * body_rate)
        acceleration = joint.outward(self.acceleration + ca.cross(self.spin, _Z) * body_rate + _Z * body_acceleration)
        return _Frame(spin, acceleration, ca.skew(acceleration) + ca.skew(spin) @ ca.skew(spin))

    def body_gradient(self, body_rate: SX, body_acceleration: SX) -> SX:
        """Gradient of a body that rotates about z relative to these axes; the motion of the z axis stays the same."""
        x, y, z = ca.vertsplit(self.spin)
        inward = body_rate * (2 * z + body_rate)
        return self.gradient + ca.vertcat(
            ca.horzcat(-inward, -body_acceleration, 0),
            ca.horzcat(body_acceleration, -inward, 0),
            ca.horzcat(2 * x * body_rate, 2 * y * body_rate, 0),
        )


def torques(assembly: Assembly, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion; arguments that are zero cost no operation."""
    frame = _Frame(SX.zeros(3), SX.zeros(3), SX.zeros(3, 3))
    body_rate, body_acceleration = SX(0), SX(0)
    acceleration = -assembly.base_rotation @ g
    loads = []
    for joint in assembly.joints:
        velocity = qd[joint.coordinate]
        rate = joint.ratio * velocity
        change = joint.ratio * qdd[joint.coordinate] + joint.ratio_derivative * velocity**2
        if not joint.slides:
            body_rate, body_acceleration = body_rate + rate, body_acceleration + change
        acceleration = joint.outward(acceleration)
        if joint.next_rotation is None:
            spin, gradient = frame.spin + _Z * body_rate, frame.body_gradient(body_rate, body_acceleration)
        else:
            frame = frame.beyond(joint, body_rate, body_acceleration)
            spin, gradient, body_rate, body_acceleration = frame.spin, frame.gradient, SX(0), SX(0)
        if joint.slides:
            acceleration = acceleration + 2 * rate * ca.cross(spin, joint.axis) + change * joint.axis
        first = joint.body.first
        force = gradient @ first + joint.body.mass * acceleration
        loads.append((force, inertial_moment(joint.body, spin, gradient) + ca.cross(first, acceleration)))
        acceleration = acceleration + gradient @ joint.offset

    result = SX.zeros(qd.numel())
    force, moment = SX.zeros(3), SX.zeros(3)
    for joint, (body_force, body_moment) in reversed(list(zip(assembly.joints, loads, strict=True))):
        moment = body_moment + moment + ca.cross(joint.offset, force)
        force = body_force + force
        result[joint.coordinate] += joint.ratio * joint.power(force, moment)
        force, moment = joint.inward(force), joint.inward(moment)
    return result


def weight(assembly: Assembly, g: SX, n: int) -> SX:
    """Joint torques (n) [N m] against gravity, from first moments; only bodies of slides have mass (`assembly`)."""
    down, downs = assembly.base_rotation @ g, []
    for joint in assembly.joints:
        down = joint.outward(down)
        downs.append(down)
    result, first, mass = SX.zeros(n), SX.zeros(3), SX(0)
    for joint, down in reversed(list(zip(assembly.joints, downs, strict=True))):
        first = joint.body.first + first + mass * joint.offset
        mass = mass + joint.body.mass
        result[joint.coordinate] -= joint.ratio * joint.power(mass * down, ca.cross(first, down))
        first = joint.inward(first)
    return result


def inertial_moment(body: Moments, spin: SX, gradient: SX) -> SX:
    """Moment (3) [N m] of a body about its joint: the integral of r x (A r) dm."""
    s, a = body.second, gradient
    x, y, z = ca.vertsplit(spin)
    return ca.vertcat(
        a[2, 1] * s[1, 1] - a[1, 2] * s[2, 2] + (z**2 - y**2) * s[1, 2] + a[2, 0] * s[0, 1] - a[1, 0] * s[0, 2],
        a[0, 2] * s[2, 2] - a[2, 0] * s[0, 0] + (x**2 - z**2) * s[0, 2] + a[0, 1] * s[1, 2] - a[2, 1] * s[0, 1],
        # By the moment of inertia about z: unlike S_xx and S_yy it is constant while the body rotates about z.
        2 * x * y * s[0, 0]
        - a[0, 1] * (body.trace - s[2, 2])
        + (y**2 - x**2) * s[0, 1]
        + a[1, 2] * s[0, 2]
        - a[0, 2] * s[1, 2],
    )
