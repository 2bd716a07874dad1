"""Desired motions that a motor can follow: a filter of fifth order whose errors die out as Bessel's polynomial tells.

With the error e = r - goal of the motion r that is handed to a law, and the delay d,

    (d s)^5 + 15 (d s)^4 + 105 (d s)^3 + 420 (d s)^2 + 945 d s + 945 = 0

A goal with all its derivatives is followed without error. A jump of the goal becomes the smooth motion of a filter
whose group delay is flat: it arrives after 1.7 d with 0.8 % of overshoot, on less torque than any law could take it by.
Over one sample e is developed by Taylor up to the fourth order.
"""

from __future__ import annotations

from math import factorial
from typing import Any

from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation

BESSEL = (945, 945, 420, 105, 15)  # coefficients of the errors' derivatives, from the error itself up
ORDER = 4


def reference_filter(
    _: Any, motion: Matrix, desired: Matrix, delay: Matrix, period: Matrix
) -> tuple[Matrix, list[Expr]]:
    """The motion (5) a sample later, and what must be positive."""
    names = Derivation()
    errors = list(motion - desired)
    for _order in range(ORDER):  # each further derivative follows from the five before it
        last = errors[-len(BESSEL) :]
        terms = [c * e / delay[0] ** (len(BESSEL) - i) for i, (c, e) in enumerate(zip(BESSEL, last, strict=True))]
        errors.append(names.name(-sum(terms)))
    goals = [*desired]  # the goal itself moves on, as far as it is known
    ahead = [_taylor(goals[i:], period[0]) + _taylor(errors[i : i + ORDER + 1], period[0]) for i in range(len(goals))]
    return Matrix(ahead), [delay[0], period[0]]


def _taylor(derivatives: list[Expr], step: Expr) -> Expr:
    return sum(d * step**n / factorial(n) for n, d in enumerate(derivatives))
