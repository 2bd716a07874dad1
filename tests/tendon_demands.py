"""Demands for the tendons of one finger, and what forces make of them."""

from __future__ import annotations

import numpy as np

LOW, HIGH = 6.0, 90.0


class Demands:
    """Poses, torques and stiffnesses for one finger, and what forces make of them."""

    def __init__(self, lib, finger: str, count: int, seed: int = 0) -> None:
        self.kernel = lib[f"{finger}_tendon_distribution"]
        self.curve = lib[f"{finger}_tendon_stiffness"]
        self.random = np.random.default_rng(seed)
        pose = self.kernel.inputs[0]
        self.q = self.random.uniform(pose["low"], pose["high"], (count, *pose["shape"]))
        self.P = lib[f"{finger}_coupling"](self.q)
        self.dP = lib[f"{finger}_coupling_derivative"](self.q)
        self.f = self.random.uniform(LOW, HIGH, self.P.shape[:2])
        self.tau = self.torque(self.f)
        self.K = self.stiffness(self.f)

    def unreachable(self) -> None:
        """Ask for stiffnesses that no forces give: some off the surface, some far too soft or stiff."""
        random, (count, n, _) = self.random, self.K.shape
        off = random.normal(size=(count, n, n)) * np.abs(self.K).max(axis=(1, 2), keepdims=True) * 0.4
        scale = random.uniform(0.2, 3.0, (count, 1, 1))
        self.K = np.where(np.arange(count)[:, None, None] % 2, self.K + off + off.swapaxes(1, 2), scale * self.K)

    def torque(self, f):
        return -np.einsum("sia,si->sa", self.P, f)

    def stiffness(self, f):
        k = self.curve(f).k
        return np.einsum("si,sia,sib->sab", k, self.P, self.P) + np.einsum("si,siab->sab", f, self.dP)

    def error(self, f):
        """Half the squared Frobenius norm of what the stiffness misses, per demand."""
        return ((self.stiffness(f) - (self.K + self.K.swapaxes(1, 2)) / 2) ** 2).sum(axis=(1, 2)) / 2

    def solved(self):
        return self.kernel(self.q, self.tau, self.K, LOW, HIGH)

    def problem(self, s: int):
        """Cost with gradient, and what forces must obey, of one demand, for SciPy."""
        P, dP, K = self.P[s], self.dP[s], (self.K[s] + self.K[s].T) / 2
        pp = np.einsum("ia,ib->iab", P, P)

        def cost(f):
            k, slope, _, _ = self.curve(np.clip(f, LOW, HIGH))
            excess = np.tensordot(k, pp, 1) + np.tensordot(f, dP, 1) - K
            return (excess**2).sum() / 2, np.einsum("iab,ab->i", slope[:, None, None] * pp + dP, excess)

        return cost, {"type": "eq", "fun": lambda f: P.T @ f + self.tau[s], "jac": lambda f: P.T}
