"""Quarter turns that a file publishes rounded: 1.5708 for pi/2, 0.7071068 in a quaternion, an axis with -1e-8."""

from __future__ import annotations

import math
from decimal import Decimal, InvalidOperation

import numpy as np

from awiwi_gen.interchange.model import Array

NEAR = 1e-5
"""Largest angle [rad] between a published rotation or axis and the quarter turn for which it is taken."""


def quarter_angle(text: str) -> float | None:
    """The multiple of pi/2 whose rounding to the published decimals is this angle [rad], or None.

    "1.57" and "1.5708" are pi/2, "3.14" is pi, "1.6" (one decimal) is not.

    >>> quarter_angle("1.5708") == math.pi / 2
    True
    """
    try:
        published = Decimal(text)
    except InvalidOperation:
        return None
    angle = float(published)
    quarters = round(angle / (math.pi / 2)) if math.isfinite(angle) else 0
    meant = quarters * (math.pi / 2)
    exponent = published.as_tuple().exponent
    if quarters == 0 or not isinstance(exponent, int) or exponent > -2:
        return None
    # Some files cut digits off instead of rounding them.
    return meant if abs(angle - meant) <= max(1.001 * 10.0**exponent, 1e-14) and exponent <= -2 else None


def quarter_axis(axis: Array) -> Array | None:
    """The coordinate axis (3) within `NEAR` of a direction, or None."""
    length = float(np.linalg.norm(axis))
    meant: Array = np.rint(axis / length) if length else np.zeros(3)
    near = np.abs(meant).sum() == 1 and np.linalg.norm(axis / length - meant) <= NEAR
    return meant + 0.0 if near else None


def quarter_rotation(quat: Array) -> Array | None:
    """The quaternion (4) of quarter turns within `NEAR` of a rotation, or None."""
    length = float(np.linalg.norm(quat))
    if not length:
        return None
    unit = quat / length
    # The 24 rotations of a cube have entries 0, 1/2, sqrt(1/2) and 1.
    values = np.array([0.0, 0.5, math.sqrt(0.5), 1.0])
    meant = np.array([math.copysign(values[np.argmin(np.abs(values - abs(x)))], x) for x in unit]) + 0.0
    near = abs(np.linalg.norm(meant) - 1) < 1e-12 and np.linalg.norm(unit - meant) <= NEAR / 2
    return meant if near else None
