"""The planar four-bar of the fifth metacarpal, as vectors: no angles, no inverse functions (section 5.5)."""

from typing import Any

import casadi as ca
from casadi import SX

Vector = tuple[SX, SX]


class FourBar:
    """A four-bar whose crank, at the origin, has the angle `crank` [rad] from the line to the rocker's pivot.

    Crank a, coupler b and rocker d close the loop a + b = ground + d. Coupler and rocker stand over the diagonal
    from the end of the crank to the rocker's pivot; `area`, twice that of their triangle, is positive on branch +1,
    where the rocker's end lies to the right of the diagonal.

    `coupler` and `rocker` are the unit vectors along b and d. `ratio` and `rocker_ratio` are the derivatives of their
    angles by the crank's angle, and `ratio_derivative` is that of `ratio`.
    """

    def __init__(self, bar: Any, crank: SX) -> None:
        a = (bar.crank * ca.cos(crank), bar.crank * ca.sin(crank))
        diagonal = (bar.ground - a[0], -a[1])
        squared = bar.ground**2 + bar.crank**2 - 2 * bar.ground * a[0]
        along = (squared + bar.coupler**2 - bar.rocker**2) / 2
        area = bar.branch * ca.sqrt(bar.coupler**2 * squared - along**2)
        b = (
            (along * diagonal[0] + area * diagonal[1]) / squared,
            (along * diagonal[1] - area * diagonal[0]) / squared,
        )
        d = (b[0] - diagonal[0], b[1] - diagonal[1])
        self.coupler: Vector = (b[0] / bar.coupler, b[1] / bar.coupler)
        self.rocker: Vector = (d[0] / bar.rocker, d[1] / bar.rocker)

        # Velocity of the loop, a' + b' t3' = d' t4', where a', b', d' are a, b, d rotated by 90 degrees: its components
        # along b and d, as areas, then those of its derivative. (The area of b and d is minus that of the triangle.)
        crank_coupler = a[0] * b[1] - a[1] * b[0]
        self.ratio = (crank_coupler + bar.ground * a[1]) / area
        self.rocker_ratio = crank_coupler / area
        centripetal = (bar.coupler**2 - along) * self.ratio**2 - (bar.rocker * self.rocker_ratio) ** 2
        self.ratio_derivative = -(a[0] * d[0] + a[1] * d[1] + centripetal) / area


def four_bar(bar: Any, q: SX) -> tuple[Any, ...]:
    """Coupler and rocker [rad, -pi to pi], their derivatives by the joint angle, the transmission; and the guard."""
    crank = q + bar.reference
    loop = FourBar(bar, crank)
    (coupler_x, coupler_y), (rocker_x, rocker_y) = loop.coupler, loop.rocker
    # Twice the area of the triangle over the loop's diagonal, squared, from its sides (Heron).
    squared = bar.ground**2 + bar.crank**2 - 2 * bar.ground * bar.crank * ca.cos(crank)
    longest, shortest = (bar.coupler + bar.rocker) ** 2, (bar.coupler - bar.rocker) ** 2
    heron = (longest - squared) * (squared - shortest) / (2 * bar.coupler * bar.rocker) ** 2
    return (
        ca.atan2(coupler_y, coupler_x),
        ca.atan2(rocker_y, rocker_x),
        loop.ratio,
        loop.rocker_ratio,
        bar.branch * (coupler_y * rocker_x - coupler_x * rocker_y),
        [heron],
    )
