"""The planar four-bar behind the fifth finger's metacarpal, in closed form (section 5.5; Freudenstein's equation)."""

from typing import Any

import sympy
from sympy import Expr


def four_bar_angles(bar: Any, crank: Expr) -> tuple[Expr, Expr]:
    """Angles of coupler and rocker [rad] when the crank stands at angle `crank` [rad].

    The crank r2 turns about the origin, the rocker r4 about (r1, 0), the coupler r3 joins their ends. With e(t) the
    direction at angle t, r2 e(t2) + r3 e(t3) = r1 e(0) + r4 e(t4). Without t3 this is E cos t4 + F sin t4 = G, where
    (E, F) leads from the end of the crank to the rocker's pivot. Of its two roots, branch +1 is the one where the
    rocker's end lies to the right of that line, seen along it; -1 is its mirror image.
    """
    east, north = bar.ground - bar.crank * sympy.cos(crank), -bar.crank * sympy.sin(crank)
    reach = (bar.coupler**2 - bar.rocker**2 - east**2 - north**2) / (2 * bar.rocker)
    rocker = sympy.atan2(north, east) - bar.branch * sympy.acos(reach / sympy.sqrt(east**2 + north**2))
    coupler = sympy.atan2(north + bar.rocker * sympy.sin(rocker), east + bar.rocker * sympy.cos(rocker))
    return coupler, rocker
