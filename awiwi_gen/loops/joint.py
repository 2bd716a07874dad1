"""A motor and a link with a spring between them, its linear closed loops, and the joints of the source's tables.

Compiled laws supply the gains: a linear law is known by its values at unit vectors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import expm

from awiwi_gen.loops.sampled import delay_margin, sampled
from awiwi_gen.simulate import PERIOD, Array

UNIT_WEIGHTS = (1.0, 1.0)


@dataclass(frozen=True)
class Plant:
    """Inertias of link and motor [kg m^2], the spring between them [N m/rad], viscous frictions [N m s/rad].

    ``weights`` of (q, q', theta, theta') and R of the torque are the costs that the tables of chapters 13 and 14 print.
    """

    m: float
    b: float
    k: float
    dq: float = 0.0
    dtheta: float = 0.0
    weights: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    R: float = 1.0

    @property
    def numbers(self) -> tuple[float, float, float]:
        """(m, b, k), the port `plant` of the backstepping laws."""
        return self.m, self.b, self.k

    @property
    def ports(self) -> dict[str, float]:
        """The same numbers and the frictions, by the names of ports."""
        return {"m": self.m, "b": self.b, "k": self.k, "dq": self.dq, "dtheta": self.dtheta}

    @property
    def A(self) -> Array:  # noqa: N802
        """State matrix (4, 4) on (q, q', theta, theta'), eq. 12.10."""
        m, b, k = self.numbers
        return np.array(
            [[0, 1, 0, 0], [-k / m, -self.dq / m, k / m, 0], [0, 0, 0, 1], [k / b, 0, -k / b, -self.dtheta / b]]
        )

    @property
    def B(self) -> Array:  # noqa: N802
        """Input (4,) of the motor's torque, eq. 13.8."""
        return np.array([0, 0, 0, 1 / self.b])

    def loop(self, K: Array) -> Loop:
        """Feedback u = -K (q, q', theta, theta')."""
        return _loop_in(self, np.eye(4), K)

    def with_(self, **changed: Any) -> Plant:
        """The same joint with some numbers changed."""
        return replace(self, **changed)

    def optimum(self, library: Any, R: float | None = None) -> Array:
        """Gains (4,) of the compiled Riccati solver. Raises ValueError where it fails."""
        found = library.lqr(self.A, self.B, np.diag(self.weights), self.R if R is None else R)
        if found.status:
            raise ValueError(f"{self} has no optimum: status {found.status}")
        gains: Array = found.K
        return gains


TABLE_12_1 = Plant(m=4e-7, b=2e-3, k=0.605, dq=0.0012, dtheta=0.0012)
TABLE_12_1_TARGET = {"omega": (100.0, 30.0), "xi": (0.7, 0.7)}
TABLE_13_1 = TABLE_12_1.with_(weights=(10, 0.01, 1, 0.01), R=0.01)
TABLE_14_2 = TABLE_12_1.with_(m=7.2e-7, weights=(10, 0.01, 0.1, 0.01), R=0.0001)
TABLE_15_1 = Plant(7.2e-7, 2e-4, 20.0)
TABLE_16_1 = Plant(7.2e-7, 2e-7 * 100 * 100, 0.605)


@dataclass(frozen=True)
class Loop:
    """x' = A x + B u + E w under u = -K x + H w; A (n, n), B (n, p), E (n, r), K (p, n), H (p, r)."""

    A: Array
    B: Array
    E: Array
    K: Array
    H: Array

    @property
    def closed(self) -> Array:
        """The matrix of the closed loop."""
        closed: Array = self.A - self.B @ self.K
        return closed

    def poles(self) -> Array:
        """Poles of the closed loop [1/s]."""
        poles: Array = np.linalg.eigvals(self.closed)
        return poles

    def response(self, start: Any, times: Array, w: Any = 0.0) -> Array:
        """States (times, n) from ``start`` under a constant w; the times are evenly spaced and begin at the start."""
        n = len(self.A)
        step = expm(np.block([[self.closed, self._drift(w)[:, None]], [np.zeros((1, n + 1))]]) * (times[1] - times[0]))
        states = [np.append(start, 1.0)]
        for _ in times[1:]:
            states.append(step @ states[-1])
        return np.array(states)[:, :n]

    def step(self, height: float, times: Array) -> Array:
        """Position (times,) of the link after a step of the desired one, from rest at 0."""
        position: Array = height + self.response([-height, *np.zeros(len(self.A) - 1)], times)[:, 0]
        return position

    def loaded(self, start: Array, times: Array, torque: float) -> Array:
        """States (times, n) from ``start`` after a step of the outer torque [N m], whose rate is an impulse."""
        return self.response(start + (self.E + self.B @ self.H) @ [0.0, torque], times, [torque, 0.0])

    @property
    def stiffness(self) -> float:
        """Of the link at rest [N m/rad]: outer torque per deflexion."""
        return float(1 / self.at_rest([1.0, 0.0])[0])

    def at_rest(self, w: Any) -> Array:
        """The state at rest under a constant w."""
        return -np.linalg.solve(self.closed, self._drift(w))

    def _drift(self, w: Any) -> Array:
        drift: Array = (self.E + self.B @ self.H) @ np.broadcast_to(np.asarray(w, float), self.E.shape[1:])
        return drift

    def sampled_radius(self, delay: int = 1, period: float = PERIOD) -> float:
        """Spectral radius when the law runs on a clock of this period [s] and acts ``delay`` ticks later."""
        return float(np.abs(np.linalg.eigvals(sampled(self.A, self.B, self.K, period, delay))).max())

    def delay_margin(self) -> float:
        """The shortest delay [s] that moves a pole to the imaginary axis; infinite if none does."""
        return delay_margin(self.A, self.B, self.K)


def joint_loop(plant: Plant, K: Array, H: Array) -> Loop:
    """Feedback u = -K (q, q', tau, tau') + H (tau_ext, tau_ext') of a joint, where tau is the spring's torque."""
    return _loop_in(plant, _deflexion(plant.k), K, H)


def motion_loop(plant: Plant, K: Array) -> Loop:
    """Feedback of the link's position and its derivatives (q, q', q'', q'''), without friction (eq. 15.19)."""
    return _loop_in(plant, _deflexion(plant.k / plant.m), K)


def state_gains(plant: Plant, K: Array) -> Array:
    """Gains (4,) on (q, q', theta, theta') of feedback K (4,) of the link's motion."""
    gains: Array = np.ravel(K) @ _deflexion(plant.k / plant.m)
    return gains


def _deflexion(factor: float) -> Array:
    """The change of coordinates to q, q' and a factor times the spring's deflexion and its rate."""
    return np.array([[1, 0, 0, 0], [0, 1, 0, 0], [-factor, 0, factor, 0], [0, -factor, 0, factor]])


def _loop_in(plant: Plant, T: Array, K: Array, H: Array | None = None) -> Loop:
    """The loop in the coordinates T (q, q', theta, theta')."""
    E = np.outer(T @ [0, 1 / plant.m, 0, 0], [1.0, 0.0])
    A: Array = T @ plant.A @ np.linalg.inv(T)
    return Loop(A, (T @ plant.B)[:, None], E, K.reshape(1, 4), np.zeros((1, 2)) if H is None else H.reshape(1, 2))


# -- the compiled laws as feedback ---------------------------------------------------------------------------


def slopes(law: Any, port: str, size: int, **others: Any) -> Array:
    """Slopes (outputs, size) of a linear law by one of its ports, the other ports being constant."""
    at_rest = law(**{port: np.zeros(size)}, **others)[0]
    unit = law(**{port: np.eye(size)}, **others)[0]
    matrix: Array = (unit - at_rest).reshape(size, -1).T
    return matrix


def impedance_loop(
    library: Any, plant: Plant, gains: Any, weights: Any = UNIT_WEIGHTS, fed: tuple[float, float] = (1.0, 1.0)
) -> Loop:
    """The impedance law about q_d = 0; the law receives the shares ``fed`` of w = (tau_ext, tau_ext')."""
    given = {"desired": np.zeros(5), "plant": plant.numbers, "gains": gains, "weights": weights}
    K = -slopes(library.backstepping_impedance, "state", 4, external=np.zeros(2), **given)
    H = slopes(library.backstepping_impedance, "external", 2, state=np.zeros(4), **given)
    return joint_loop(plant, K, H * np.array(fed))


def position_loop(library: Any, plant: Plant, rates: Any) -> Loop:
    """The position law about q_d = 0."""
    given = {"desired": np.zeros(5), "plant": plant.numbers, "rates": rates, "scales": np.ones(3)}
    return motion_loop(plant, -slopes(library.backstepping_position, "motion", 4, **given))


def normalised_loop(library: Any, plant: Plant, gains: Any) -> Loop:
    """The impedance law of a link of unit inertia, on the motion of the link: what figures 15.7 and 15.8 must show."""
    m, b, k = plant.numbers
    unit = library.backstepping_state_gains(plant=(1.0, 1.0, 1.0), gains=gains, weights=UNIT_WEIGHTS).K_cancelled
    return motion_loop(plant, b * m / k * unit - np.array([0, 0, b + m, 0]))
