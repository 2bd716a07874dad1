"""Optimal tendon forces for one demand at 256 bits: Newton's method with a derivative in floats."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb

Array = np.ndarray[Any, Any]

SINGULAR = 1e-9  # singular values below this share of the largest count as zero


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
        self.P = [P[i * n : i * n + n] for i in range(len(f))]
        self.dP = [dP[i * n * n : (i + 1) * n * n] for i in range(len(f))]
        self.tau = [arb(float(x)) for x in tau]
        self.K = [arb(float(x)) for x in (K.astype(np.float64) + K.T.astype(np.float64)).flat]
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
        self.inverse = _inverse(matrix)
        self.multipliers = [arb(0)] * rank

    def torque(self, f: list[arb]) -> list[arb]:
        """The joint torque (n) of forces f (m)."""
        return [-sum((p[j] * force for p, force in zip(self.P, f, strict=True)), arb(0)) for j in range(self.n)]

    def stiffness(self, f: list[arb], k: list[arb]) -> list[arb]:
        """The joint stiffness (n n), row by row, of forces f (m) that give the tendons the stiffness k (m)."""
        n, m = range(self.n), range(len(f))
        return [
            sum((k[i] * self.P[i][a] * self.P[i][b] + f[i] * self.dP[i][a * self.n + b] for i in m), arb(0))
            for a in n
            for b in n
        ]

    def improved(self, f: list[arb], k: list[arb], slope: list[arb]) -> list[arb]:
        """Forces after one Newton step."""
        n = range(self.n)
        excess = [found - twice / 2 for found, twice in zip(self.stiffness(f, k), self.K, strict=True)]
        torque = self.torque(f)
        misses = [
            sum((excess[a * self.n + b] * (slope[i] * self.P[i][a] * self.P[i][b] + self.dP[i][a * self.n + b])
                 for a in n for b in n), arb(0))
            + sum((self.P[i][j] * multiplier for j, multiplier in zip(self.rows, self.multipliers, strict=True)), arb(0))
            for i in self.free
        ]  # fmt: skip
        misses += [self.tau[j] - torque[j] for j in self.rows]
        steps = [
            sum((arb(float(x)) * miss for x, miss in zip(row, misses, strict=True)), arb(0)) for row in self.inverse
        ]
        self.multipliers = [
            (multiplier - step).mid()
            for multiplier, step in zip(self.multipliers, steps[len(self.free) :], strict=True)
        ]
        change = dict(zip(self.free, steps, strict=False))
        return [(force - change[i]).mid() if i in change else force for i, force in enumerate(f)]


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
