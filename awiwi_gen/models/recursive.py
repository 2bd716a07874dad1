"""Kinematics and dynamics of a finger by recursion along the chain: the route that makes fast code.

Nothing here is differentiated: velocities are axes times levers, torques come from Newton and Euler (eq. 2.4 to 2.15), the mass matrix
from composite bodies, its Christoffel-consistent partner from the same recursion one derivative later (Echeandia and
Wensing 2021). Vectors live in the working axes of `assembly`, where the mass of every composite body is zero.
"""

import casadi as ca
from casadi import SX

from awiwi_gen.models.assembly import Assembly, Moments, assemble
from awiwi_gen.models.composite import mass_and_coriolis
from awiwi_gen.models.tree import Finger

_Z = SX([0, 0, 1])


def link_poses(finger: Finger, q: SX) -> list[SX]:
    """Poses (4 x 4 each) of the links' frames, at their joints and after their rotations, in the finger's base (eq. 5.2)."""
    assembly = assemble(finger, q)
    origin, poses = SX.zeros(3), []
    for joint, axes in zip(assembly.joints, _axes(assembly)):
        if joint.link is not None:
            poses.append(_pose(axes @ joint.rotation, origin))
        origin = origin + axes @ joint.offset
    return poses


def fingertip_pose(finger: Finger, q: SX) -> SX:
    """Pose (4 x 4) of the fingertip in the finger's base (eq. 5.3)."""
    assembly = assemble(finger, q)
    tip = SX.zeros(3)
    for joint in reversed(assembly.joints):
        tip = joint.back(joint.offset + tip)
    return _pose(_axes(assembly)[-1] @ assembly.joints[-1].rotation, assembly.turn.T @ tip)


def jacobian(finger: Finger, q: SX) -> SX:
    """J (6 x n): the tip's velocity [m/rad], then its angular velocity [rad/rad], per unit joint velocity, in base axes."""
    assembly = assemble(finger, q)
    lever, result = SX.zeros(3), SX.zeros(6, q.numel())
    for joint, axes in reversed(list(zip(assembly.joints, _axes(assembly)))):
        lever = joint.offset + lever
        column = ca.vertcat(axes @ ca.cross(joint.axis, lever), axes @ joint.axis)
        result[:, joint.coordinate] += joint.rate * column
        lever = joint.back(lever)
    return result


def seat_point(finger: Finger, q: SX, joint: str, local: SX) -> SX:
    """Base coordinates (3) [m] of a point that stands still where `joint` turns: after its fixed turn, before its rotation."""
    assembly = assemble(finger, q)
    index = next(i for i, link in enumerate(finger.links) if link.joint == joint)
    before = [joint for joint in assembly.joints if joint.link is not None and joint.link < index]
    point = before[-1].rotation @ local if before and before[-1].turn is None else local
    for one in reversed(assembly.joints[:len(before)]):
        point = one.back(one.offset + point)
    return assembly.turn.T @ point


def mass_matrix(finger: Finger, q: SX) -> SX:
    """M (n x n) [kg m^2] by composite bodies."""
    return mass_and_coriolis(assemble(finger, q), SX.zeros(q.numel()))[0]


def coriolis_matrix(finger: Finger, q: SX, qd: SX) -> SX:
    """C (n x n) [N m s] with Mdot - 2 C skew, the one that Christoffel's symbols give."""
    return mass_and_coriolis(assemble(finger, q), qd)[1]


def gravity(finger: Finger, q: SX, g: SX) -> SX:
    """Joint torques (n) [N m] that hold the finger still."""
    return _weight(assemble(finger, q), g, q.numel())


def bias(finger: Finger, q: SX, qd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion without acceleration: C qd + gravity."""
    return _newton_euler(assemble(finger, q), qd, SX.zeros(q.numel()), g)


def inverse_dynamics(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion (eq. 2.4 to 2.15, started with the acceleration -g)."""
    return _newton_euler(assemble(finger, q), qd, qdd, g)


def forward_dynamics(finger: Finger, q: SX, qd: SX, tau: SX, g: SX) -> SX:
    """Joint accelerations (n) [rad/s^2] that joint torques tau cause: M qdd = tau - bias."""
    assembly = assemble(finger, q)
    still = SX.zeros(q.numel())
    return _solve(mass_and_coriolis(assembly, still)[0], tau - _newton_euler(assembly, qd, still, g))


def dynamics(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX, SX]:
    """M (n x n) [kg m^2], C (n x n) [N m s] and the gravity torques (n) [N m] of eq. 2.17."""
    assembly = assemble(finger, q)
    return *mass_and_coriolis(assembly, qd), _weight(assembly, g, q.numel())


def energy(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX]:
    """Kinetic and potential energy [J] (eq. 5.4); the potential is zero for masses at the height of the base's origin."""
    assembly = assemble(finger, q)
    mass = mass_and_coriolis(assembly, SX.zeros(q.numel()))[0]
    once = ca.triu(mass) - ca.diag(ca.diag(mass)) / 2
    potential, down = -ca.dot(g, assembly.ballast), assembly.turn @ g
    for joint in assembly.joints:
        down = joint.forth(down)
        potential -= ca.dot(down, joint.body.first)
    return ca.dot(qd, once @ qd), potential


def _pose(axes: SX, origin: SX) -> SX:
    return ca.vertcat(ca.horzcat(axes, origin), SX([[0, 0, 0, 1]]))


def _axes(assembly: Assembly) -> list[SX]:
    """Rotations (3 x 3) from the working axes of each joint's body to base axes."""
    axes = [assembly.turn.T]
    for joint in assembly.joints:
        axes.append(joint.forth(axes[-1].T).T)
    return axes[1:]


def _weight(assembly: Assembly, g: SX, n: int) -> SX:
    """Joint torques (n) against gravity: composite bodies without mass need no levers, only their first moments."""
    down, downs = assembly.turn @ g, []
    for joint in assembly.joints:
        down = joint.forth(down)
        downs.append(down)
    torques, first = SX.zeros(n), SX.zeros(3)
    for joint, down in reversed(list(zip(assembly.joints, downs))):
        first = joint.body.first + first
        torques[joint.coordinate] -= joint.rate * ca.dot(joint.axis, ca.cross(first, down))
        first = joint.back(first)
    return torques


def _newton_euler(assembly: Assembly, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) of a motion; zeros among the arguments cost nothing.

    A gradient takes a vector that stands still in a body to its second derivative in time.
    """
    frame_spin, frame_turning, frame_gradient = SX.zeros(3), SX.zeros(3), SX.zeros(3, 3)
    swing, swing_rate = SX(0), SX(0)
    acceleration = -assembly.turn @ g
    loads = []
    for joint in assembly.joints:
        rate = qd[joint.coordinate]
        swing += joint.rate * rate
        swing_rate += joint.rate * qdd[joint.coordinate] + joint.bend * rate**2
        acceleration = joint.forth(acceleration)
        if joint.turn is None:
            spin = frame_spin + _Z * swing
            gradient = frame_gradient + _swung(frame_spin, swing, swing_rate)
        else:
            frame_turning = joint.forth(frame_turning + ca.cross(frame_spin, _Z) * swing + _Z * swing_rate)
            frame_spin = spin = joint.forth(frame_spin + _Z * swing)
            frame_gradient = gradient = ca.skew(frame_turning) + ca.skew(spin) @ ca.skew(spin)
            swing, swing_rate = SX(0), SX(0)
        body = joint.body
        loads.append((gradient @ body.first, _swirl(body, spin, gradient) + ca.cross(body.first, acceleration)))
        acceleration = acceleration + gradient @ joint.offset

    torques = SX.zeros(qd.numel())
    force, moment = SX.zeros(3), SX.zeros(3)
    for joint, (own_force, own_moment) in reversed(list(zip(assembly.joints, loads))):
        moment = own_moment + moment + ca.cross(joint.offset, force)
        force = own_force + force
        torques[joint.coordinate] += joint.rate * ca.dot(joint.axis, moment)
        force, moment = joint.back(force), joint.back(moment)
    return torques


def _swung(frame_spin: SX, swing: SX, swing_rate: SX) -> SX:
    """What turning about z in a frame adds to the gradient of the frame; how z itself moves does not change."""
    x, y, z = ca.vertsplit(frame_spin)
    inward = swing * (2 * z + swing)
    return ca.vertcat(
        ca.horzcat(-inward, -swing_rate, 0), ca.horzcat(swing_rate, -inward, 0), ca.horzcat(2 * x * swing, 2 * y * swing, 0))


def _swirl(body: Moments, spin: SX, gradient: SX) -> SX:
    """Moment (3) of a body's inertia forces about its joint: the integral of r x (gradient r) dm."""
    s, a = body.second, gradient
    x, y, z = ca.vertsplit(spin)
    return ca.vertcat(
        a[2, 1] * s[1, 1] - a[1, 2] * s[2, 2] + (z**2 - y**2) * s[1, 2] + a[2, 0] * s[0, 1] - a[1, 0] * s[0, 2],
        a[0, 2] * s[2, 2] - a[2, 0] * s[0, 0] + (x**2 - z**2) * s[0, 2] + a[0, 1] * s[1, 2] - a[2, 1] * s[0, 1],
        # The moment of inertia about z, unlike S_xx and S_yy alone, does not change while the body turns about z.
        2 * x * y * s[0, 0] - a[0, 1] * (body.trace - s[2, 2]) + (y**2 - x**2) * s[0, 1] + a[1, 2] * s[0, 2] - a[0, 2] * s[1, 2])


def _solve(mass: SX, torque: SX) -> SX:
    """x with M x = torque, by M = U D U' with unit upper U: the last pivot, which does not depend on q, comes first."""
    n = torque.numel()
    mass, x, upper, pivot = SX(mass), SX(torque), SX.eye(n), [SX(0)] * n
    for k in reversed(range(n)):
        pivot[k] = 1 / mass[k, k]
        for i in range(k):
            upper[i, k] = mass[i, k] * pivot[k]
            x[i] -= upper[i, k] * x[k]
            for j in range(i, k):
                mass[i, j] -= upper[i, k] * mass[j, k]
    for k in range(n):
        x[k] *= pivot[k]
        for i in range(k):
            x[k] -= upper[i, k] * x[i]
    return x
