"""Calibration polynomials with coefficients from the bench (section 4.1), by Horner's scheme."""

from functools import reduce
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.hand.lever import BEYOND


def polynomials(
    _: Any, counts: SX, ends: SX, length_powers: SX, force_powers: SX, stiffness_powers: SX
) -> tuple[SX, SX, SX, list[SX]]:
    """dL [m], force [N] and stiffness [N/m] at a reading, scaled to -1 and 1 at the two `ends`."""
    x = ((counts - ends[0]) + (counts - ends[1])) / (ends[1] - ends[0])

    def value(powers: SX) -> SX:
        return reduce(lambda total, power: total * x + power, reversed(ca.vertsplit(powers)))

    return value(length_powers), value(force_powers), value(stiffness_powers), [float(BEYOND) - x**2]
