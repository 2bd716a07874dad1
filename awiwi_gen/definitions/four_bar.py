"""The planar four-bar behind the fifth finger's metacarpal, in closed form (section 5.5; Freudenstein's equation)."""

from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation


def four_bar_angles(bar: Any, crank: Expr) -> tuple[Expr, Expr]:
    """Angles of coupler and rocker [rad] for the angle `crank` [rad] of the crank.

    The crank r2 rotates about the origin, the rocker r4 about (r1, 0), and the coupler r3 joins their ends. With e(t)
    the direction at angle t, r2 e(t2) + r3 e(t3) = r1 e(0) + r4 e(t4). Elimination of t3 gives
    E cos t4 + F sin t4 = G, where (E, F) leads from the end of the crank to the rocker's pivot. It has two roots: on
    branch +1 the rocker's end lies to the right of that line, on branch -1 to its left.
    """
    east, north = bar.ground - bar.crank * sympy.cos(crank), -bar.crank * sympy.sin(crank)
    reach = (bar.coupler**2 - bar.rocker**2 - east**2 - north**2) / (2 * bar.rocker)
    rocker = sympy.atan2(north, east) - bar.branch * sympy.acos(reach / sympy.sqrt(east**2 + north**2))
    coupler = sympy.atan2(north + bar.rocker * sympy.sin(rocker), east + bar.rocker * sympy.cos(rocker))
    return coupler, rocker


def four_bar(bar: Any, q: Matrix) -> tuple[Any, ...]:
    """Coupler and rocker [rad, -pi to pi], their derivatives by the joint angle, the transmission; and the guard.

    The transmission is the sine of the angle between coupler and rocker, positive on the linkage's branch. It is zero
    where they are in line. There the linkage locks: the ratios are infinite, and beyond it the loop does not close.
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
