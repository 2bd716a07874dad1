"""The transmission of a four-bar from the vectors of its loop: angles come last, ratios from its velocity."""

from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.models.linkage import FourBar


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
        loop.rate,
        loop.rocker_rate,
        bar.branch * (coupler_y * rocker_x - coupler_x * rocker_y),
        [heron],
    )
