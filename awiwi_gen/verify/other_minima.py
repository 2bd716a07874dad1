"""Forces that give a stiffness no small change brings nearer, though others may: what a search ends at, told in floats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

SINGULAR = 1e-9  # singular values below this share of the largest count as zero
UPHILL = 1e-6  # slopes and curvatures down by this share of the largest count as rounding


@dataclass(frozen=True)
class Found:
    """Forces f (m,) [N] of one sample, the coupling P (m, n) there and its `derivative` (m, n, n), the stiffness of the
    tendons k, its slope and curvature (m,), the symmetric demand K (n, n), the limits of all forces, and the torque
    missing (n,) [N m] where the demanded one is out of reach: tendons that it pulls against a limit stay there."""

    f: Array
    P: Array
    derivative: Array
    k: Array
    slope: Array
    curvature: Array
    K: Array
    low: float
    high: float
    missing: Array

    @property
    def held(self) -> Array:
        """(m,): -1 for forces at the lower limit, 1 at the upper one, 0 between them."""
        return np.asarray((self.f >= self.high).astype(int) - (self.f <= self.low).astype(int))

    @property
    def pairs(self) -> Array:
        """Products p p' of the couplings (m, n, n)."""
        return np.asarray(np.einsum("ia,ib->iab", self.P, self.P))

    @property
    def excess(self) -> Array:
        """Stiffness above the demand (n, n) [N m/rad]."""
        return np.asarray(np.tensordot(self.k, self.pairs, 1) + np.tensordot(self.f, self.derivative, 1) - self.K)

    @property
    def distance(self) -> float:
        """Of the stiffness from the demand [N m/rad]."""
        return float(np.linalg.norm(self.excess))

    def is_minimum(self) -> bool:
        """Whether no held force wants to leave its limit, and the distance curves up along all moves of the free ones.

        That the free ones are level is for the exact solution to tell.
        """
        growth, free = self.slope[:, None, None] * self.pairs + self.derivative, self.held == 0
        slopes = np.einsum("iab,ab->i", growth, self.excess)
        prices = np.linalg.lstsq(self.P[free], -slopes[free], rcond=None)[0]
        pinned = np.abs(self.P @ self.missing) > UPHILL * np.abs(self.P).max() * np.abs(self.missing).max(initial=0)
        leaving = np.where(pinned, 0, self.held * (slopes + self.P @ prices))
        hessian = np.einsum("iab,lab->il", growth, growth)
        hessian += np.diag(self.curvature * np.einsum("iab,ab->i", self.pairs, self.excess))
        u, sizes, _ = np.linalg.svd(self.P[free])
        moves = u[:, int(np.sum(sizes > SINGULAR * sizes[:1])) :]
        bends = np.linalg.eigvalsh(moves.T @ hessian[np.ix_(free, free)] @ moves)
        level = UPHILL * np.abs(slopes).max(initial=0)
        return bool((leaving <= level).all() and (bends >= -UPHILL * np.abs(hessian).max()).all())
