"""Joint angles from tendon lengths, and their errors, by normal equations and cofactors."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Matrix

from awiwi_gen.definitions.dynamics.lagrange import cofactor_matrix
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.tendons import coupling, tendon_lengths
from awiwi_gen.structure import Finger, straight, unmeasured

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
    """
    q = sympy.zeros(len(start), 1)
    for index, angle in zip(finger.measured, [] if measured is None else measured, strict=True):
        q[index] = angle
    left, _ = _left_inverse(_of_unmeasured(finger, coupling(finger, start)))  # the coupling is constant
    for index, angle in zip(unmeasured(finger), left * (h - tendon_lengths(finger, q)), strict=True):
        q[index] = angle
    return q


def joint_estimate_error(finger: Finger, q: Matrix, noise: Any) -> tuple[Matrix, Matrix]:
    """Error of the estimate at q: covariance (n x n) [rad^2] for independent errors of the lengths with
    standard deviation `noise` [m], and worst errors (n) [rad] for errors of at most `noise`; zero for joints with a sensor.
    """
    left, inverse = _left_inverse(_of_unmeasured(finger, coupling(finger, q)))
    covariance, worst = sympy.zeros(len(q), len(q)), sympy.zeros(len(q), 1)
    for row, index in enumerate(unmeasured(finger)):
        worst[index] = noise[0] * sum(abs(entry) for entry in left.row(row))
        for column, other in enumerate(unmeasured(finger)):
            covariance[index, other] = noise[0] ** 2 * inverse[row, column]
    return covariance, worst


def _of_unmeasured(finger: Finger, P: Matrix) -> Matrix:
    """The columns of P of the joints without a sensor."""
    return P.extract(list(range(P.rows)), unmeasured(finger))


def _left_inverse(P: Matrix) -> tuple[Matrix, Matrix]:
    """(P'P)^-1 P' and (P'P)^-1."""
    derivation = Derivation()
    P = derivation.name_all(P)
    normal = derivation.name_all(P.T * P)
    cofactors = derivation.name_all(cofactor_matrix(normal, derivation))
    determinant = derivation.name((normal.row(0) * cofactors.row(0).T)[0])
    inverse = derivation.name_all(cofactors.T / determinant)
    return inverse * P.T, inverse
