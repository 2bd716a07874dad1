"""Kinematics and dynamics of a finger by recursion along the chain: the route that makes fast code.

Nothing is differentiated here: velocities are axes times levers, torques come from Newton and Euler, the mass
matrix and the Coriolis matrix from composite bodies.
"""

import casadi as ca
from casadi import SX

from awiwi_gen.models.assembly import Assembly, assemble
from awiwi_gen.models.composite import mass_and_coriolis
from awiwi_gen.models.newton_euler import torques, weight
from awiwi_gen.models.tree import Finger
from awiwi_gen.models.turning_plane import TurningPlane, turning_plane

_Z = SX([0, 0, 1])


def link_poses(finger: Finger, q: SX) -> list[SX]:
    """Poses (4 x 4 each) of the links' frames in the base: at their joints, after their rotations (eq. 5.2)."""
    assembly = assemble(finger, q)
    origin, poses = SX.zeros(3), {}
    for joint, axes in zip(assembly.joints, assembly.axes(), strict=True):
        poses[joint.link] = _pose(axes @ joint.rotation, origin + axes @ (joint.axis * joint.slid))
        origin = origin + axes @ joint.offset
    return list(poses.values())


def fingertip_pose(finger: Finger, q: SX) -> SX:
    """Pose (4 x 4) of the fingertip in the base (eq. 5.3)."""
    assembly = assemble(finger, q)
    axes = assembly.axes()[-1] @ assembly.joints[-1].rotation
    return _pose(axes, assembly.base_point(len(assembly.joints), SX.zeros(3)))


def jacobian(finger: Finger, q: SX) -> SX:
    """J (6 x n), in base axes: velocity [m/rad], then angular velocity [rad/rad] of the tip per unit joint velocity."""
    assembly = assemble(finger, q)
    lever, result = SX.zeros(3), SX.zeros(6, q.numel())
    for joint, axes in reversed(list(zip(assembly.joints, assembly.axes(), strict=True))):
        lever = joint.offset + lever
        column = ca.vertcat(axes @ ca.cross(joint.axis, lever), axes @ joint.axis)
        result[:, joint.coordinate] += joint.rate * column
        lever = joint.back(lever)
    return result


def pose_and_jacobian(finger: Finger, q: SX) -> tuple[SX, SX]:
    """Pose (4 x 4) of the fingertip and its Jacobian (6 x n), in base axes."""
    return fingertip_pose(finger, q), jacobian(finger, q)


def seat_point(finger: Finger, q: SX, joint: str, local: SX) -> SX:
    """Base coordinates (3) [m] of a point (3) that `joint` does not move, given in the frame it turns in."""
    assembly = assemble(finger, q)
    index = next(i for i, link in enumerate(finger.links) if link.joint == joint)
    before = [one for one in assembly.joints if one.link < index]
    local = local + _Z * assembly.joints[len(before)].slid
    if before and before[-1].turn is None:
        local = before[-1].rotation @ local
    return assembly.base_point(len(before), local)


def mass_matrix(finger: Finger, q: SX) -> SX:
    """M (n x n) [kg m^2] by composite bodies."""
    return _mass_and_coriolis(assemble(finger, q), SX.zeros(q.numel()))[0]


def coriolis_matrix(finger: Finger, q: SX, qd: SX) -> SX:
    """C (n x n) [N m s], the one with Christoffel symbols, so that dM/dt - 2 C is skew."""
    return _mass_and_coriolis(assemble(finger, q), qd)[1]


def gravity(finger: Finger, q: SX, g: SX) -> SX:
    """Joint torques (n) [N m] that hold the finger still."""
    return _weight(assemble(finger, q), g, q.numel())


def bias(finger: Finger, q: SX, qd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion without acceleration: C qd + gravity."""
    return _torques(assemble(finger, q), qd, SX.zeros(q.numel()), g)


def inverse_dynamics(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion (eq. 2.4 to 2.15)."""
    return _torques(assemble(finger, q), qd, qdd, g)


def inverse_dynamics_by_vector(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> SX:
    """The same torques with each vector of a body turned by itself: longer, but with shorter derivatives."""
    return _torques(assemble(finger, q), qd, qdd, g, once=False)


def forward_dynamics(finger: Finger, q: SX, qd: SX, tau: SX, g: SX) -> SX:
    """Joint accelerations (n) [rad/s^2] that joint torques tau cause: M qdd = tau - bias (eq. 2.1)."""
    assembly, none = assemble(finger, q), SX.zeros(q.numel())
    plane = turning_plane(assembly)
    if plane is not None and all(joint.rate.is_one() for joint in assembly.joints):
        return _solve_absolute(plane, qd, tau, g)
    return _solve(_mass_and_coriolis(assembly, none)[0], tau - _torques(assembly, qd, none, g))


def dynamics(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX, SX]:
    """M (n x n) [kg m^2], C (n x n) [N m s] and the gravity torques (n) [N m] of eq. 2.17."""
    assembly = assemble(finger, q)
    return *_mass_and_coriolis(assembly, qd), _weight(assembly, g, q.numel())


def energy(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX]:
    """Kinetic and potential energy [J] (eq. 5.4); potential zero is a mass at the origin of the base."""
    assembly = assemble(finger, q)
    potential, down = -ca.dot(g, assembly.ballast), assembly.turn @ g
    for joint in assembly.joints:
        down = joint.forth(down)
        potential -= ca.dot(down, joint.body.first)
    return _kinetic_energy(assembly, qd), potential


def _kinetic_energy(assembly: Assembly, qd: SX) -> SX:
    plane = turning_plane(assembly)
    if plane is not None:
        return plane.kinetic_energy(ca.vertsplit(_ways(assembly, qd)[0] @ qd))
    mass = mass_and_coriolis(assembly, SX.zeros(qd.numel()))[0]
    each_pair_once = ca.triu(mass) - ca.diag(ca.diag(mass)) / 2
    return ca.dot(qd, each_pair_once @ qd)


def _mass_and_coriolis(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    plane = turning_plane(assembly)
    if plane is None:
        return mass_and_coriolis(assembly, qd)
    ways, bends = _ways(assembly, qd)
    mass = plane.mass(alone=qd.is_zero())
    coriolis = plane.coriolis(ca.vertsplit(ways @ qd))
    return ca.triu2symm(ca.triu(ways.T @ mass @ ways)), ways.T @ (coriolis @ ways + mass @ bends)


def _torques(assembly: Assembly, qd: SX, qdd: SX, g: SX, once: bool = True) -> SX:
    plane = turning_plane(assembly)
    if plane is None:
        return torques(assembly, qd, qdd, g)
    ways, bends = _ways(assembly, qd)
    speeds, rates = ways @ qd, ways @ qdd + bends @ qd
    return ways.T @ ca.vertcat(*plane.torques(ca.vertsplit(speeds), ca.vertsplit(rates), g, once=once))


def _weight(assembly: Assembly, g: SX, n: int) -> SX:
    plane = turning_plane(assembly)
    if plane is None:
        return weight(assembly, g, n)
    return _ways(assembly, SX.zeros(n))[0].T @ ca.vertcat(*plane.gravity(g))


def _ways(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    """How joints follow coordinates (joints x n): their speeds per unit speed, and the rates of these."""
    ways, bends = SX(len(assembly.joints), qd.numel()), SX(len(assembly.joints), qd.numel())
    for index, joint in enumerate(assembly.joints):
        ways[index, joint.coordinate] = joint.rate
        if not joint.bend.is_zero():
            bends[index, joint.coordinate] = joint.bend * qd[joint.coordinate]
    return ways, bends


def _pose(axes: SX, origin: SX) -> SX:
    return ca.vertcat(ca.horzcat(axes, origin), SX([[0, 0, 0, 1]]))


def _solve_absolute(plane: TurningPlane, qd: SX, tau: SX, g: SX) -> SX:
    """Accelerations of the absolute angles, of whose mass matrix the diagonal is constant, and their differences."""
    n, start = qd.numel(), 1 if plane.lead else 0
    differences = SX.eye(n)
    for joint in range(start, n - 1):
        differences[joint, joint + 1] = -1
    torque = plane.torques(ca.vertsplit(qd), [SX(0)] * n, g, absolute=True)
    return differences.T @ _solve(plane.absolute_mass(), differences @ tau - ca.vertcat(*torque))


def _solve(mass: SX, torque: SX) -> SX:
    """x with M x = torque, by M = U D U' with unit upper U: the last pivot, which comes first, does not depend on q."""
    n = torque.numel()
    mass, x, upper = SX(mass), SX(torque), SX.zeros(n, n)
    inverse = [SX(0)] * n
    for k in reversed(range(n)):
        inverse[k] = 1 / mass[k, k]
        for i in range(k):
            upper[i, k] = mass[i, k] * inverse[k]
            x[i] -= upper[i, k] * x[k]
            for j in range(i, k):
                mass[i, j] -= upper[i, k] * mass[j, k]
    for k in range(n):
        x[k] *= inverse[k]
        for i in range(k):
            x[k] -= upper[i, k] * x[i]
    return x
