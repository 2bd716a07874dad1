"""Dynamics of a finger by recursion along the chain, the route with the fewest operations.

A finger whose last joints are parallel is a planar chain in a rotating plane (`planar_chain`). For all others, torques
come from Newton's and Euler's equations, and the mass matrix and the Coriolis matrix from composite bodies. Where no axis
is parallel or at a quarter turn to the next (`skew_chain`), torques and M are in axes of their own, and the accelerations
of many joints come from articulated bodies. What acts in the joints themselves (`joints`) is added to all.
"""

from collections.abc import Callable

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger
from awiwi_gen.witnesses.dynamics.articulated_bodies import accelerations
from awiwi_gen.witnesses.dynamics.assembly import Assembly, assemble
from awiwi_gen.witnesses.dynamics.composite_bodies import mass_and_coriolis
from awiwi_gen.witnesses.dynamics.newton_euler import torques, weight
from awiwi_gen.witnesses.dynamics.planar_chain import RotatingPlane, rotating_plane
from awiwi_gen.witnesses.dynamics.skew_chain import skew_chain, skew_mass_matrix, skew_torques, skew_weight
from awiwi_gen.witnesses.joints import armature, armature_rate, passive_torque, spring_energy

# Joints of a skew chain from which on articulated bodies take fewer operations than M and its factors do: with 8, 9 and 10
# joints 2352, 2722 and 3090 instead of 2300, 2825 and 3404. With rotors at all joints, only 10 joints take fewer.
LONG = 9
PlanarTorques = Callable[[RotatingPlane, list[SX], list[SX], SX], list[SX]]


def mass_matrix(finger: Finger, q: SX) -> SX:
    """M (n x n) [kg m^2] by composite bodies."""
    chain = skew_chain(finger, q)
    if chain is not None:
        return skew_mass_matrix(chain) + ca.diag(armature(finger, q))
    return _mass_and_coriolis(finger, assemble(finger, q), q, SX.zeros(q.numel()))[0]


def coriolis_matrix(finger: Finger, q: SX, qd: SX) -> SX:
    """C (n x n) [N m s] by Christoffel symbols, so that dM/dt - 2 C is skew-symmetric."""
    return _mass_and_coriolis(finger, assemble(finger, q), q, qd)[1]


def gravity(finger: Finger, q: SX, g: SX) -> SX:
    """Joint torques (n) [N m] that hold the finger at rest."""
    chain = skew_chain(finger, q)
    return _weight(assemble(finger, q), g, q.numel()) if chain is None else skew_weight(chain, g)


def bias(finger: Finger, q: SX, qd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion without acceleration: C qd + gravity + passive torques."""
    return _torques(finger, q, qd, SX.zeros(q.numel()), g) + _at_joints(finger, q, qd)


def inverse_dynamics(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> SX:
    """Joint torques (n) [N m] of a motion (eq. 2.4 to 2.15)."""
    return _torques(finger, q, qd, qdd, g) + armature(finger, q) * qdd + _at_joints(finger, q, qd)


def inverse_dynamics_derivatives(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> tuple[SX, SX]:
    """Partial derivatives (n x n each) of the inverse dynamics by q [N m/rad] and by qd [N m s/rad]: automatic.

    The torques are written in the form with the shortest derivatives.
    """
    tau = _torques(finger, q, qd, qdd, g, RotatingPlane.torques_to_differentiate)
    tau += armature(finger, q) * qdd + _at_joints(finger, q, qd)
    return ca.jacobian(tau, q), ca.jacobian(tau, qd)


def forward_dynamics(finger: Finger, q: SX, qd: SX, tau: SX, g: SX) -> SX:
    """Joint accelerations (n) [rad/s^2] that joint torques tau cause: M qdd = tau - bias (eq. 2.1)."""
    assembly, zero, rotors = assemble(finger, q), SX.zeros(q.numel()), armature(finger, q)
    plane, tau, chain = rotating_plane(assembly), tau - _at_joints(finger, q, qd), skew_chain(finger, q)
    if chain is not None and len(chain.links) >= LONG + (not rotors.is_zero()):
        return accelerations(chain, rotors, qd, tau, g)
    if plane is not None and all(joint.ratio.is_one() for joint in assembly.joints):
        return _solve_absolute(plane, rotors, qd, tau, g)
    return _solve(mass_matrix(finger, q), tau - _torques(finger, q, qd, zero, g))


def dynamics(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX, SX]:
    """M (n x n) [kg m^2], C (n x n) [N m s] and the gravity torques (n) [N m] of eq. 2.17."""
    assembly = assemble(finger, q)
    return *_mass_and_coriolis(finger, assembly, q, qd), _weight(assembly, g, q.numel())


def dynamics_and_torque(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> tuple[SX, SX, SX, SX]:
    """M, C and the gravity torques, and from these the joint torques (n) [N m] of a motion."""
    mass, coriolis, weight = dynamics(finger, q, qd, g)
    return mass, coriolis, weight, mass @ qdd + coriolis @ qd + weight + passive_torque(finger, q, qd)


def energy(finger: Finger, q: SX, qd: SX, g: SX) -> tuple[SX, SX]:
    """Kinetic and potential energy [J] (eq. 5.4); the potential of a mass at the base frame's origin is zero."""
    assembly = assemble(finger, q)
    potential, down = -ca.dot(g, assembly.palm_moment), assembly.base_rotation @ g
    origin = SX.zeros(3)
    for joint in assembly.joints:
        down, origin = joint.outward(down), joint.outward(origin)
        potential -= ca.dot(down, joint.body.first + joint.body.mass * origin)
        origin += joint.offset
    kinetic = _kinetic_energy(assembly, qd) + ca.dot(armature(finger, q), qd**2) / 2
    return kinetic, potential + spring_energy(finger, q)


def _kinetic_energy(assembly: Assembly, qd: SX) -> SX:
    plane = rotating_plane(assembly)
    if plane is not None:
        return plane.kinetic_energy(ca.vertsplit(_joint_jacobian(assembly, qd)[0] @ qd))
    mass = mass_and_coriolis(assembly, SX.zeros(qd.numel()))[0]
    each_pair_once = ca.triu(mass) - ca.diag(ca.diag(mass)) / 2
    return ca.dot(qd, each_pair_once @ qd)


def _mass_and_coriolis(finger: Finger, assembly: Assembly, q: SX, qd: SX) -> tuple[SX, SX]:
    mass, coriolis = _of_links(assembly, qd)
    return mass + ca.diag(armature(finger, q)), coriolis + ca.diag(armature_rate(finger, q, qd))


def _at_joints(finger: Finger, q: SX, qd: SX) -> SX:
    """Torques (n) [N m] in the joints themselves, of a motion without acceleration."""
    return passive_torque(finger, q, qd) + armature_rate(finger, q, qd) * qd


def _of_links(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    plane = rotating_plane(assembly)
    if plane is None:
        return mass_and_coriolis(assembly, qd)
    jacobian, jacobian_rate = _joint_jacobian(assembly, qd)
    mass = plane.mass() if qd.is_zero() else plane.mass_beside_coriolis()
    coriolis = plane.coriolis(ca.vertsplit(jacobian @ qd))
    joint_mass = ca.triu2symm(ca.triu(jacobian.T @ mass @ jacobian))
    return joint_mass, jacobian.T @ (coriolis @ jacobian + mass @ jacobian_rate)


def _torques(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX, planar: PlanarTorques = RotatingPlane.torques) -> SX:
    """Joint torques (n) [N m] of a motion, but for those in the joints themselves."""
    chain = skew_chain(finger, q)
    if chain is not None:
        return skew_torques(chain, qd, qdd, g)
    assembly = assemble(finger, q)
    plane = rotating_plane(assembly)
    if plane is None:
        return torques(assembly, qd, qdd, g)
    jacobian, jacobian_rate = _joint_jacobian(assembly, qd)
    speeds, rates = jacobian @ qd, jacobian @ qdd + jacobian_rate @ qd
    return jacobian.T @ ca.vertcat(*planar(plane, ca.vertsplit(speeds), ca.vertsplit(rates), g))


def _weight(assembly: Assembly, g: SX, n: int) -> SX:
    plane = rotating_plane(assembly)
    if plane is None:
        return weight(assembly, g, n)
    return _joint_jacobian(assembly, SX.zeros(n))[0].T @ ca.vertcat(*plane.gravity(g))


def _joint_jacobian(assembly: Assembly, qd: SX) -> tuple[SX, SX]:
    """Jacobian (joints x n) of the joints' angles by the coordinates, and its time derivative."""
    jacobian, jacobian_rate = SX(len(assembly.joints), qd.numel()), SX(len(assembly.joints), qd.numel())
    for index, joint in enumerate(assembly.joints):
        jacobian[index, joint.coordinate] = joint.ratio
        if not joint.ratio_derivative.is_zero():
            jacobian_rate[index, joint.coordinate] = joint.ratio_derivative * qd[joint.coordinate]
    return jacobian, jacobian_rate


def _solve_absolute(plane: RotatingPlane, rotors: SX, qd: SX, tau: SX, g: SX) -> SX:
    """Joint accelerations, solved for absolute angles: the diagonal of their mass matrix is constant.

    `rotors` (n) [kg m^2] is the armature.
    """
    n, start = qd.numel(), plane.start
    differences = SX.eye(n)
    for joint in range(start, n - 1):
        differences[joint, joint + 1] = -1
    torque = plane.absolute_bias(ca.vertsplit(qd), g)
    mass = plane.absolute_mass() + differences @ ca.diag(rotors) @ differences.T
    return differences.T @ _solve(mass, differences @ tau - ca.vertcat(*torque))


def _solve(mass: SX, torque: SX) -> SX:
    """x with M x = torque, by M = U D U' with unit upper triangular U: the first pivot, M[n, n], does not depend on q."""
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
