"""Calibration polynomials with coefficients from the bench (section 4.1), by their definition."""

from typing import Any

import sympy
from sympy import Expr, Matrix, Rational

from awiwi_gen.hand.lever import BEYOND


def polynomials(
    _: Any, counts: Matrix, ends: Matrix, length_powers: Matrix, force_powers: Matrix, stiffness_powers: Matrix
) -> tuple[Expr, Expr, Expr, list[Expr]]:
    """dL [m], force [N] and stiffness [N/m] at a reading: coefficients (constant first) times powers of x.

    x is -1 at the first of the sensor's two `ends` [counts] and 1 at the second.
    """
    x = (counts[0] - (ends[0] + ends[1]) / 2) / ((ends[1] - ends[0]) / 2)

    def value(powers: Matrix) -> Expr:
        return sympy.Add(*(power * x**i for i, power in enumerate(powers)))

    return value(length_powers), value(force_powers), value(stiffness_powers), [Rational(BEYOND) - x**2]
