"""The kernels of chapter 16: the impedance law as a state feedback, and its gains from feedback gains.

Feedback gains belong to the plant of table 16.1, whose spring's torque is cancelled: any linear method gives such
gains, and what it asks for can be had in three ways. With the weights free, K_p and K_d are chosen and the rest follows
in closed form. With the weights given, K_p and K_d leave two of the four gains to be matched, in closed form too; all
four take an iteration, and need not exist.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port, Solver
from awiwi_gen.kernels.control_backstepping import (
    DAMPING,
    INERTIA,
    PLANT,
    PORTS,
    RATES,
    STIFFNESS,
    WEIGHTS,
    box,
    positive,
)
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import Unit, one, s

FEEDBACK = (STIFFNESS, DAMPING, one, s)
EXTERNAL = (one, s)
REACH = 1e6  # how many times the start, or how small a part of it, a gain may be
MATCHED = 1 << 14  # roundings of a feedback gain: what counts as equal

feedback: Family[None] = Family("backstepping.gains")
by_rates: Family[None] = Family("backstepping.gains")
by_weights: Family[None] = Family("backstepping.gains")
by_iteration: Family[None] = Family()


def optimal_laws() -> list[Kernel]:
    """All kernels of chapter 16; they need no hand."""
    families = ((feedback, PORTS), (by_rates, ROUND_RATES), (by_weights, ROUND_WEIGHTS), (by_iteration, WIDE))
    return [
        kernel
        for family, ports in families
        for kernel in family.kernels("", Parameterless(), "control", {}, ports, None)
    ]


def around(units: tuple[Unit, ...], values: tuple[float, ...], share: float) -> Port:
    """A port about known values, up to a share of them."""
    return box(units, tuple(v * (1 - share) for v in values), tuple(v * (1 + share) for v in values))


# Where gains exist is no box. These lie inside, about K_3 = 1000 and K_4 = 100, and about C_t = 0.07 and C_s = 1.3e-5.
ROUND_RATES = {
    "K_opt": around(FEEDBACK, (36.7, 0.77, 380.0, 3.7), 0.1),
    "plant": around((INERTIA, INERTIA, STIFFNESS), (1e-4, 2e-3, 0.6), 0.02),
    "impedance": around((STIFFNESS, DAMPING), (0.1, 1e-3), 0.3),
    "weights": around(WEIGHTS, (10.0, 0.01), 0.3),
}
ROUND_WEIGHTS = {
    "K_opt": around(FEEDBACK, (21.0, 0.91, 530.0, 0.31), 0.1),
    "plant": around((INERTIA, INERTIA, STIFFNESS), (1e-4, 2e-3, 0.6), 0.02),
    "impedance": around((STIFFNESS, DAMPING), (1.0, 9.2e-4), 0.1),
}


WIDE = PORTS | {
    "K_opt": box(FEEDBACK, (1e-9,) * 4, (1e9,) * 4),
    "weights": box(WEIGHTS, (1e-3, 1e-12), (1e3, 1e3)),
    "start": box((STIFFNESS, DAMPING, *RATES), (1e-3, 1e-9, 1e-2, 1e-2), (1e3, 1e3, 1e6, 1e6)),
}


@feedback(
    lambda _: {"K": Port((4,), FEEDBACK), "K_cancelled": Port((4,), FEEDBACK), "h": Port((2,), EXTERNAL)},
    "eq. 15.70, 16.1 to 16.3, mended",
)
def backstepping_state_gains(_: Any, plant: Any, gains: Any, weights: Any) -> Any:
    """The impedance law as tau_m = -K (q, q', tau, tau') + h (tau_ext, tau_ext'), linear spring, q_d = 0.

    K_cancelled are the gains for a plant whose spring's torque is cancelled: tau_m = (m + b) / m tau - K_cancelled x.
    """


@feedback(
    lambda _: {"dK": Port((4, 4), tuple(k / g for k in FEEDBACK for g in (STIFFNESS, DAMPING, *RATES)))},
    "eq. 16.3, mended and differentiated",
)
def backstepping_state_gains_derivatives(_: Any, plant: Any, gains: Any, weights: Any) -> Any:
    """Slopes of K_cancelled by the gains K_p, K_d, K_3, K_4."""


@by_rates(
    lambda _: {"rates": Port((2,), RATES)},
    "eq. 16.3, 16.4, solved",
    guards=(
        *positive(*PLANT, "K_p", "K_d", "C_t", "C_s"),
        *("K_3 and K_4 are real and differ", "their sum is positive", "their product is positive"),
    ),
)
def optimal_backstepping_rates(_: Any, K_opt: Any, plant: Any, impedance: Any, weights: Any) -> Any:
    """K_3 and K_4 that give tau and tau' the feedback gains K_opt, with (K_p, K_d) and the weights given."""


@by_weights(
    lambda _: {"rates": Port((2,), RATES), "weights": Port((2,), WEIGHTS)},
    "eq. 15.89, 15.97, 16.3, 16.4, solved",
    guards=positive(*PLANT, "K_p", "K_d", "C_t", "K_3", "K_4", "C_s"),
)
def optimal_backstepping_weights(_: Any, K_opt: Any, plant: Any, impedance: Any) -> Any:
    """(K_3, K_4) and the weights (C_t, C_s) that give all four feedback gains K_opt exactly, with (K_p, K_d) given.

    Some K_p and K_d do whenever the closed loop is stable and has two different pairs of poles: near those of one pair.
    """


def newton(_: Any, iterations: int = 40) -> Solver:
    """Levenberg's and Marquardt's steps towards all four feedback gains, in parts of what is wanted."""
    return Solver(
        template="optimal_backstepping.c.j2",
        problem="gain matching",
        uses=("backstepping_state_gains", "backstepping_state_gains_derivatives"),
        equations=(),
        unknowns=(),
        arrays={},
        strings={
            "iterations": str(iterations),
            "exact": f"{MATCHED} * AWIWI_REAL_EPSILON",
            "range": f"(awiwi_real){REACH!r}",
        },
        iterations=iterations,
        tolerance={"f64": 1e-13, "f32": 1e-5},
    )


@by_iteration(
    lambda _: {"impedance": Port((2,), (STIFFNESS, DAMPING)), "rates": Port((2,), RATES)}, "eq. 16.4", solver=newton
)
def optimal_backstepping(_: Any, K_opt: Any, plant: Any, weights: Any, start: Any) -> Any:
    """(K_p, K_d) and (K_3, K_4) whose feedback gains are nearest to K_opt, by relative errors; start is a guess.

    Status 0: they are equal. 1: no positive gains have them, these come nearest; or something given is not positive,
    and start is returned. 2: these are the nearest found. 3: something given is not a number; the result is zero.
    """
