"""Joint angles from tendon lengths, and their errors, by QR factorisation."""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, straight, unmeasured
from awiwi_gen.witnesses.tendons import coupling, tendon_lengths

Hand = Any


def measured_lengths(hand: Hand, theta: SX, x: SX, w: SX | None = None) -> SX:
    """Lengths h (m) [m] for which the elongation h + w + r theta - l0 is x (eq. 5.1): one step of Newton's method
    from zero, exact as the equation is linear."""
    fingers = hand.fingers.values()
    slack = ca.vertcat(*(tendon_lengths(finger, ca.vertcat(*map(SX, straight(finger)))) for finger in fingers))
    h = SX.sym("h", slack.numel())
    wound = hand.motor.pulley * theta
    excess = h + wound - slack - x + (0 if w is None else w)
    return -ca.solve(ca.jacobian(excess, h), ca.substitute(excess, h, SX.zeros(h.numel())))


def joint_estimate(finger: Finger, h: SX, start: SX, measured: SX | None = None) -> SX:
    """Joint angles (n) [rad] whose lengths are nearest to h (m) [m]: R^-1 Q' (h - h(0)) (eq. 5.15, mended).

    Joints with a sensor move the point about which lengths are linear: they are at their `measured` angles there.
    """
    at, about = SX.sym("q", start.numel()), SX.zeros(start.numel())
    if measured is not None:
        about[list(finger.measured)] = measured
    P, rest = (ca.substitute(e, at, about) for e in (coupling(finger, at), tendon_lengths(finger, at)))
    Q, R = _gram_schmidt(P[:, unmeasured(finger)])
    about[unmeasured(finger)] = _solve_upper(R, Q.T @ (h - rest))
    return about


def joint_estimate_error(finger: Finger, q: SX, noise: SX) -> tuple[SX, SX]:
    """Covariance (n x n) [rad^2] and worst errors (n) [rad], from R alone: (P'P)^-1 = R^-1 R^-T; zero where measured."""
    free = unmeasured(finger)
    Q, R = _gram_schmidt(coupling(finger, q)[:, free])
    inverse, covariance, worst = _solve_upper(R, SX.eye(len(free))), SX.zeros(q.numel(), q.numel()), SX.zeros(q.numel())
    covariance[free, free] = noise**2 * inverse @ inverse.T
    worst[free] = noise * ca.sum2(ca.fabs(inverse @ Q.T))
    return covariance, worst


def _gram_schmidt(P: SX) -> tuple[SX, SX]:
    """P = Q R column by column; R (n x n) is upper triangular."""
    n = P.shape[1]
    Q, R = SX(P), SX.zeros(n, n)
    for j in range(n):
        for i in range(j):
            R[i, j] = Q[:, i].T @ Q[:, j]
            Q[:, j] -= R[i, j] * Q[:, i]
        R[j, j] = ca.sqrt(Q[:, j].T @ Q[:, j])
        Q[:, j] /= R[j, j]
    return Q, R


def _solve_upper(R: SX, b: SX) -> SX:
    """R^-1 b by back substitution."""
    x = SX(b)
    for i in reversed(range(R.shape[0])):
        for j in range(i + 1, R.shape[0]):
            x[i, :] -= R[i, j] * x[j, :]
        x[i, :] /= R[i, i]
    return x
