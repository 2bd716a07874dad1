"""Optimal gains of the impedance law, for costs of motion and torque (chapter 16).

A linear-quadratic regulator gives feedback gains, and the closed loop's poles split into two pairs: one for the link,
one for the torque. Near the impedance that the first pair would be alone, the law has exactly these feedback gains with
positive rates and weights. The two curves 1 / C_t = 0 and K_4 / C_t = 0 cross at that impedance, so a small step away,
in the right direction, gives C_t and K_4 any positive values.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_continuous_are

from awiwi_gen.errors import InputError
from awiwi_gen.loops.joint import Loop, Plant, joint_loop
from awiwi_gen.simulate import PERIOD, Array

Quadratic = tuple[float, float]

STEPS = 0.5 ** np.arange(1.0, 40.0)  # lengths that are tried, as shares of the distance to the origin
_PAIRINGS: dict[int, tuple[tuple[int, ...], ...]] = {
    0: ((),),
    2: ((0, 1),),
    4: ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2)),
}


@dataclass(frozen=True)
class Gains:
    """Gains (K_p, K_d, K_3, K_4) and weights (C_t, C_s) of the impedance law."""

    gains: Array
    weights: Array


def regulator(plant: Plant, Q: Array, R: float, cancelled: bool = False) -> Array:
    """Optimal feedback gains (4,) on (q, q', tau, tau'), for the plant or, ``cancelled``, for that of table 16.1.

    Raises InputError for costs that no feedback minimises.
    """
    loop = joint_loop(plant, np.zeros(4), np.zeros(2))
    A = loop.A.copy()
    if cancelled:
        A[3] = 0
    try:
        S = solve_continuous_are(A, loop.B, Q, np.array([[R]]))
    except np.linalg.LinAlgError as error:
        raise InputError(f"no feedback minimises the costs Q = {Q.tolist()}, R = {R:g}: {error}") from None
    gains: Array = (loop.B.T @ S)[0] / R
    return gains


def cancelling(plant: Plant) -> Array:
    """Gains that cancel the spring's torque: the difference between the gains of the two plants (eq. 15.62)."""
    return np.array([0, 0, (plant.m + plant.b) / plant.m, 0])


def exact_gains(library: Any, plant: Plant, wanted: Array, period: float = PERIOD) -> Gains:
    """Gains whose feedback on the plant of table 16.1 is exactly ``wanted``.

    Of several, those that settle a pretension fastest on a clock of this period [s]. Raises InputError where the closed
    loop is not stable, or four equal poles leave no two pairs.
    """
    m, b, k = plant.numbers
    c = k / b * wanted
    poles = np.roots([1, c[3], c[2], c[1] / m, c[0] / m])
    if not poles.real.max() < 0:
        raise InputError(
            f"the feedback gains {_short(wanted)} do not stabilise the joint; its poles are {_short(poles)}"
        )
    found = [gains for link, torque in pairs(poles) for gains in _near(library, plant, wanted, link, torque)]
    if not found:
        raise InputError(f"the feedback gains {_short(wanted)} leave no two different pairs of poles: {_short(poles)}")
    return min(found, key=lambda gains: pretension_loop(plant, gains).sampled_radius(period=period))


def _near(library: Any, plant: Plant, wanted: Array, link: Quadratic, torque: Quadratic) -> Iterator[Gains]:
    """The exact gains nearest to the impedance that has one pair of the poles; at most one set."""
    (a1, a0), (sigma, pi) = link, torque
    slow = min(sigma / 2, pi / (2 * sigma))  # a K_4 that leaves K_3 and C_s positive
    towards = np.array([[pi / a0 - 1, a1 - sigma], [a1 * pi / a0 - sigma, a0 - pi]])
    if abs(np.linalg.det(towards)) <= 1e-12 * np.prod(np.linalg.norm(towards, axis=1)):
        return
    impedance = plant.m * np.array([a0, a1])
    direction = np.linalg.solve(towards, [1, slow])
    tried = impedance + STEPS[:, None] * direction / np.max(np.abs(direction) / impedance)
    found = library.optimal_backstepping_weights(K_opt=wanted, plant=plant.numbers, impedance=tried)
    for place in np.flatnonzero(found.status == 0)[:1]:
        yield Gains(np.append(tried[place], found.rates[place]), found.weights[place])


def pairs(poles: Array) -> Iterator[tuple[Quadratic, Quadratic]]:
    """All pairs of real quadratics s^2 + a s + b with the four poles, as (a, b), in either order."""
    upper = sorted((z for z in poles if z.imag > 0), key=abs)
    real = sorted(-z.real for z in poles if z.imag == 0)
    complex_pairs = [(-2 * z.real, abs(z) ** 2) for z in upper]
    for order in _PAIRINGS[len(real)]:
        quadratics = [(real[i] + real[j], real[i] * real[j]) for i, j in zip(order[::2], order[1::2], strict=True)]
        first, second = complex_pairs + quadratics
        yield first, second
        yield second, first


def loop_of(plant: Plant, wanted: Array) -> Loop:
    """The joint under feedback gains of the plant of table 16.1, with the spring cancelled."""
    return joint_loop(plant, wanted - cancelling(plant), np.zeros(2))


def pretension_loop(plant: Plant, gains: Gains) -> Loop:
    """The loop of the common torque of both motors of a pair, which does not move the link (section 15.5)."""
    _, _, fast, slow = gains.gains
    back = plant.b / plant.k
    K = back * np.array([[fast * slow + gains.weights[0] / gains.weights[1], fast + slow]]) - [[1, 0]]
    A = np.array([[0, 1], [-1 / back, 0]])
    return Loop(A, np.array([[0], [1 / back]]), np.zeros((2, 1)), K, np.zeros((1, 1)))


def _short(numbers: Array) -> str:
    return ", ".join(f"{number:.4g}" for number in numbers)
