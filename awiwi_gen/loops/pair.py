"""Linear closed loops of a joint between two motors; the state is (q, q', tau1, tau1', tau2, tau2')."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from awiwi_gen.loops.joint import TABLE_16_1, Loop, slopes
from awiwi_gen.simulate import Array

SIDES = np.array([1.0, -1.0])
TUNING = (100.0, 100.0, 1.0, 1.0)  # K_3, K_4, C_t, C_s of either motor


@dataclass(frozen=True)
class Pair:
    """A link of inertia m, and two motors with their linear springs."""

    m: float
    b: tuple[float, float]
    k: tuple[float, float]

    def open_loop(self) -> tuple[Array, Array, Array]:
        """A (6, 6), B (6, 2) and E (6, 2) of the plant (eq. 15.83, corrected)."""
        A, B, E = np.zeros((6, 6)), np.zeros((6, 2)), np.zeros((6, 2))
        pull = np.zeros(6)
        pull[2::2] = SIDES / self.m
        A[0, 1], A[1], E[1, 0] = 1.0, pull, 1 / self.m
        for i, (b, k, side) in enumerate(zip(self.b, self.k, SIDES, strict=True)):
            row = 2 * i + 2
            A[row, row + 1] = 1.0
            A[row + 1], E[row + 1, 0], B[row + 1, i] = -side * k * pull, -side * k / self.m, k / b
            A[row + 1, row] -= k / b
        return A, B, E


TABLE_PAIR = Pair(TABLE_16_1.m, (TABLE_16_1.b,) * 2, (TABLE_16_1.k,) * 2)


def pair_loop(
    law: Any, pair: Pair, impedance: Any, tuning: Any = TUNING, pretension: float = 0.0
) -> tuple[Loop, Array]:
    """A law for pairs as feedback about q_d = 0, and the constant torques (2,) that it adds for a pretension."""
    zero = {"joint": np.zeros(2), "torques": np.zeros((2, 2)), "external": np.zeros(2)}
    given = {
        "inertias": (pair.m, *pair.b), "springs": [(k, 0.0) for k in pair.k], "desired": np.zeros(5),
        "pretension": (pretension, 0.0, 0.0), "impedance": impedance, "tunings": np.broadcast_to(tuning, (2, 4)),
    }  # fmt: skip
    constant = law(**zero, **given).tau_m

    def by(port: str, size: int) -> Array:
        others = {name: value for name, value in zero.items() if name != port}
        return slopes(law, port, size, **others, **given)

    units = np.eye(4).reshape(4, 2, 2)
    torques = np.stack([law(**(zero | {"torques": unit}), **given).tau_m - constant for unit in units], axis=1)
    K = -np.hstack([by("joint", 2), torques])
    return Loop(*pair.open_loop(), K, by("external", 2)), constant


def at_rest(loop: Loop, constant: Array) -> Array:
    """The state (6,) at rest under constant torques."""
    rest: Array = -np.linalg.solve(loop.closed, loop.B @ constant)
    return rest


def literal_loop(pair: Pair, impedance: Any, tuning: Any = TUNING) -> Loop:
    """The closed loop of eq. 15.106 as printed, its algebraic loop through tau'' solved.

    Without a pretension tau_d = s (-K_p q - K_d q') / 2 on the side s; all signals are rows over the six states.
    """
    A, B, E = pair.open_loop()
    (K_p, K_d), (K_3, K_4, C_t, C_s) = impedance, tuning
    states = np.eye(6)
    motion = [states[0], states[1], A[1], A[1] @ A]
    feedback = np.zeros((2, 6))
    for i, (b, k, side) in enumerate(zip(pair.b, pair.k, SIDES, strict=True)):
        tau, rate = states[2 * i + 2 : 2 * i + 4]
        target = [-side * (K_p * x + K_d * y) / 2 for x, y in pairwise(motion)]
        # (1 - K_t / C_t) (tau'' - tau_d'') = -s q''' / C_t - C_t / C_s e - K_4 (s q' / C_t + (1 - K_t / C_t) e')
        error, error_rate, factor = tau - target[0], rate - target[1], 1 - K_3
        pull = -side * motion[3] / C_t - C_t / C_s * error - K_4 * (side * motion[1] / C_t + factor * error_rate)
        feedback[i] = tau + b * side * motion[2] + b / k * (target[2] + pull / factor)
    return Loop(A, B, E, -feedback, np.zeros((2, 2)))
