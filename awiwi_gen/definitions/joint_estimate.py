"""Joint angles from tendon lengths, and their errors, by normal equations and cofactors.

Where tendons are fewer than joints, the finger rests where the springs of its joints hold least energy. The forces f of
the tendons are unknowns beside the angles: the springs' torques and those of the tendons, -P' f, are in balance.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Matrix

from awiwi_gen.definitions.joints import spring_energy
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.symmetric_matrix import cofactor_matrix
from awiwi_gen.definitions.tendons import coupling, coupling_derivative, resting_balance, tendon_lengths
from awiwi_gen.structure import Finger, determined, independent, resting, resting_parts, rests_in_a_bend, straight

Hand = Any


def measured_lengths(hand: Hand, theta: Matrix, x: Matrix, w: Matrix | None = None) -> Matrix:
    """Lengths h (m) [m] in the fingers, h0 + x - r theta - w: minus what pulleys and wrist take up.

    Motor angles theta (m) [rad], elongations x (m) [m] and wrist sections w (m) [m] count from the straight fingers.
    """
    fingers = hand.fingers.values()
    at_start = Matrix.vstack(*(tendon_lengths(finger, Matrix(straight(finger))) for finger in fingers))
    lengths = at_start + x - hand.motor.pulley * theta
    return lengths if w is None else lengths - w


def joint_estimate(finger: Finger, h: Matrix, start: Matrix, measured: Matrix | None = None) -> Matrix:
    """Joint angles (n) [rad] whose lengths are nearest to h (m) [m], for constant couplings (eq. 5.15, mended).

    The left inverse (P'P)^-1 P' acts on the difference to the straight finger, h - h(0). No start is needed. Joints with a
    sensor have their `measured` angles instead of zero there, and the columns of P are those of the others.

    Where tendons are too few, springs of joints tell the rest, without contact, gravity and friction: K q + c + P'f = 0.
    """
    q = sympy.zeros(len(start), 1)
    for index, angle in zip(finger.measured, [] if measured is None else measured, strict=True):
        q[index] = angle
    P, missing = coupling(finger, start), h - tendon_lengths(finger, q)  # the coupling is constant
    joints, tendons = determined(finger)
    if joints:
        left, _ = _left_inverse(P.extract(tendons, joints))
        for index, angle in zip(joints, left * missing.extract(tendons, [0]), strict=True):
            q[index] = angle
    for joints, tendons in resting_parts(finger):
        tendons, shared = _merged(finger, tendons, missing)
        inverse = _balanced(finger, P, start, joints, tendons)
        energy, derivation = spring_energy(finger, start), Derivation()
        torques = Matrix([derivation.partial(energy, start[j]).subs(start[j], 0) for j in joints])
        found = inverse * Matrix.vstack(-torques, shared)
        for index, angle in zip(joints, found, strict=False):  # the forces follow
            q[index] = angle
    return q


def joint_estimate_error(finger: Finger, q: Matrix, noise: Any) -> tuple[Matrix, Matrix]:
    """Error of the estimate at q: covariance (n x n) [rad^2] for independent errors of the lengths with
    standard deviation `noise` [m], and worst errors (n) [rad] for errors of at most `noise`; zero for joints with a sensor.

    Where springs tell some angles and their balance is not linear in these, the finger rests at q, away from stops.
    """
    P = coupling(finger, q)
    if rests_in_a_bend(finger):
        slopes = _slopes_at_rest(finger, P, q)
        return noise[0] ** 2 * slopes * slopes.T, noise[0] * Matrix([sum(map(abs, row)) for row in slopes.tolist()])
    covariance, worst = sympy.zeros(len(q), len(q)), sympy.zeros(len(q), 1)

    def enter(joints: list[int], left: Matrix, square: Matrix) -> None:
        for row, index in enumerate(joints):
            worst[index] = noise[0] * sum(abs(entry) for entry in left.row(row))
            for column, other in enumerate(joints):
                covariance[index, other] = noise[0] ** 2 * square[row, column]

    joints, tendons = determined(finger)
    if joints:
        enter(joints, *_left_inverse(P.extract(tendons, joints)))
    for joints, tendons in resting_parts(finger):
        if tendons:
            chosen, shares = _merged(finger, tendons, sympy.eye(P.rows))
            left = _balanced(finger, P, q, joints, chosen)[: len(joints), len(joints) :] * shares.extract(
                list(range(len(chosen))), tendons
            )
            enter(joints, left, left * left.T)
    return covariance, worst


def _merged(finger: Finger, tendons: list[int], lengths: Matrix) -> tuple[list[int], Matrix]:
    """The independent ones of some tendons, and the lengths (or rows) of these that fit those of all best.

    If C has the rows of all by those of the independent ones, these are (C'C)^-1 C' times the lengths of all.
    """
    chosen, shares = independent(finger, tendons)
    if chosen == tendons:
        return tendons, lengths.extract(tendons, list(range(lengths.cols)))
    C = Matrix([[sympy.Rational(each.numerator, each.denominator) for each in row] for row in shares])
    return chosen, (C.T * C).inv() * C.T * lengths.extract(tendons, list(range(lengths.cols)))


def _slopes_at_rest(finger: Finger, P: Matrix, q: Matrix) -> Matrix:
    """Derivatives (n x m) [rad/m] of the angles of a finger that rests at q by its tendon lengths.

    Balance and lengths are differentiated: [[H, A'], [A, 0]] [dq, df] = [-H dq of known joints, dh]. The tendon forces f
    are those that hold the springs at q, (A A')^-1 A times their torque, and bend H.
    """
    derivation, slopes = Derivation("r"), sympy.zeros(*P.T.shape)
    (known, lengths), (joints, tendons) = determined(finger), resting(finger)
    if known:
        left, _ = _left_inverse(P.extract(lengths, known))
        for row, joint in enumerate(known):
            for column, tendon in enumerate(lengths):
                slopes[joint, tendon] = left[row, column]
    arms = P.extract(tendons, joints)
    torque, hessian = resting_balance(finger, q, sympy.zeros(P.rows, 1))
    if tendons:
        forces = derivation.name_all(-_left_inverse(arms.T)[0] * torque.extract(joints, [0]))
        bends = coupling_derivative(finger, q)
        hessian += sum(
            (force * bends[i] for force, i in zip(forces, tendons, strict=True)), sympy.zeros(*hessian.shape)
        )
    right = sympy.zeros(len(joints) + len(tendons), P.rows)
    if known:
        right[: len(joints), :] = -hessian.extract(joints, known) * slopes.extract(known, list(range(P.rows)))
    for row, tendon in enumerate(tendons, start=len(joints)):
        right[row, tendon] = 1
    inverse = _bordered_inverse(hessian.extract(joints, joints), arms, derivation)
    for joint, row in zip(joints, (inverse * right).tolist(), strict=False):
        slopes[joint, :] = Matrix([row])
    return derivation.name_all(slopes)


def _balanced(finger: Finger, P: Matrix, q: Matrix, joints: list[int], tendons: list[int]) -> Matrix:
    """Inverse of the matrix of balance and lengths, [[K, P'], [P, 0]], of a resting part.

    It maps the springs' torques at zero, negative, and lengths to angles [rad] and tendon forces [N].
    """
    derivation, energy = Derivation(), spring_energy(finger, q)
    springs = [derivation.partial(derivation.partial(energy, q[j]), q[j]) for j in joints]
    return _bordered_inverse(sympy.diag(*springs), P.extract(tendons, joints), derivation)


def _bordered_inverse(hessian: Matrix, arms: Matrix, derivation: Derivation) -> Matrix:
    """Inverse of [[H, A'], [A, 0]]."""
    corner = sympy.zeros(arms.rows, arms.rows)
    matrix = derivation.name_all(Matrix(sympy.BlockMatrix([[hessian, arms.T], [arms, corner]])))
    cofactors = derivation.name_all(cofactor_matrix(matrix, derivation))
    determinant = derivation.name(matrix.row(0).dot(cofactors.row(0)))
    return derivation.name_all(cofactors / determinant)


def _left_inverse(P: Matrix) -> tuple[Matrix, Matrix]:
    """(P'P)^-1 P' and (P'P)^-1."""
    derivation = Derivation()
    P = derivation.name_all(P)
    normal = derivation.name_all(P.T * P)
    cofactors = derivation.name_all(cofactor_matrix(normal, derivation))
    determinant = derivation.name((normal.row(0) * cofactors.row(0).T)[0])
    inverse = derivation.name_all(cofactors.T / determinant)
    return inverse * P.T, inverse
