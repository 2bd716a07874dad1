"""Joint angles from tendon lengths, and their errors, by normal equations and cofactors.

Where tendons are fewer than joints, the finger rests where the springs of its joints hold least energy. The forces f of
the tendons are unknowns beside the angles: the springs' torques and those of the tendons, -P' f, are in balance.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Matrix

from awiwi_gen.definitions.dynamics.lagrange import cofactor_matrix
from awiwi_gen.definitions.joints import spring_energy
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.tendons import coupling, tendon_lengths
from awiwi_gen.structure import Finger, determined, resting_parts, straight

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
        inverse = _balanced(finger, P, start, joints, tendons)
        energy, derivation = spring_energy(finger, start), Derivation()
        torques = Matrix([derivation.partial(energy, start[j]).subs(start[j], 0) for j in joints])
        found = inverse * Matrix.vstack(-torques, missing.extract(tendons, [0]))
        for index, angle in zip(joints, found, strict=False):  # the forces follow
            q[index] = angle
    return q


def joint_estimate_error(finger: Finger, q: Matrix, noise: Any) -> tuple[Matrix, Matrix]:
    """Error of the estimate at q: covariance (n x n) [rad^2] for independent errors of the lengths with
    standard deviation `noise` [m], and worst errors (n) [rad] for errors of at most `noise`; zero for joints with a sensor.
    """
    P = coupling(finger, q)
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
            left = _balanced(finger, P, q, joints, tendons)[: len(joints), len(joints) :]
            enter(joints, left, left * left.T)
    return covariance, worst


def _balanced(finger: Finger, P: Matrix, q: Matrix, joints: list[int], tendons: list[int]) -> Matrix:
    """Inverse of the matrix of balance and lengths, [[K, P'], [P, 0]], of a resting part.

    It maps the springs' torques at zero, negative, and lengths to angles [rad] and tendon forces [N].
    """
    derivation, energy = Derivation(), spring_energy(finger, q)
    springs = [derivation.partial(derivation.partial(energy, q[j]), q[j]) for j in joints]
    arms = P.extract(tendons, joints)
    corner = sympy.zeros(len(tendons), len(tendons))
    matrix = derivation.name_all(Matrix(sympy.BlockMatrix([[sympy.diag(*springs), arms.T], [arms, corner]])))
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
