"""Algorithm 2 of chapter 7, as printed and corrected, for the tendons of a finger with constant couplings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.simulate import Array

LIMITS = 6.0, 90.0  # N
ROUNDS = 200
STEP = 400.0  # N^2 per (N m/rad)^2, the source does not print s0; larger ones diverge as printed, smaller ones are slow
WEIGHTS = (1.0, 1e-3)  # of the violation of the limits; "large" in print


def closed_form_of(library: Any, finger: str) -> bool:
    """Whether a library has the kernel that the search is compared with."""
    return f"{finger}_tendon_distribution" in library


@dataclass(frozen=True)
class Demands:
    """Torques (count, n) and stiffnesses (count, n, n) that forces within the limits give exactly."""

    library: Any
    finger: str
    P: Array
    tau: Array
    K: Array

    @classmethod
    def feasible(cls, library: Any, finger: str, count: int, seed: int = 7) -> Demands:
        """Those of random forces, many of them at a limit."""
        random = np.random.default_rng(seed)
        kernel = library[f"{finger}_coupling"]
        P = kernel(np.zeros(kernel.inputs[0]["shape"]))
        beyond = (LIMITS[1] - LIMITS[0]) / 4
        f = np.clip(random.uniform(LIMITS[0] - beyond, LIMITS[1] + beyond, (count, len(P))), *LIMITS)
        demands = cls(library, finger, P, -f @ P, np.zeros((count, P.shape[1], P.shape[1])))
        return cls(library, finger, P, demands.tau, demands.stiffness(f))

    def stiffness(self, f: Array) -> Array:
        """Joint stiffness (count, n, n) of forces (count, m), which end at the limits."""
        k = self.library[f"{self.finger}_tendon_stiffness"](np.clip(f, *LIMITS)).k
        found: Array = np.einsum("si,ia,ib->sab", k, self.P, self.P)
        return found

    def miss(self, f: Array) -> Array:
        """Largest error of an entry of the stiffness, per demand [N m/rad]."""
        found: Array = np.abs(self.stiffness(f) - self.K).max(axis=(1, 2))
        return found

    def violation(self, f: Array) -> Array:
        """How far the worst force lies outside the limits, per demand [N]."""
        found: Array = np.abs(f - np.clip(f, *LIMITS)).max(axis=1)
        return found

    def closed_form(self) -> Array:
        """Forces by the compiled kernel."""
        kernel = self.library[f"{self.finger}_tendon_distribution"]
        f: Array = kernel(np.zeros(kernel.inputs[0]["shape"]), self.tau, self.K, *LIMITS).f
        return f

    def search(self, printed: bool, weight: float = 1e-3, step: float = STEP, rounds: int = ROUNDS) -> Array:
        """Forces by the search. As printed, the gradient of a rejected trial replaces that of the best point."""
        inverse = np.linalg.pinv(self.P.T)
        f = np.full((len(self.tau), len(self.P)), sum(LIMITS) / 2)
        f += (-self.tau - f @ self.P) @ inverse.T
        level = np.eye(len(self.P)) - inverse @ self.P.T
        steps = np.full((len(f), 1), step)
        if printed:
            best, gradient = np.full(len(f), np.inf), np.zeros_like(f)
        else:
            best, gradient = self._cost(f, weight)
        for _ in range(rounds):
            trial = f - steps * gradient @ level
            found, tried = self._cost(trial, weight)
            better = (found < best)[:, None]
            if printed:
                gradient = tried
                trial = f - steps * gradient @ level  # the step is taken after the gradient was overwritten
            gradient = tried if printed else np.where(better, tried, gradient)
            best, f, steps = np.minimum(best, found), np.where(better, trial, f), np.where(better, steps, steps / 2)
        return f

    def _cost(self, f: Array, weight: float) -> tuple[Array, Array]:
        """Half the squared error of the stiffness and of the limits, and its gradient by the forces."""
        inside = np.clip(f, *LIMITS)
        slope = self.library[f"{self.finger}_tendon_stiffness"](inside).slope * (f == inside)
        excess = self.stiffness(f) - self.K
        gradient = slope * np.einsum("ia,sab,ib->si", self.P, excess, self.P) + weight * (f - inside)
        return (excess**2).sum(axis=(1, 2)) / 2 + weight * ((f - inside) ** 2).sum(axis=1) / 2, gradient
