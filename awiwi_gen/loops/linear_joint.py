"""The joints of tables 12.1, 13.1 and 14.2: a motor and a link with a spring between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Joint:
    """Inertias [kg m^2], stiffness [N m/rad], frictions [N m s/rad]; costs of (q, q', theta, theta') and of the torque."""

    m: float
    b: float
    k: float
    dq: float = 0.0
    dtheta: float = 0.0
    weights: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    R: float = 1.0

    @property
    def numbers(self) -> dict[str, float]:
        """What kernels take for the plant."""
        return {**self.inertias, "k": self.k}

    @property
    def inertias(self) -> dict[str, float]:
        """The plant but for its spring."""
        return {"m": self.m, "b": self.b, "dq": self.dq, "dtheta": self.dtheta}

    @property
    def A(self) -> Array:  # noqa: N802
        """State matrix (4, 4), eq. 12.10."""
        m, b, k = self.m, self.b, self.k
        return np.array(
            [[0, 1, 0, 0], [-k / m, -self.dq / m, k / m, 0], [0, 0, 0, 1], [k / b, 0, -k / b, -self.dtheta / b]]
        )

    @property
    def B(self) -> Array:  # noqa: N802
        """Input (4,), eq. 13.8."""
        return np.array([0, 0, 0, 1 / self.b])

    def closed(self, K: Array) -> Array:
        """The loop under u = -K x (4, 4)."""
        loop: Array = self.A - np.outer(self.B, K)
        return loop

    def with_(self, **changed: Any) -> Joint:
        """The same joint but for some numbers."""
        return replace(self, **changed)

    def optimum(self, library: Any, R: float | None = None) -> Array:
        """Gains (4,) by the compiled solver. Raises ValueError where there are none."""
        found = library.lqr(self.A, self.B, np.diag(self.weights), self.R if R is None else R)
        if found.status:
            raise ValueError(f"{self} has no optimum: status {found.status}")
        gains: Array = found.K
        return gains


TABLE_12_1 = Joint(m=4e-7, b=2e-3, k=0.605, dq=0.0012, dtheta=0.0012)
TABLE_12_1_TARGET = {"omega": (100.0, 30.0), "xi": (0.7, 0.7)}
TABLE_13_1 = Joint(m=4e-7, b=2e-3, k=0.605, dq=0.0012, dtheta=0.0012, weights=(10, 0.01, 1, 0.01), R=0.01)
TABLE_14_2 = Joint(m=7.2e-7, b=2e-3, k=0.605, dq=0.0012, dtheta=0.0012, weights=(10, 0.01, 0.1, 0.01), R=0.0001)
