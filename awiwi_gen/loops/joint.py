"""Linear closed loops of a flexible joint: poles, responses, and what a real clock leaves of them.

The compiled laws supply the gains: a linear law is known by its values at unit vectors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from awiwi_gen.loops.sampled import PERIOD, delay_margin, sampled

Array = np.ndarray[Any, Any]

UNIT_WEIGHTS = (1.0, 1.0)


@dataclass(frozen=True)
class Plant:
    """Inertias of link and motor [kg m^2], the spring between them [N m/rad], viscous frictions [N m s/rad]."""

    m: float
    b: float
    k: float
    link_friction: float = 0.0
    motor_friction: float = 0.0

    @property
    def numbers(self) -> tuple[float, float, float]:
        """What the laws take for the plant."""
        return self.m, self.b, self.k


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

    @property
    def stable(self) -> bool:
        """Whether all poles lie in the left half plane."""
        return bool(self.poles().real.max() < 0)

    def response(self, start: Any, times: Array, w: Any = 0.0) -> Array:
        """States (times, n) from ``start`` under a constant w; the times are evenly spaced and begin at the start."""
        n = len(self.A)
        moved = (self.E + self.B @ self.H) @ np.broadcast_to(np.asarray(w, float), self.E.shape[1:])
        step = expm(np.block([[self.closed, moved[:, None]], [np.zeros((1, n + 1))]]) * (times[1] - times[0]))
        states = [np.append(start, 1.0)]
        for _ in times[1:]:
            states.append(step @ states[-1])
        return np.array(states)[:, :n]

    def at_rest(self, w: Any) -> Array:
        """The state that the loop comes to under a constant w."""
        moved = (self.E + self.B @ self.H) @ np.broadcast_to(np.asarray(w, float), self.E.shape[1:])
        return -np.linalg.solve(self.closed, moved)

    def sampled_radius(self, delay: int = 1) -> float:
        """Largest modulus of a pole when the law runs on the hand's clock and acts ``delay`` ticks later."""
        return float(np.abs(np.linalg.eigvals(sampled(self.A, self.B, self.K, PERIOD, delay))).max())

    def delay_margin(self) -> float:
        """The shortest delay [s] that takes a pole to the imaginary axis; infinite if none does."""
        return delay_margin(self.A, self.B, self.K)


def slopes(law: Any, port: str, size: int, **held: Any) -> Array:
    """Slopes (outputs, size) of a linear law by one of its ports; the other ports are held."""
    at_rest = law(**{port: np.zeros(size)}, **held)[0]
    unit = law(**{port: np.eye(size)}, **held)[0]
    matrix: Array = (unit - at_rest).reshape(size, -1).T
    return matrix


def impedance_loop(
    library: Any, plant: Plant, gains: Any, weights: Any = UNIT_WEIGHTS, fed: tuple[float, float] = (1.0, 1.0)
) -> Loop:
    """The impedance law on (q, q', tau, tau') about q_d = 0; w is (tau_ext, tau_ext'), of which parts are fed."""
    given = {"desired": np.zeros(5), "plant": plant.numbers, "gains": gains, "weights": weights}
    K = -slopes(library.backstepping_impedance, "state", 4, external=np.zeros(2), **given)
    H = slopes(library.backstepping_impedance, "external", 2, state=np.zeros(4), **given)
    return joint_loop(plant, K, H * np.array(fed))


def joint_loop(plant: Plant, K: Array, H: Array) -> Loop:
    """Any feedback tau_m = -K (q, q', tau, tau') + H (tau_ext, tau_ext') of a joint behind a linear spring."""
    m, b, k = plant.numbers
    dq, dm = plant.link_friction, plant.motor_friction
    A = np.array(
        [
            [0, 1, 0, 0],
            [0, -dq / m, 1 / m, 0],
            [0, 0, 0, 1],
            [0, k * (dq / m - dm / b), -k * (1 / b + 1 / m), -dm / b],
        ]
    )
    B, E = np.array([[0, 0, 0, k / b]]).T, np.array([[0, 1 / m, 0, -k / m], [0, 0, 0, 0]]).T
    return Loop(A, B, E, K.reshape(1, 4), H.reshape(1, 2))


def position_loop(library: Any, plant: Plant, rates: Any) -> Loop:
    """The position law on (q, q', q'', q''') about q_d = 0."""
    given = {"desired": np.zeros(5), "plant": plant.numbers, "rates": rates, "scales": np.ones(3)}
    return motion_loop(plant, -slopes(library.backstepping_position, "motion", 4, **given))


def normalised_loop(library: Any, plant: Plant, gains: Any) -> Loop:
    """The impedance law of a link of unit inertia on (q, q', q'', q'''): what figures 15.7 and 15.8 must show."""
    m, b, k = plant.numbers
    unit = library.backstepping_state_gains(plant=(1.0, 1.0, 1.0), gains=gains, weights=UNIT_WEIGHTS).K_cancelled
    return motion_loop(plant, b * m / k * unit - np.array([0, 0, b + m, 0]))


def motion_loop(plant: Plant, K: Array) -> Loop:
    """Any feedback of the link's position and its derivatives (eq. 15.19)."""
    m, b, k = plant.numbers
    A = np.diag(np.ones(3), 1)
    A[3, 2] = -k * (b + m) / (b * m)
    B = np.array([[0, 0, 0, k / (b * m)]]).T
    return Loop(A, B, np.zeros((4, 1)), K.reshape(1, 4), np.zeros((1, 1)))
