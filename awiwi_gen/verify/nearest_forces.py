"""Local minima of the distance of a joint stiffness, over tendon forces that keep the torque, from many starts.

The distance is not convex in the forces, so a stationary point need not be the nearest. An interior-point method in
the null space of the torque goes down from random forces within the limits, for all samples and starts at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

STARTS = 16  # for each demand
WALK = 8  # random moves from the centre of the permitted forces to each start
CENTRING = 40  # Newton steps to that centre, at most
BARRIERS = 10.0 ** -np.arange(3, 13)  # weights of the limits, one after the other, relative to the distance to beat
STEPS = 4  # Newton steps for each weight
SHARES = (1.0, 0.3, 0.05, 0.0)  # of a Newton step: the best is taken
TO_LIMIT = 0.95  # share of the way to the nearest limit that a step may take


@dataclass(frozen=True)
class Demands:
    """Demands of some samples with forces f (s, m) that give their torque.

    K (s, n, n) for coupling P (s, m, n), its derivatives `slope` (s, m, n, n), limits low and high (s). Only the forces
    of a `group` of tendons change, and none that is `fixed` (s, m).
    """

    f: Array
    K: Array
    P: Array
    slope: Array
    low: Array
    high: Array
    fixed: Array
    group: list[int]

    def of(self, samples: Array) -> Demands:
        """Some of the samples."""
        f, K, P, slope = (each[samples] for each in (self.f, self.K, self.P, self.slope))
        return Demands(f, K, P, slope, self.low[samples], self.high[samples], self.fixed[samples], self.group)

    @cached_property
    def pairs(self) -> Array:
        """Products p_i p_i' (s, m, n, n) of the couplings of each tendon."""
        return np.asarray(self.P[..., :, None] * self.P[..., None, :])

    def stiffness(self, f: Array, k: Array) -> Array:
        """Joint stiffness (s, starts, n, n) of forces and stiffnesses of tendons (s, starts, m)."""
        flat = (*self.P.shape[:2], -1)
        found = k @ self.pairs.reshape(flat) + f @ self.slope.reshape(flat)
        return np.asarray(found.reshape(*f.shape[:2], *self.K.shape[1:]))


def minima(demands: Demands, curve: Callable[..., Any]) -> Array:
    """Forces (s, starts, m) at local minima of |K_q - K|; the curve gives "k", "slope" and "curvature" (m, ...).

    Samples whose limits leave no room keep their forces.
    """
    moves = _moves(demands)
    found = np.repeat(demands.f[:, None], STARTS, axis=1)
    centre, has_room = _Descent(demands, curve, moves).centre()
    if not has_room.any():
        return found
    inner = demands.of(has_room)
    descent = _Descent(inner, curve, moves[has_room])
    f = descent.scatter(centre[has_room])
    scale = np.abs(inner.K).max(axis=(1, 2))
    excess = inner.stiffness(inner.f[:, None], curve(inner.f.T, "k")[0].T[:, None])[:, 0] - inner.K
    beat = np.maximum((excess**2).sum(axis=(1, 2)) / 2, (1e-5 * scale) ** 2)
    for weight in BARRIERS:
        for _ in range(STEPS):
            f = descent.improved(f, weight * beat)
    found[has_room] = f
    return found


class _Descent:
    """Newton's method on the distance plus a logarithmic barrier at the limits; eigenvalues count by their size, so a
    saddle repels it."""

    def __init__(self, demands: Demands, curve: Callable[..., Any], moves: Array) -> None:
        self.demands, self.curve, self.moves = demands, curve, moves

    def room(self, f: Array, slack: Any = 0.0) -> tuple[Array, Array]:
        """Distances of the group's forces (s, starts, g) from both limits, moved apart by the slack (s)."""
        g, d = f[..., self.demands.group], self.demands
        fixed = d.fixed[:, None, d.group]
        below, above = g - (d.low - slack)[:, None, None], (d.high + slack)[:, None, None] - g
        wide = d.high[:, None, None]
        return np.where(fixed, wide, below), np.where(fixed, wide, above)

    def _clear(self, f: Array) -> list[Array]:
        """The same distances, of forces within the limits up to rounding."""
        return [np.maximum(room, 1e-13 * self.demands.high[:, None, None]) for room in self.room(f)]

    def centre(self) -> tuple[Array, Array]:
        """The analytic centre (s, 1, m) of the permitted forces, and whether it is inside the limits (s).

        The limits start wide enough to hold the forces and close in on the true ones.
        """
        d = self.demands
        f, slack = d.f[:, None], d.high - d.low
        for _ in range(CENTRING):
            below, above = self.room(f, slack)
            gradient, hessian = 1 / above - 1 / below, 1 / above**2 + 1 / below**2
            step = self._step(gradient, hessian[..., None] * np.eye(len(d.group)))
            f = self._moved(f, step, self._reach(step, below, above)[..., None])
            outside = -np.minimum(*self.room(f)).min(axis=(1, 2))
            slack = np.where(outside < 0, 0, np.minimum(slack, 1.5 * outside + 1e-9 * d.high))
        return f, np.minimum(*self.room(f)).min(axis=(1, 2)) > 1e-6 * (d.high - d.low)

    def scatter(self, centre: Array) -> Array:
        """Random forces (s, starts, m) within the limits, by walks from the centre."""
        f, random = np.repeat(centre, STARTS, axis=1), np.random.default_rng(STARTS)
        for _ in range(WALK):
            step = random.normal(size=(*f.shape[:2], self.moves.shape[2])) @ self.moves.swapaxes(1, 2)
            below, above = self.room(f)
            ends = (self._reach(sign * step, below, above, np.inf) for sign in (-1, 1))
            back, forth = (np.where(np.isfinite(end), end, 0) for end in ends)
            f = self._moved(f, step, (-back + random.uniform(size=back.shape) * (back + forth))[..., None])
        return f

    def improved(self, f: Array, weight: Array) -> Array:
        """Forces after one step on distance + weight (s) times barrier."""
        d, group = self.demands, self.demands.group
        k, slope, curvature = self._curves(f, "k", "slope", "curvature")
        excess = d.stiffness(f, k) - d.K[:, None]
        pairs, rates = (each[:, group].reshape(len(f), len(group), -1) for each in (d.pairs, d.slope))
        growth, flat = slope[..., group, None] * pairs[:, None] + rates[:, None], excess.reshape(*f.shape[:2], -1)
        below, above = self._clear(f)
        w = weight[:, None, None]
        gradient = (growth @ flat[..., None])[..., 0] + w * (1 / above - 1 / below)
        diagonal = curvature[..., group] * (flat @ pairs.swapaxes(1, 2)) + w * (1 / above**2 + 1 / below**2)
        hessian = growth @ growth.swapaxes(2, 3) + diagonal[..., None] * np.eye(len(group))
        step = self._step(gradient, hessian)
        most = self._reach(step, below, above)
        tried = [self._moved(f, step, (share * most)[..., None]) for share in SHARES]
        best = np.argmin([self._total(each, weight) for each in tried], axis=0)
        return np.asarray(np.take_along_axis(np.array(tried), best[None, ..., None], axis=0)[0])

    def _curves(self, f: Array, *names: str) -> list[Array]:
        m = f.shape[-1]
        return [each.T.reshape(f.shape) for each in self.curve(f.reshape(-1, m).T, *names)]

    def _total(self, f: Array, weight: Array) -> Array:
        (k,) = self._curves(f, "k")
        distance = ((self.demands.stiffness(f, k) - self.demands.K[:, None]) ** 2).sum(axis=(2, 3)) / 2
        barrier = -sum(np.log(room).sum(axis=2) for room in self._clear(f))
        return np.asarray(distance + weight[:, None] * barrier)

    def _step(self, gradient: Array, hessian: Array) -> Array:
        """Newton's step (s, starts, g) along the moves."""
        moves = self.moves[:, None]
        values, vectors = np.linalg.eigh(moves.swapaxes(2, 3) @ hessian @ moves)
        least = 1e-12 * np.abs(values).max(axis=-1, keepdims=True) + 1e-300
        along = ((gradient @ self.moves)[..., None, :] @ vectors)[..., 0, :]
        shares = -along / np.maximum(np.abs(values), least)
        return np.asarray((vectors @ shares[..., None])[..., 0] @ self.moves.swapaxes(1, 2))

    def _reach(self, step: Array, below: Array, above: Array, most: float = 1.0) -> Array:
        """The share (s, starts) of a step that stays clear of the limits."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.where(step > 0, above / step, np.where(step < 0, -below / step, np.inf))
        return np.asarray(np.minimum(most, TO_LIMIT * ends.min(axis=2)))

    def _moved(self, f: Array, step: Array, share: Array) -> Array:
        moved = f.copy()
        moved[..., self.demands.group] += share * step
        return moved


def _moves(demands: Demands) -> Array:
    """Orthonormal changes (s, g, d) of the group's forces that give no torque; fewer ones are filled up with zeros."""
    group, fixed = demands.group, demands.fixed[:, demands.group]
    u, sizes, _ = np.linalg.svd(
        np.concatenate([demands.P[:, group], np.einsum("si,ij->sij", fixed, np.eye(len(group)))], axis=2)
    )
    rank = (sizes > 1e-9 * sizes[:, :1]).sum(axis=1)
    moves = u[:, :, rank.min() :].copy()
    for s, missing in enumerate(rank - rank.min()):
        moves[s, :, :missing] = 0
    return np.asarray(moves)
