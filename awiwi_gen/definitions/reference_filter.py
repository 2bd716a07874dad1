"""Desired motions that a motor can follow: a filter of fifth order with the poles of Bessel's polynomial.

With the error e = r - goal of the filtered motion r, and the delay d,

    (d s)^5 + 15 (d s)^4 + 105 (d s)^3 + 420 (d s)^2 + 945 d s + 945 = 0

A goal given with all its derivatives is followed without error. A step of the goal becomes the smooth motion of a filter
with flat group delay: it settles after 1.7 d with 0.8 % of overshoot. Over one sample, e is its Taylor polynomial of
fourth order.
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
    """The motion (5) a sample later, and the guards."""
    names = Derivation()
    errors = list(motion - desired)
    for _order in range(ORDER):  # each higher derivative follows from the five before it
        last = errors[-len(BESSEL) :]
        terms = [c * e / delay[0] ** (len(BESSEL) - i) for i, (c, e) in enumerate(zip(BESSEL, last, strict=True))]
        errors.append(names.name(-sum(terms)))
    goals = [*desired]  # the goal moves on by its known derivatives
    ahead = [_taylor(goals[i:], period[0]) + _taylor(errors[i : i + ORDER + 1], period[0]) for i in range(len(goals))]
    return Matrix(ahead), [delay[0], period[0]]


def _taylor(derivatives: list[Expr], step: Expr) -> Expr:
    return sum(d * step**n / factorial(n) for n, d in enumerate(derivatives))
