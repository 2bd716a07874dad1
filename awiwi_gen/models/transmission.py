"""How a four-bar passes on the turn of its crank: angles, ratios, and how far it is from locking (section 5.5)."""

from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.models.four_bar import four_bar_angles
from awiwi_gen.models.naming import Derivation


def four_bar(bar: Any, q: Matrix) -> tuple[Any, ...]:
    """Coupler and rocker [rad, -pi to pi], their derivatives by the joint angle, the transmission; and the guard.

    The transmission is the sine of the angle between coupler and rocker, positive on the linkage's branch. Where they
    are in line it is zero and the linkage locks: the ratios grow without bound, and beyond the loop does not close.
    """
    derivation, crank = Derivation(), q[0] + bar.reference
    coupler, rocker = (derivation.name(_principal(angle)) for angle in four_bar_angles(bar, crank))
    ratios = [derivation.partial(angle, q[0]) for angle in (coupler, rocker)]
    # The diagonal from the end of the crank to the rocker's pivot, by the law of cosines on either side of it.
    squared = bar.ground**2 + bar.crank**2 - 2 * bar.ground * bar.crank * sympy.cos(crank)
    cosine = (bar.coupler**2 + bar.rocker**2 - squared) / (2 * bar.coupler * bar.rocker)
    return coupler, rocker, *ratios, bar.branch * sympy.sin(coupler - rocker), [1 - cosine**2]


def _principal(angle: Expr) -> Expr:
    return sympy.atan2(sympy.sin(angle), sympy.cos(angle))
