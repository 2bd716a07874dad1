"""The kernels of chapter 16: the impedance law as a state feedback, and its gains from feedback gains.

Feedback gains belong to the plant of table 16.1, whose spring's torque is cancelled; any linear method gives them. The
law's gains follow in one of three ways. With K_p and K_d given and the weights free, all four feedback gains are matched
in closed form. With the weights given too, two of the four are matched, in closed form. With the weights given and K_p
and K_d free, matching all four takes an iteration, and a solution need not exist.
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
REACH = 1e6  # a gain may differ from the start by this factor
MATCHED = 1 << 14  # feedback gains within this many rounding errors count as equal

feedback: Family[None] = Family("backstepping.gains")
by_rates: Family[None] = Family("backstepping.gains")
by_weights: Family[None] = Family("backstepping.gains")
by_iteration: Family[None] = Family()


def optimal_laws() -> list[Kernel]:
    """All kernels of chapter 16; they read no number of a hand."""
    families = ((feedback, PORTS), (by_rates, RATES_INPUTS), (by_weights, WEIGHTS_INPUTS), (by_iteration, WIDE))
    return [
        kernel
        for family, ports in families
        for kernel in family.kernels("", Parameterless(), "control", {}, ports, None)
    ]


def around(units: tuple[Unit, ...], values: tuple[float, ...], share: float) -> Port:
    """A port with ranges about given values, by a share of each."""
    return box(units, tuple(v * (1 - share) for v in values), tuple(v * (1 + share) for v in values))


# The gains for which a solution exists form no box. These boxes lie inside, about K_3 = 1000, K_4 = 100, C_t = 0.07 and
# C_s = 1.3e-5.
RATES_INPUTS = {
    "K_opt": around(FEEDBACK, (36.7, 0.77, 380.0, 3.7), 0.1),
    "plant": around((INERTIA, INERTIA, STIFFNESS), (1e-4, 2e-3, 0.6), 0.02),
    "impedance": around((STIFFNESS, DAMPING), (0.1, 1e-3), 0.3),
    "weights": around(WEIGHTS, (10.0, 0.01), 0.3),
}
WEIGHTS_INPUTS = {
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
    """Gains of the impedance law written as tau_m = -K (q, q', tau, tau') + h (tau_ext, tau_ext'), for q_d = 0.

    The spring is linear. K_cancelled are the gains for a plant whose spring's torque is cancelled:
    tau_m = (m + b) / m tau - K_cancelled x.
    """


@feedback(
    lambda _: {"dK": Port((4, 4), tuple(k / g for k in FEEDBACK for g in (STIFFNESS, DAMPING, *RATES)))},
    "eq. 16.3, mended and differentiated",
)
def backstepping_state_gains_derivatives(_: Any, plant: Any, gains: Any, weights: Any) -> Any:
    """Partial derivatives of K_cancelled by the gains K_p, K_d, K_3, K_4."""


@by_rates(
    lambda _: {"rates": Port((2,), RATES)},
    "eq. 16.3, 16.4, solved",
    guards=(
        *positive(*PLANT, "K_p", "K_d", "C_t", "C_s"),
        *("K_3 and K_4 are real and differ", "their sum is positive", "their product is positive"),
    ),
)
def optimal_backstepping_rates(_: Any, K_opt: Any, plant: Any, impedance: Any, weights: Any) -> Any:
    """K_3 and K_4 for which tau and tau' have the feedback gains K_opt, for given (K_p, K_d) and weights."""


@by_weights(
    lambda _: {"rates": Port((2,), RATES), "weights": Port((2,), WEIGHTS)},
    "eq. 15.89, 15.97, 16.3, 16.4, solved",
    guards=positive(*PLANT, "K_p", "K_d", "C_t", "K_3", "K_4", "C_s"),
)
def optimal_backstepping_weights(_: Any, K_opt: Any, plant: Any, impedance: Any) -> Any:
    """(K_3, K_4) and weights (C_t, C_s) for which all four feedback gains are exactly K_opt, for given (K_p, K_d).

    Whenever the closed loop is stable and has two different pairs of poles, a solution exists for some K_p and K_d near
    those of one pair.
    """


def newton(_: Any, iterations: int = 40) -> Solver:
    """The solver for all four feedback gains: Levenberg-Marquardt steps on their relative errors."""
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

    Status 0: the feedback gains are equal. 1: no positive gains give K_opt, and the result is nearest to it; or an
    input is not positive, and the result is start. 2: not converged, the result is the best found. 3: an input is not a
    number, and the result is zero.
    """
