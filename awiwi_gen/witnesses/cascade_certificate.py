"""The certificate of the cascade by minors, and by Cramer's rule on the Lyapunov equation."""

from __future__ import annotations

from math import isqrt
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.symmetric_matrix import least, pivots, symmetric


def cascade_certificate(_: Any, D: SX, P: SX, kp: SX, kd: SX, weight: SX, omega: SX) -> tuple[SX, SX, list[SX]]:
    """Margin, and S11, S12 and S22 of every force loop (m x 3), and the guards; D and P row by row."""
    n, m = isqrt(D.numel()), kp.numel()
    damping, coupling = symmetric(D, n), ca.reshape(P, n, m).T
    shares = [pivot * n / ca.fabs(ca.trace(damping)) for pivot in pivots(_least_loss(damping, coupling, weight))]
    shares += ca.vertsplit(kp / omega**2) + ca.vertsplit(kd / omega)
    rows = [_energy(p, v, weight, omega).T for p, v in zip(ca.vertsplit(kp), ca.vertsplit(kd), strict=True)]
    return least(shares), ca.vertcat(*rows), [weight, omega]


def _least_loss(damping: SX, coupling: SX, weight: SX) -> SX:
    """The quadratic form (n x n) of qd that bounds the loss of energy from below, over all force errors."""
    qd, e = SX.sym("qd", damping.shape[0]), SX.sym("e", coupling.shape[0])
    loss = ca.bilin(damping, qd, qd) + ca.dot(coupling @ qd, e) + weight * ca.dot(e, e)
    worst = ca.substitute(-ca.gradient(loss, e), e, SX.zeros(e.numel())) / ca.gradient(ca.sum1(ca.gradient(loss, e)), e)
    return ca.hessian(ca.substitute(loss, e, worst), qd)[0] / 2


def _energy(kp: SX, kd: SX, weight: SX, omega: SX) -> SX:
    """S11, S12, S22 for which the energy xi' S xi falls by weight (e^2 + e'^2 / omega^2) along the loop."""
    e, ed, S = SX.sym("e"), SX.sym("ed"), SX.sym("S", 3)
    energy = S[0] * e**2 + 2 * S[1] * e * ed + S[2] * ed**2
    rate = ca.jacobian(energy, e) * ed + ca.jacobian(energy, ed) * (-kd * ed - kp * e)
    balance = rate + weight * (e**2 + ed**2 / omega**2)
    terms = ca.vertcat(ca.gradient(ca.gradient(balance, e), e) / 2, ca.gradient(ca.gradient(balance, e), ed),
                       ca.gradient(ca.gradient(balance, ed), ed) / 2)  # fmt: skip
    matrix, rest = ca.jacobian(terms, S), -ca.substitute(terms, S, SX.zeros(3))

    def cramer(column: int) -> SX:
        columns = ca.horzsplit(matrix)
        columns[column] = rest
        return ca.det(ca.horzcat(*columns)) / ca.det(matrix)

    return ca.vertcat(*(cramer(column) for column in range(3)))
