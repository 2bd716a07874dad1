"""Joint torques by Newton and Euler: motions from base to tip, forces from tip to base (eq. 2.4 to 2.15).

The recursion starts with the acceleration -g of the base, so that gravity enters. Bodies are mass moments, and
their motion is a gradient A (3 x 3) [1/s^2], which takes a vector r that stands still in the body to its second
derivative. So the force is A h, and the moment about the joint is the integral of r x (A r) dm.
"""

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Assembly, Joint, Moments

_Z = SX([0, 0, 1])


@dataclass(frozen=True)
class _Frame:
    """Motion of working axes: angular velocity (3), angular acceleration (3) and gradient (3 x 3)."""

    spin: SX
    turning: SX
    gradient: SX

    def beyond(self, joint: Joint, swing: SX, swing_rate: SX) -> "_Frame":
        """The working axes after a joint that turns them by `swing` [rad/s] and `swing_rate` [rad/s^2] about z."""
        spin = joint.forth(self.spin + _Z * swing)
        turning = joint.forth(self.turning + ca.cross(self.spin, _Z) * swing + _Z * swing_rate)
        return _Frame(spin, turning, ca.skew(turning) + ca.skew(spin) @ ca.skew(spin))

    def swung(self, swing: SX, swing_rate: SX) -> SX:
        """Gradient of a body that turns about z in these axes. The motion of z itself stays what it is."""
        x, y, z = ca.vertsplit(self.spin)
        inward = swing * (2 * z + swing)
        return self.gradient + ca.vertcat(
            ca.horzcat(-inward, -swing_rate, 0),
            ca.horzcat(swing_rate, -inward, 0),
            ca.horzcat(2 * x * swing, 2 * y * swing, 0),
        )


def torques(assembly: Assembly, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion; zeros among the arguments cost nothing."""
    frame = _Frame(SX.zeros(3), SX.zeros(3), SX.zeros(3, 3))
    swing, swing_rate = SX(0), SX(0)
    acceleration = -assembly.turn @ g
    loads = []
    for joint in assembly.joints:
        velocity = qd[joint.coordinate]
        swing += joint.rate * velocity
        swing_rate += joint.rate * qdd[joint.coordinate] + joint.bend * velocity**2
        acceleration = joint.forth(acceleration)
        if joint.turn is None:
            spin, gradient = frame.spin + _Z * swing, frame.swung(swing, swing_rate)
        else:
            frame = frame.beyond(joint, swing, swing_rate)
            spin, gradient, swing, swing_rate = frame.spin, frame.gradient, SX(0), SX(0)
        first = joint.body.first
        loads.append((gradient @ first, _swirl(joint.body, spin, gradient) + ca.cross(first, acceleration)))
        acceleration = acceleration + gradient @ joint.offset

    result = SX.zeros(qd.numel())
    force, moment = SX.zeros(3), SX.zeros(3)
    for joint, (own_force, own_moment) in reversed(list(zip(assembly.joints, loads, strict=True))):
        moment = own_moment + moment + ca.cross(joint.offset, force)
        force = own_force + force
        result[joint.coordinate] += joint.rate * ca.dot(joint.axis, moment)
        force, moment = joint.back(force), joint.back(moment)
    return result


def weight(assembly: Assembly, g: SX, n: int) -> SX:
    """Joint torques (n) [N m] against gravity: bodies without mass need no levers, their first moments are enough."""
    down, downs = assembly.turn @ g, []
    for joint in assembly.joints:
        down = joint.forth(down)
        downs.append(down)
    result, first = SX.zeros(n), SX.zeros(3)
    for joint, down in reversed(list(zip(assembly.joints, downs, strict=True))):
        first = joint.body.first + first
        result[joint.coordinate] -= joint.rate * ca.dot(joint.axis, ca.cross(first, down))
        first = joint.back(first)
    return result


def _swirl(body: Moments, spin: SX, gradient: SX) -> SX:
    """Moment (3) [N m] of a body about its joint: the integral of r x (A r) dm."""
    s, a = body.second, gradient
    x, y, z = ca.vertsplit(spin)
    return ca.vertcat(
        a[2, 1] * s[1, 1] - a[1, 2] * s[2, 2] + (z**2 - y**2) * s[1, 2] + a[2, 0] * s[0, 1] - a[1, 0] * s[0, 2],
        a[0, 2] * s[2, 2] - a[2, 0] * s[0, 0] + (x**2 - z**2) * s[0, 2] + a[0, 1] * s[1, 2] - a[2, 1] * s[0, 1],
        # By the moment of inertia about z, which unlike S_xx and S_yy is constant while the body turns about z.
        2 * x * y * s[0, 0]
        - a[0, 1] * (body.trace - s[2, 2])
        + (y**2 - x**2) * s[0, 1]
        + a[1, 2] * s[0, 2]
        - a[0, 2] * s[1, 2],
    )
