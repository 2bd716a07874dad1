"""Tendons of a finger by automatic differentiation: torques and stiffnesses are derivatives of an energy.

Only the lengths are written down. The end points of straight spans come from the recursion along the chain.
"""

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, coordinates, leaders, radius, sense
from awiwi_gen.witnesses.kinematics import point_before_joint


def tendon_lengths(finger: Finger, q: SX) -> SX:
    """Path lengths h (m) [m] (eq. 5.5, 5.20, 5.22)."""
    position, follows = coordinates(finger), leaders(finger)
    lengths = []
    for tendon in finger.tendons:
        length = SX(tendon.rest)
        for over in tendon.over:
            sign, joint = sense(over)
            # The coupling tendon makes the arcs on the follower's and the leader's pulley equal.
            length += sign * radius(finger, follows.get(joint, joint)) * q[position[joint]]
        if tendon.span is not None:
            end = point_before_joint(finger, q, tendon.span.joint, ca.vertcat(*tendon.span.to))
            length += ca.norm_2(end - ca.vertcat(*tendon.span.from_))
        lengths.append(length)
    return ca.vertcat(*lengths)


def coupling(finger: Finger, q: SX) -> SX:
    """P = dh/dq (m x n) [m/rad] (eq. 5.6)."""
    return ca.densify(ca.jacobian(tendon_lengths(finger, q), q))


def coupling_derivative(finger: Finger, q: SX) -> list[SX]:
    """d2h/dq2: one symmetric matrix (n x n) [m/rad^2] per tendon."""
    return [ca.densify(ca.hessian(length, q)[0]) for length in ca.vertsplit(tendon_lengths(finger, q))]


def joint_torque(finger: Finger, q: SX, f: SX) -> SX:
    """Joint torques (n) [N m] of tendon forces f (m) [N]: gradient of the tendons' work -f h (eq. 5.8)."""
    return -ca.densify(ca.gradient(ca.dot(f, tendon_lengths(finger, q)), q))


def joint_stiffness(finger: Finger, q: SX, f: SX, k: SX) -> SX:
    """-d tau/dq (n x n) [N m/rad] (eq. 5.12, 5.23): Hessian of the energy in tendons of stiffnesses k (m) [N/m]."""
    h = tendon_lengths(finger, q)
    fixed = SX.sym("fixed", h.numel())
    stretch = h - fixed
    energy = ca.dot(f, stretch) + ca.dot(k, stretch**2) / 2
    stiffness = ca.substitute(ca.hessian(energy, q)[0], fixed, h)
    # The stretch is zero now; CasADi simplifies it only when the expression is evaluated again after cse.
    arguments = ca.symvar(stiffness)
    return ca.densify(ca.Function("stiffness", arguments, [ca.cse(stiffness)])(*arguments))


def joint_torque_and_stiffness(finger: Finger, q: SX, f: SX, k: SX) -> tuple[SX, SX]:
    """Joint torques (n) [N m] and stiffness (n x n) [N m/rad]: gradient and Hessian of the same energy."""
    return joint_torque(finger, q, f), joint_stiffness(finger, q, f, k)
