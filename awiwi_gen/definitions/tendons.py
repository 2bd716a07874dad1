"""Tendon lengths of a finger and what follows from them by differentiation (eq. 5.5 to 5.13, 5.20 to 5.23).

h are the lengths of the tendons' paths in the finger, and P = dh/dq. Tendons pull, so forces f cause the joint torques
tau = -P' f. The joint stiffness is -d tau/dq.
"""

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.kinematics import joint_angles, joint_frames
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.structure import Finger, radius, sense


def tendon_lengths(finger: Finger, q: Matrix) -> Matrix:
    """Path lengths h (m) [m]: arcs on pulleys (eq. 5.5) and straight spans of tensegrity joints (eq. 5.20, 5.22)."""
    return _lengths(finger, q, Derivation())


def coupling(finger: Finger, q: Matrix) -> Matrix:
    """P = dh/dq (m x n) [m/rad] (eq. 5.6)."""
    return _coupling(finger, q, Derivation())


def coupling_derivative(finger: Finger, q: Matrix) -> list[Matrix]:
    """d2h/dq2: one symmetric matrix (n x n) [m/rad^2] per tendon."""
    derivation = Derivation()
    return _second_derivatives(_coupling(finger, q, derivation), q, derivation)


def joint_torque(finger: Finger, q: Matrix, f: Matrix) -> Matrix:
    """Joint torques -P' f (n) [N m] of tendon forces f (m) [N] (eq. 5.8); a tendon does work as it gets shorter."""
    return -coupling(finger, q).T * f


def joint_stiffness(finger: Finger, q: Matrix, f: Matrix, k: Matrix) -> Matrix:
    """-d tau/dq (n x n) [N m/rad]: P' diag(k) P + sum of f_i d2h_i/dq2, with k (m) [N/m] (eq. 5.12, 5.23)."""
    return joint_torque_and_stiffness(finger, q, f, k)[1]


def joint_torque_and_stiffness(finger: Finger, q: Matrix, f: Matrix, k: Matrix) -> tuple[Matrix, Matrix]:
    """Joint torques (n) [N m] and -d tau/dq (n x n) [N m/rad], from one derivation of P."""
    derivation = Derivation()
    p = _coupling(finger, q, derivation)
    hessians = _second_derivatives(p, q, derivation)
    geometric = (force * hessian for force, hessian in zip(f, hessians, strict=True))
    return -p.T * f, sum(geometric, p.T * sympy.diag(*k) * p)


def _lengths(finger: Finger, q: Matrix, derivation: Derivation) -> Matrix:
    angles, frames = joint_angles(finger, q), joint_frames(finger, q, derivation)
    lengths: list[Expr] = []
    for tendon in finger.tendons:
        length = tendon.rest
        for over in tendon.over:
            sign, joint = sense(over)
            length += sign * radius(finger, joint) * angles[joint]
        if tendon.span is not None:
            span = frames[tendon.span.joint].point(Matrix(tendon.span.to)) - Matrix(tendon.span.from_)
            length += derivation.name(sympy.sqrt(sum(x**2 for x in derivation.name_all(span))))
        lengths.append(length)
    return Matrix(lengths)


def _coupling(finger: Finger, q: Matrix, derivation: Derivation) -> Matrix:
    h = _lengths(finger, q, derivation)
    return Matrix(len(h), len(q), lambda i, j: derivation.partial(h[i], q[j]))


def _second_derivatives(p: Matrix, q: Matrix, derivation: Derivation) -> list[Matrix]:
    def hessian(row: Matrix) -> Matrix:
        return Matrix(len(q), len(q), lambda j, k: derivation.partial(row[min(j, k)], q[max(j, k)]))

    return [hessian(p.row(i)) for i in range(p.rows)]
