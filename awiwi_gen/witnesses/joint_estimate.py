"""Joint angles from tendon lengths, and their errors, by QR factorisation.

Where tendons are fewer than joints, the springs of joints are beside tendons of some stiffness w, which makes the energy
positive definite; forces that act at once leave these tendons without stretch, so that w does not matter.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import (
    Finger,
    determined,
    independent,
    leaders,
    resting,
    resting_parts,
    rests_in_a_bend,
    straight,
)
from awiwi_gen.witnesses.joints import passive_springs
from awiwi_gen.witnesses.tendons import coupling, resting_balance, tendon_lengths

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
    missing = h - rest
    joints, tendons = determined(finger)
    if joints:
        Q, R = _gram_schmidt(P[tendons, joints])
        about[joints] = _solve_upper(R, Q.T @ missing[tendons])
    torques = ca.substitute(passive_springs(finger, at), at, SX.zeros(at.numel()))
    for joints, tendons in resting_parts(finger):
        if not tendons:
            about[joints] = -torques[joints] / _springs(finger, P)[joints]
            continue
        stiff = _stiffness(finger, P, joints, tendons)
        pulls = stiff * P[tendons, joints].T @ missing[tendons]
        fit = _fit(finger, tendons) @ missing[tendons]
        found = _eliminate(*_energy(finger, P, joints, tendons), ca.vertcat(pulls - torques[joints], fit))
        about[joints] = found[: len(joints), :]
    return about


def joint_estimate_error(finger: Finger, q: SX, noise: SX) -> tuple[SX, SX]:
    """Covariance (n x n) [rad^2] and worst errors (n) [rad], from R alone: (P'P)^-1 = R^-1 R^-T; zero where measured."""
    P = coupling(finger, q)
    if rests_in_a_bend(finger):
        slopes = _slopes_at_rest(finger, P, q)
        return noise**2 * slopes @ slopes.T, noise * ca.sum2(ca.fabs(slopes))
    covariance, worst = SX.zeros(q.numel(), q.numel()), SX.zeros(q.numel())
    joints, tendons = determined(finger)
    if joints:
        Q, R = _gram_schmidt(P[tendons, joints])
        inverse = _solve_upper(R, SX.eye(len(joints)))
        covariance[joints, joints] = noise**2 * inverse @ inverse.T
        worst[joints] = noise * ca.sum2(ca.fabs(inverse @ Q.T))
    for joints, tendons in resting_parts(finger):
        if tendons:
            pulls = _stiffness(finger, P, joints, tendons) * P[tendons, joints].T
            left = _eliminate(*_energy(finger, P, joints, tendons), ca.vertcat(pulls, _fit(finger, tendons)))
            covariance[joints, joints] = noise**2 * left[: len(joints), :] @ left[: len(joints), :].T
            worst[joints] = noise * ca.sum2(ca.fabs(left[: len(joints), :]))
    return covariance, worst


def _slopes_at_rest(finger: Finger, P: SX, q: SX) -> SX:
    """Derivatives (n x m) [rad/m] of the angles of a finger that rests at q by its tendon lengths.

    The forces are the projection of the springs' torque on the tendons' arms, by Q R of these; they bend the energy, to
    which tendons with a stiffness are added, as above.
    """
    slopes, every, f = SX.zeros(q.numel(), P.size1()), SX.eye(P.size1()), SX.sym("f", P.size1())
    (known, lengths), (joints, tendons) = determined(finger), resting(finger)
    if known:
        Q, R = _gram_schmidt(P[lengths, known])
        slopes[known, lengths] = _solve_upper(R, Q.T)
    missing, hessian = resting_balance(finger, q, f)
    forces = SX.zeros(f.numel())
    if tendons:
        Q, R = _gram_schmidt(P[tendons, joints].T)
        forces[tendons] = -_solve_upper(R, Q.T @ ca.substitute(missing, f, SX.zeros(f.numel()))[joints])
    hessian = ca.substitute(hessian, f, forces)
    right = -hessian[joints, known] @ slopes[known, :] if known else SX.zeros(len(joints), f.numel())
    stiff, arms, dh = SX(0), SX.zeros(0, len(joints)), SX.zeros(0, f.numel())
    if tendons:
        arms, dh = P[tendons, joints], every[tendons, :]
        stiff = finger.strings[0].spring.stiffness if finger.strings else _stiffness(finger, P, joints, tendons)
    pulled = stiff * arms.T @ dh if tendons else SX.zeros(len(joints), f.numel())
    found = _eliminate(hessian[joints, joints] + stiff * arms.T @ arms, arms, ca.vertcat(right + pulled, dh))
    slopes[joints, :] = found[: len(joints), :]
    return slopes


def _stiffness(finger: Finger, P: SX, joints: list[int], tendons: list[int]) -> SX:
    """A stiffness [N/m] for tendons: what turns the joints with springs as these do, or moves them if the first slides."""
    K, free = _springs(finger, P)[joints], [link for link in finger.links if link.joint not in leaders(finger)]
    first = next((j for place, j in enumerate(joints) if not K[place].is_zero()), joints[0])
    alike = [place for place, j in enumerate(joints) if free[j].slides == free[first].slides]
    return ca.sum1(K[alike]) / ca.sumsqr(P[tendons, joints][:, alike])


def _springs(finger: Finger, P: SX) -> SX:
    """Stiffness (n) [N m/rad] of the springs of each independent joint."""
    at = SX.sym("q", P.size2())
    return ca.diag(ca.jacobian(passive_springs(finger, at), at))


def _energy(finger: Finger, P: SX, joints: list[int], tendons: list[int]) -> tuple[SX, SX]:
    """Second derivatives of the energy of springs and stiff tendons by the angles, and the rows of the lengths."""
    arms = P[tendons, joints]
    stiff = _stiffness(finger, P, joints, tendons)
    return ca.diag(_springs(finger, P)[joints]) + stiff * arms.T @ arms, _fit(finger, tendons) @ arms


def _fit(finger: Finger, tendons: list[int]) -> SX:
    """C' (r x m), where C has the arms of all tendons by those of r independent ones: the rows of a least-squares fit.

    Each row is times a number that leaves integers, which CasADi does not round.
    """
    rows: list[SX] = []
    for weights in zip(*independent(finger, tendons)[1], strict=True):
        times = math.lcm(*(each.denominator for each in weights))
        rows.append(ca.horzcat(*(SX(int(times * each)) for each in weights)))
    return ca.vertcat(*rows)


def _eliminate(hessian: SX, arms: SX, right: SX) -> SX:
    """Solution of [[hessian, arms'], [arms, 0]] x = right by elimination: angles first, then forces."""
    size = hessian.size1() + arms.size1()
    A, x = SX.zeros(size, size), SX(right)
    A[: hessian.size1(), :] = ca.horzcat(hessian, arms.T)
    A[hessian.size1() :, : hessian.size1()] = arms
    for k in range(size):
        for i in range(k + 1, size):
            factor = A[i, k] / A[k, k]
            for j in range(k + 1, size):
                A[i, j] -= factor * A[k, j]
            x[i, :] -= factor * x[k, :]
    return _solve_upper(A, x)


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
