"""Tendon lengths of a finger and what follows from them by differentiation (eq. 5.5 to 5.13, 5.20 to 5.23).

h are the lengths of the tendons' paths in the finger, and P = dh/dq. Tendons pull, so forces f cause the joint torques
tau = -P' f. The joint stiffness is -d tau/dq. These are the tendons that motors pull; elastic return strings have a
function of their own. Where a motor pulls several tendons, these count as one: its length is a constant combination of
theirs.
"""

from collections.abc import Iterable
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.inside_wraps import bent_length
from awiwi_gen.definitions.joints import spring_energy
from awiwi_gen.definitions.kinematics import frames, joint_angles, joint_frames
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.wraps import seen_from_body, wrapped_length
from awiwi_gen.structure import Finger, link_number, radius, sense

Tendon = Any


def tendon_lengths(finger: Finger, q: Matrix) -> Matrix:
    """Path lengths h (m) [m]: arcs on pulleys (eq. 5.5), straight lines (eq. 5.20, 5.22), and lines round bodies."""
    return _of_motors(finger, q, Derivation())


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


def return_torque(finger: Finger, q: Matrix) -> tuple[Matrix, Expr]:
    """Joint torques (n) [N m] of the elastic return strings, -P' F, and their energy [J].

    A string pulls with F = stiffness * stretch, where the stretch is its length beyond its rest, or zero if it is slack.
    """
    derivation = Derivation()
    lengths = _lengths(finger, finger.strings, q, derivation)
    tau, energy = sympy.zeros(len(q), 1), sympy.S.Zero
    for length, string in zip(lengths, finger.strings, strict=True):
        beyond = derivation.name(length - string.spring.rest)
        stretch = derivation.name((beyond + abs(beyond)) / 2)
        tau -= string.spring.stiffness * stretch * Matrix([derivation.partial(length, angle) for angle in q])
        energy += string.spring.stiffness * stretch**2 / 2
    return tau, energy


def resting_balance(finger: Finger, q: Matrix, f: Matrix) -> tuple[Matrix, Matrix]:
    """Gradient (n) [N m] by the angles of the energy of springs and strings plus f'h, and its Hessian (n x n) [N m/rad].

    Strings are as in `return_torque`; where one becomes taut, the Hessian jumps.
    """
    derivation, n = Derivation(), len(q)
    smooth = spring_energy(finger, q) + _of_motors(finger, q, derivation).dot(f)
    balance = Matrix([derivation.partial(smooth, angle) for angle in q])
    slope = Matrix(n, n, lambda j, k: derivation.partial(balance[min(j, k)], q[max(j, k)]))
    for length, string in zip(_lengths(finger, finger.strings, q, derivation), finger.strings, strict=True):
        beyond = derivation.name(length - string.spring.rest)
        pull = derivation.name(string.spring.stiffness * (beyond + abs(beyond)) / 2)
        rate = derivation.name(string.spring.stiffness * (1 + sympy.sign(beyond)) / 2)
        arms = Matrix([derivation.partial(length, angle) for angle in q])
        (bends,) = _second_derivatives(arms.T, q, derivation)
        balance += pull * arms
        slope += rate * arms * arms.T + pull * bends
    return balance, slope


def _lengths(finger: Finger, tendons: Iterable[Tendon], q: Matrix, derivation: Derivation) -> Matrix:
    angles, before = joint_angles(finger, q), joint_frames(finger, q, derivation)
    links = frames(finger, q, derivation)[:-1]  # the base, then the frames of the links

    def length_of(run: Any) -> Expr:
        if run.body is not None:
            length = bent_length if run.body.inside else wrapped_length
            return length(seen_from_body(finger, run, links, derivation), derivation)
        one, other = link_number(finger, run.start.link), link_number(finger, run.end.link)
        start, end = Matrix(run.start.at), Matrix(run.end.at)
        line = end - start if one == other else links[other + 1].point(end) - links[one + 1].point(start)
        return derivation.name(sympy.sqrt(sum(x**2 for x in derivation.name_all(line))))

    lengths: list[Expr] = []
    for tendon in tendons:
        length = tendon.rest
        for over in tendon.over:
            sign, joint = sense(over)
            length += sign * radius(finger, joint) * angles[joint]
        length += sum(arm * angles[joint] for joint, arm in tendon.arms.items())
        if tendon.span is not None:
            span = before[tendon.span.joint].point(Matrix(tendon.span.to)) - Matrix(tendon.span.from_)
            length += derivation.name(sympy.sqrt(sum(x**2 for x in derivation.name_all(span))))
        length += sum(run.counted(length_of(run)) for run in tendon.runs)
        lengths.append(length)
    return Matrix(len(lengths), 1, lengths)


def _of_motors(finger: Finger, q: Matrix, derivation: Derivation) -> Matrix:
    """Lengths h (m) [m] of what each motor pulls: a constant matrix times those of the tendons."""
    lengths = _lengths(finger, finger.pulled, q, derivation)
    shares = sympy.zeros(len(finger.transmissions), len(lengths))
    for row, transmission in enumerate(finger.transmissions):
        for member, ratio in zip(transmission.members, transmission.ratios or [1], strict=True):
            shares[row, member] = ratio
    return shares * lengths


def _coupling(finger: Finger, q: Matrix, derivation: Derivation) -> Matrix:
    h = _of_motors(finger, q, derivation)
    return Matrix(len(h), len(q), lambda i, j: derivation.partial(h[i], q[j]))


def _second_derivatives(p: Matrix, q: Matrix, derivation: Derivation) -> list[Matrix]:
    def hessian(row: Matrix) -> Matrix:
        return Matrix(len(q), len(q), lambda j, k: derivation.partial(row[min(j, k)], q[max(j, k)]))

    return [hessian(p.row(i)) for i in range(p.rows)]
