"""Kinematics and dynamics of a finger by recursion along the chain: the route that makes fast code.

Nothing is differentiated here: velocities are axes times levers, torques come from Newton and Euler, the mass
matrix and the Coriolis matrix from composite bodies.
"""

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger
from awiwi_gen.witnesses.dynamics.assembly import Assembly, assemble
from awiwi_gen.witnesses.dynamics.composite_bodies import mass_and_coriolis
from awiwi_gen.witnesses.dynamics.newton_euler import torques, weight
from awiwi_gen.witnesses.dynamics.planar_chain import TurningPlane, turning_plane


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


def inverse_dynamics_derivatives(finger: Finger, q: SX, qd: SX, qdd: SX, g: SX) -> tuple[SX, SX]:
    """Partial derivatives (n x n each) of the inverse dynamics by q [N m/rad] and by qd [N m s/rad]: automatic.

    They come from torques for which each vector of a body is rotated on its own: longer, but with shorter derivatives.
    """
    tau = _torques(assemble(finger, q), qd, qdd, g, once=False)
    return ca.jacobian(tau, q), ca.jacobian(tau, qd)


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
