"""Kinematics and dynamics of a finger by recursion along the chain: the route that makes fast code.

Nothing here is differentiated: velocities are axes times levers, torques come from Newton and Euler (eq. 2.4 to 2.15), the mass matrix
from composite bodies, its Christoffel-consistent partner from the same recursion one derivative later (Echeandia and
Wensing 2021). Vectors live in the working axes of `assembly`, where the mass of every composite body is zero.
"""

import casadi as ca
from casadi import SX

from awiwi_gen.models.assembly import Assembly, Moments, assemble
from awiwi_gen.models.tree import Finger


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
    return _mass_matrix(assemble(finger, q), q.numel())


def coriolis_matrix(finger: Finger, q: SX, qd: SX) -> SX:
    """C (n x n) [N m s] with Mdot - 2 C skew, the one that Christoffel's symbols give."""
    return _coriolis_matrix(assemble(finger, q), qd)


def gravity(finger: Finger, q: SX, g: SX) -> SX:
    """Joint torques (n) [N m] that hold the finger still."""
    still = SX.zeros(q.numel())
    return _newton_euler(assemble(finger, q), still, still, g)


def bias(finger: Finger, q: SX, qd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion without acceleration: C qd + gravity."""
    return _newton_euler(assemble(finger, q), qd, SX.zeros(q.numel()), g)


def inverse_dynamics(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion (eq. 2.4 to 2.15, started with the acceleration -g)."""
    return _newton_euler(assemble(finger, q), qd, qdd, g)


def forward_dynamics(finger: Finger, q: SX, qd: SX, tau: SX, g: SX) -> SX:
    """Joint accelerations (n) [rad/s^2] that joint torques tau cause: M qdd = tau - bias."""
    assembly = assemble(finger, q)
    return _solve(_mass_matrix(assembly, q.numel()), tau - _newton_euler(assembly, qd, SX.zeros(q.numel()), g))


def dynamics(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX, SX]:
    """M (n x n) [kg m^2], C (n x n) [N m s] and the gravity torques (n) [N m] of eq. 2.17."""
    assembly, still = assemble(finger, q), SX.zeros(q.numel())
    return _mass_matrix(assembly, q.numel()), _coriolis_matrix(assembly, qd), _newton_euler(assembly, still, still, g)


def energy(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX]:
    """Kinetic and potential energy [J] (eq. 5.4); the potential is zero for masses at the height of the base's origin."""
    assembly = assemble(finger, q)
    kinetic, potential = SX(0), -ca.dot(g, assembly.ballast)
    spin, velocity, down = SX.zeros(3), SX.zeros(3), assembly.turn @ g
    for joint in assembly.joints:
        spin = joint.forth(spin) + joint.axis * (joint.rate * qd[joint.coordinate])
        velocity, down = joint.forth(velocity), joint.forth(down)
        first = joint.body.first
        kinetic += ca.dot(velocity, ca.cross(spin, first)) + ca.dot(spin, joint.body.inertia(spin)) / 2
        potential -= ca.dot(down, first)
        velocity = velocity + ca.cross(spin, joint.offset)
    return kinetic, potential


def _pose(axes: SX, origin: SX) -> SX:
    return ca.vertcat(ca.horzcat(axes, origin), SX([[0, 0, 0, 1]]))


def _axes(assembly: Assembly) -> list[SX]:
    """Rotations (3 x 3) from the working axes of each joint's body to base axes."""
    axes = [assembly.turn.T]
    for joint in assembly.joints:
        axes.append(joint.forth(axes[-1].T).T)
    return axes[1:]


def _newton_euler(assembly: Assembly, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) of a motion; zeros among the arguments cost nothing."""
    spin, turning, acceleration = SX.zeros(3), SX.zeros(3), -assembly.turn @ g
    gradient = SX.zeros(3, 3)
    loads = []
    for joint in assembly.joints:
        own = joint.rate * qd[joint.coordinate]
        own_rate = joint.rate * qdd[joint.coordinate] + joint.bend * qd[joint.coordinate] ** 2
        acceleration, before = joint.forth(acceleration), joint.forth(spin)
        spin = before + joint.axis * own
        turning = joint.forth(turning) + ca.cross(before, joint.axis) * own + joint.axis * own_rate
        if joint.turn is None:
            gradient = _spun(gradient, before, spin, own, own_rate)
        else:
            gradient = ca.skew(turning) + ca.skew(spin) @ ca.skew(spin)
        body = joint.body
        loads.append((gradient @ body.first, _swirl(gradient, body.second) + ca.cross(body.first, acceleration)))
        acceleration = acceleration + gradient @ joint.offset

    torques = SX.zeros(qd.numel())
    force, moment = SX.zeros(3), SX.zeros(3)
    for joint, (own_force, own_moment) in reversed(list(zip(assembly.joints, loads))):
        moment = own_moment + moment + ca.cross(joint.offset, force)
        force = own_force + force
        torques[joint.coordinate] += joint.rate * ca.dot(joint.axis, moment)
        force, moment = joint.back(force), joint.back(moment)
    return torques


def _spun(gradient: SX, before: SX, spin: SX, own: SX, own_rate: SX) -> SX:
    """The acceleration gradient (3 x 3) of a body that turns by `own` about z faster than one with `gradient`.

    The gradient takes a vector fixed in the body to its second derivative in time. An additional turn about z leaves the derivative of
    z itself alone, so this is cheaper than starting from the spin.
    """
    x, y, _ = ca.vertsplit(before)
    inward = own * (before[2] + spin[2])
    return gradient + ca.vertcat(
        ca.horzcat(-inward, -own_rate, 0), ca.horzcat(own_rate, -inward, 0), ca.horzcat(2 * x * own, 2 * y * own, 0))


def _swirl(gradient: SX, second: SX) -> SX:
    """Moment of the inertia forces of a body about its joint: integral of r x (gradient r) dm."""
    moment = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        moment.append(gradient[k, j] * second[j, j] - gradient[j, k] * second[k, k]
                      + (gradient[k, k] - gradient[j, j]) * second[j, k]
                      + gradient[k, i] * second[i, j] - gradient[j, i] * second[i, k])
    return ca.vertcat(*moment)


def _mass_matrix(assembly: Assembly, n: int) -> SX:
    """Composite bodies: the force that a unit acceleration of one joint needs, felt by all joints before."""
    joints, mass = assembly.joints, SX.zeros(n, n)
    beyond = Moments(SX(0), SX.zeros(3), SX.zeros(3, 3))
    for last in reversed(range(len(joints))):
        joint = joints[last]
        beyond = joint.body + beyond.moved(joint.offset)
        force, moment = ca.cross(joint.axis, beyond.first), beyond.inertia(joint.axis)
        _gather(mass, joint, joint, ca.dot(joint.axis, moment))
        for i in reversed(range(last)):
            force, moment = joints[i + 1].back(force), joints[i + 1].back(moment)
            moment = moment + ca.cross(joints[i].offset, force)
            _gather(mass, joints[i], joint, ca.dot(joints[i].axis, moment))
        beyond = joint.body_back(beyond)
    return ca.triu2symm(ca.triu(mass))


def _gather(mass: SX, one, other, entry: SX) -> None:
    """Add what a pair of chain joints contributes to the upper triangle of M."""
    entry = one.rate * other.rate * entry
    i, j = sorted((one.coordinate, other.coordinate))
    mass[i, j] += 2 * entry if i == j and one is not other else entry


def _coriolis_matrix(assembly: Assembly, qd: SX) -> SX:
    joints, n = assembly.joints, qd.numel()
    motions = []
    spin, velocity = SX.zeros(3), SX.zeros(3)
    for joint in joints:
        spin, velocity = joint.forth(spin) + joint.axis * (joint.rate * qd[joint.coordinate]), joint.forth(velocity)
        motions.append((spin, velocity))
        velocity = velocity + ca.cross(spin, joint.offset)

    coriolis = SX.zeros(n, n)
    beyond = Moments(SX(0), SX.zeros(3), SX.zeros(3, 3))
    momentum, whirl = SX.zeros(3), SX.zeros(3, 3)
    for last in reversed(range(len(joints))):
        joint, (spin, velocity) = joints[last], motions[last]
        whirl = whirl + momentum @ joint.offset.T + velocity @ joint.body.first.T + ca.skew(spin) @ joint.body.second
        momentum = momentum + ca.cross(spin, joint.body.first)
        beyond = joint.body + beyond.moved(joint.offset)
        tilting = ca.cross(spin, joint.axis)
        force2, moment2 = ca.cross(joint.axis, beyond.first), beyond.inertia(joint.axis)
        force1 = ca.cross(tilting, beyond.first) + ca.cross(joint.axis, momentum)
        moment1 = (beyond.inertia(tilting) + ca.trace(whirl) * joint.axis - whirl @ joint.axis
                   - ca.cross(beyond.first, ca.cross(joint.axis, velocity)))
        moment3 = ca.trace(whirl) * joint.axis - whirl.T @ joint.axis
        bend = joint.bend * qd[joint.coordinate]
        for i in reversed(range(last + 1)):
            one, (spin, velocity) = joints[i], motions[i]
            if i < last:
                force1, moment1, force2, moment2, moment3 = map(joints[i + 1].back, (force1, moment1, force2, moment2, moment3))
                moment1 = moment1 + ca.cross(one.offset, force1)
                moment2 = moment2 + ca.cross(one.offset, force2)
            mass = ca.dot(one.axis, moment2)
            coriolis[one.coordinate, joint.coordinate] += one.rate * (
                joint.rate * ca.dot(one.axis, moment1) + mass * bend)
            if i < last:
                entry = (ca.dot(ca.cross(spin, one.axis), moment2) - ca.dot(ca.cross(one.axis, velocity), force2)
                         + ca.dot(one.axis, moment3))
                coriolis[joint.coordinate, one.coordinate] += joint.rate * (
                    one.rate * entry + mass * one.bend * qd[one.coordinate])
        beyond, momentum = joint.body_back(beyond), joint.back(momentum)
        whirl = joint.back(joint.back(whirl).T).T
    return coriolis


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
