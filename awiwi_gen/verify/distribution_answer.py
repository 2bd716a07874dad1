"""Optimal tendon forces for one demand at 256 bits: Newton's method with a derivative in floats."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import prod
from typing import Any

import numpy as np
from flint import arb, arb_mat

from awiwi_gen.verify.samples import without_noise

Array = np.ndarray[Any, Any]
Columns = list[list[arb]]

SINGULAR = 1e-9  # singular values below this share of the largest count as zero


def demanded(
    f: Columns, k: Columns, P: Columns, dP: Columns, beyond: Sequence[tuple[Array, Array]], free: Array
) -> tuple[Array, Array]:
    """Torques (samples, n) and stiffnesses (samples, n, n) of forces and what lies beyond: exact, alike on all processors.

    Forces and stiffnesses of m tendons, P and dP row by row are balls, each a list over the samples. No tendon that is
    `free` (samples, m) has a part in the torque beyond.
    """
    m, n = len(f), len(beyond[0][0])
    stiffness = np.array([without_noise(part).ravel() for _, part in beyond]).T
    torque = [
        _without(without_noise(part), arb_mat(m, n, [column[s] for column in P]), np.flatnonzero(free[s]).tolist())
        for s, (part, _) in enumerate(beyond)
    ]

    def total(terms: Iterable[tuple[list[arb], ...]], more: Iterable[float | arb]) -> list[float]:
        products = [[prod(each, start=arb(1)) for each in zip(*factors, strict=True)] for factors in terms]
        return [float(sum(each, arb(x))) for *each, x in zip(*products, more, strict=True)]

    tau = [total(((P[i * n + a], f[i]) for i in range(m)), (-each[a] for each in torque)) for a in range(n)]
    K = [
        total(
            [
                *((k[i], P[i * n + a], P[i * n + b]) for i in range(m)),
                *((f[i], dP[(i * n + a) * n + b]) for i in range(m)),
            ],
            stiffness[a * n + b].tolist(),
        )
        for a in range(n)
        for b in range(n)
    ]
    return -np.array(tau).T, np.array(K).T.reshape(-1, n, n)


def _without(torque: Array, P: arb_mat, free: list[int]) -> list[arb]:
    """A torque (n) without what some tendons can give."""
    whole = arb_mat([[x] for x in torque.tolist()])
    rows = [P.tolist()[i] for i in free] if torque.any() else []
    rows = [rows[i] for i in _independent(np.array([[float(x) for x in row] for row in rows]).T)] if rows else []
    if rows:
        given = arb_mat(rows)
        whole = whole - given.transpose() * (given * given.transpose()).solve(given * whole)
    left: list[arb] = whole.entries()
    return left


class System:
    """The optimality conditions of one sample: a stationary Lagrange function of the free forces, and the torque.

    Forces f (m,), tendons held at limits (m,), demand tau (n,) and K (n, n), coupling P and its derivatives dP row by
    row as balls, both as floats, and k, slope and curvature of the tendons (m,) as floats.
    """

    def __init__(
        self,
        f: Array,
        held: Array,
        tau: Array,
        K: Array,
        P: list[arb],
        dP: list[arb],
        floats: tuple[Array, Array],
        curve: Any,
    ) -> None:
        n = len(tau)
        self.free, self.n = np.flatnonzero(held == 0).tolist(), n
        self.P = arb_mat(len(f), n, P)
        self.dP = arb_mat(len(f), n * n, dP)
        self.pairs = arb_mat([[a * b for a in row for b in row] for row in self.P.tolist()])
        self.tau = [arb(float(x)) for x in tau]
        symmetric = K.astype(np.float64) + K.T.astype(np.float64)
        self.K = arb_mat(n * n, 1, [arb(float(x)) / 2 for x in symmetric.flat])
        coupling, derivative = floats
        self.rows = _independent(coupling[self.free])
        k, slope, curvature = curve
        pp = np.einsum("ia,ib->iab", coupling, coupling)
        growth = slope[:, None, None] * pp + derivative
        excess = np.tensordot(k, pp, 1) + np.tensordot(f, derivative, 1) - (K + K.T) / 2
        hessian = np.einsum("iab,lab->il", growth, growth)
        hessian += np.diag(curvature * np.einsum("iab,ab->i", pp, excess))
        count, rank = len(self.free), len(self.rows)
        matrix = np.zeros((count + rank, count + rank))
        matrix[:count, :count] = hessian[np.ix_(self.free, self.free)]
        matrix[:count, count:] = coupling[np.ix_(self.free, self.rows)]
        matrix[count:, :count] = matrix[:count, count:].T
        self.inverse = arb_mat(count + rank, count + rank, [arb(float(x)) for x in _inverse(matrix).flat])
        self.multipliers = [arb(0)] * rank

    def torque(self, f: list[arb]) -> list[arb]:
        """The joint torque (n) of forces f (m)."""
        found: list[arb] = (-(self.P.transpose() * _column(f))).entries()
        return found

    def stiffness(self, f: list[arb], k: list[arb]) -> list[arb]:
        """The joint stiffness (n n), row by row, of forces f (m) that give the tendons the stiffness k (m)."""
        found: list[arb] = (self.pairs.transpose() * _column(k) + self.dP.transpose() * _column(f)).entries()
        return found

    def improved(self, f: list[arb], k: list[arb], slope: list[arb]) -> list[arb]:
        """Forces after one Newton step."""
        excess, torque = _column(self.stiffness(f, k)) - self.K, self.torque(f)
        by_pair, by_slope = (self.pairs * excess).entries(), (self.dP * excess).entries()
        prices = [arb(0)] * self.n
        for j, multiplier in zip(self.rows, self.multipliers, strict=True):
            prices[j] = multiplier
        priced = (self.P * _column(prices)).entries()
        misses = [slope[i] * by_pair[i] + by_slope[i] + priced[i] for i in self.free]
        misses += [self.tau[j] - torque[j] for j in self.rows]
        steps = (self.inverse * _column(misses)).entries()
        self.multipliers = [
            (multiplier - step).mid()
            for multiplier, step in zip(self.multipliers, steps[len(self.free) :], strict=True)
        ]
        change = dict(zip(self.free, steps, strict=False))
        return [(force - change[i]).mid() if i in change else force for i, force in enumerate(f)]


def _column(entries: list[arb]) -> arb_mat:
    return arb_mat(len(entries), 1, entries)


def _independent(P: Array) -> list[int]:
    """A largest set of joints whose torques by these tendons are independent."""
    found: list[int] = []
    for j in range(P.shape[1]):
        if len(P) and np.linalg.matrix_rank(P[:, [*found, j]], tol=1e-9) > len(found):
            found.append(j)
    return found


def _inverse(matrix: Array) -> Array:
    """The pseudo-inverse, after equilibration: patterns of forces that change nothing stay as they are."""
    largest = np.abs(matrix).max(axis=1, initial=0)
    scale = 1 / np.sqrt(np.where(largest > 0, largest, 1))
    inverse: Array = np.linalg.pinv(matrix * np.outer(scale, scale), SINGULAR, hermitian=True)
    return inverse * np.outer(scale, scale)
