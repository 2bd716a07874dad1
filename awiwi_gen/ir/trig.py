"""Sine and cosine of our own: the constants, once for C and Python, and the algorithm on NumPy arrays.

Only + - * and moves of bits, no branches, so every IEEE machine computes the same bits, one angle at a time or several
in lanes. The steps, with h the upper bits of the reduced angle r and l the rest of it:

- r = x - n pi/2, where pi/2 has three parts and the first two products and differences are exact; the third is added
  last, for it matters only where r is tiny.
- h is r rounded by adding and subtracting ``split``. Beyond the domain an angle times ``overflow`` is infinite, and that
  times 0 is NaN, as are h and all results then. None of the steps to r waits for that.
- h has so few bits that h^2, h (1 - sixth h^2) and 1 - h^2/2 are exact, where ``sixth`` is a short number near 1/6.
- sin r = h (1 - sixth h^2) + small terms, cos r = (1 - h^2/2) + small terms; what rounding does to the small terms is
  a few hundredths of the last place of the sum.
- Polynomials are minimax fits on |r| <= pi/4 of (sin r - r + r^3/6)/r^5 and (cos r - 1 + r^2/2)/r^4, in z = r^2.
- The two lowest bits of n are the quadrant: one swaps sine and cosine, the other negates both.

Error over the domain: below ULPS units in the last place (docs/trigonometry.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

ULPS = 0.62  # proven in double precision, where samples reach 0.595; in single every angle was tried against it


@dataclass(frozen=True)
class Trig:
    """Constants for one scalar type; all are exact in it."""

    overflow: float  # an angle times this is infinite from `limit` on
    quarters: float  # 2/pi
    integer: float  # adding it rounds to an integer, which the lowest bits of the sum then hold
    half_pi: tuple[float, float, float]
    split: float  # adding and subtracting it keeps the upper bits
    one: float
    half: float
    sixth: float
    third: float  # twice that
    sine: tuple[float, ...]  # from (sixth - 1/6) z^0 on
    cosine: tuple[float, ...]

    @property
    def limit(self) -> float:
        """The first angle [rad] beyond the domain, a power of two."""
        return 2.0**1023 / self.overflow * 2.0 if self.overflow > 2.0**128 else 2.0**128 / self.overflow


DOUBLE = Trig(
    overflow=2.0**1014,
    quarters=0.6366197723675814,
    integer=6755399441055744.0,
    half_pi=(1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21),
    split=1.5 * 2.0**38,
    one=1.0,
    half=0.5,
    sixth=341.0 / 2048.0,
    third=341.0 / 1024.0,
    sine=(
        -0.0001627604166663073, 0.008333333333322118, -0.00019841269829589037, 2.7557313621158387e-06,
        -2.5050747720596477e-08, 1.5896227382026644e-10,
    ),
    cosine=(
        0.0416666666666666, -0.0013888888888874474, 2.480158728967153e-05, -2.755731440102671e-07,
        2.087572928051067e-09, -1.1359934199650456e-11,
    ),
)  # fmt: skip

SINGLE = Trig(
    overflow=2.0**119,
    quarters=0.6366197466850281,
    integer=12582912.0,
    half_pi=(1.57080078125, -4.454515874385834e-06, 6.07710062827671e-11),
    split=1.5 * 2.0**17,
    one=1.0,
    half=0.5,
    sixth=11.0 / 64.0,
    third=11.0 / 32.0,
    sine=(0.0052083334885537624, 0.008333330042660236, -0.00019839468586724252, 2.7191274512006203e-06),
    cosine=(0.04166664555668831, -0.00138873013202101, 2.4430670237052254e-05),
)


def constants(dtype: type) -> Trig:
    """The constants of a scalar type."""
    return SINGLE if dtype is np.float32 else DOUBLE


def sincos(x: Any, dtype: type) -> tuple[Any, Any]:
    """Sine and cosine of an array, bit for bit what the emitted C computes; NaN from the limit on."""
    k = constants(dtype)
    bits: Any = np.uint32 if dtype is np.float32 else np.uint64
    one, half, sixth, third = dtype(k.one), dtype(k.half), dtype(k.sixth), dtype(k.third)
    x = np.asarray(x, dtype)
    shifted = x * dtype(k.quarters) + dtype(k.integer)
    n = shifted - dtype(k.integer)
    a, b, tail = x - n * dtype(k.half_pi[0]), n * dtype(k.half_pi[1]), n * dtype(k.half_pi[2])
    r = a - b
    rest = ((a - r) - b) - tail
    split = dtype(k.split) + (x * dtype(k.overflow)) * dtype(0)
    high = (r + split) - dtype(k.split)
    low = (r - high) + rest
    z, square, gap = r * r, high * high, low * (high + half * low)
    zz, part = z * z, sixth * square
    small = (r * z) * polynomial(k.sine, z, zz, dtype) + ((rest - low * part) - r * (third * gap))
    sine = r + (small - high * part)
    cosine = (one - half * square) + (zz * polynomial(k.cosine, z, zz, dtype) - gap)
    q, s, c = (np.atleast_1d(value).view(bits) for value in (shifted, sine, cosine))
    top = bits(8 * bits().itemsize - 1)
    odd, negative = q << top, (q >> bits(1)) << top
    swap = (s ^ c) & (bits(0) - (odd >> top))
    s, c = s ^ swap ^ negative, c ^ swap ^ negative ^ odd
    return s.view(dtype).reshape(x.shape)[()], c.view(dtype).reshape(x.shape)[()]


def polynomial(coefficients: tuple[float, ...], z: Any, zz: Any, dtype: type) -> Any:
    """``c0 + c1 z + zz (c2 + c3 z + zz (...))``: two terms at a time make half the chain of Horner's rule."""
    first, *others = coefficients
    value = dtype(first) + z * dtype(others[0]) if others else dtype(first)
    return value + zz * polynomial(tuple(others[1:]), z, zz, dtype) if len(others) > 1 else value
