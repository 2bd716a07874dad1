"""Arctangent and exponential function of our own: constants, once for C and Python, and both on NumPy arrays.

Only + - * /, comparisons as masks, and bit operations, no branches: the same bits on every IEEE machine.

`atan2`: the smaller of |y| and |x| is divided by the larger, or, above tan(pi/8), their difference by their sum, so that
the quotient r stays below tan(pi/8) in magnitude; its remainder is computed exactly (factors are cut in halves by
their bits) and divided too. The angle is k pi/4 +- atan r, with pi/4 in two parts, the first short enough that its
multiples are exact.

`exp`: x = n log 2 + r with log 2 in two parts; 1 + r is added exactly, the rest is small; 2^n is put into the exponent.

Polynomials are minimax fits, of (atan r - r)/r^3 in r^2 and of (exp r - 1 - r)/r^2 in r.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.ir.trig import ULPS as SINCOS_ULPS
from awiwi_gen.ir.trig import polynomial, sincos


@dataclass(frozen=True)
class Elementary:
    """Constants for one scalar type; all are exact in it."""

    eighth: float  # tan(pi/8), nearly
    quarter_pi: tuple[float, float]
    arctan: tuple[float, ...]
    half_bits: int  # a number without its last so many bits has an exact square
    overflow: float  # a number times this is infinite from the limit of exp on
    shrink: float  # 1/log(2), without that factor
    integer: float  # adding it rounds to an integer, which the lowest bits of the sum then hold
    log_two: tuple[float, float]
    exp: tuple[float, ...]
    digits: int  # of the significand, without the leading one

    @property
    def limit(self) -> float:
        """The smallest magnitude beyond the domain of exp, a power of two."""
        return 2.0**1023 / self.overflow * 2.0 if self.digits == 52 else 2.0**128 / self.overflow


DOUBLE = Elementary(
    eighth=0.4142135623730951,
    quarter_pi=(0.7853981633974483, 3.061616997868383e-17),
    arctan=(
        -0.333333333333332, 0.19999999999953683, -0.14285714280201212, 0.11111110783599737, -0.09090897761107664,
        0.07692060281101173, -0.06663104964720176, 0.05847897458255565, -0.05039348766772419, 0.0380658726543648,
        -0.017908857935075236,
    ),
    half_bits=27,
    overflow=2.0**1015,
    shrink=1.4426950408889634 * 2.0**-1015,
    integer=6755399441055744.0,
    log_two=(0.6931471806019545, -4.2009150726810846e-11),
    exp=(
        0.5, 0.16666666666666688, 0.041666666666666824, 0.008333333333313892, 0.0013888888888777793,
        0.00019841269903343693, 2.4801587559187714e-05, 2.7557228882791517e-06, 2.755707617185051e-07,
        2.5115329606740797e-08, 2.101509672607565e-09,
    ),
    digits=52,
)  # fmt: skip

SINGLE = Elementary(
    eighth=0.4142135679721832,
    quarter_pi=(0.785398006439209, 1.5695823663008923e-07),
    arctan=(-0.33333316445350647, 0.19998528063297272, -0.14244391024112701, 0.1059916764497757, -0.06090046837925911),
    half_bits=12,
    overflow=2.0**122,
    shrink=1.4426950216293335 * 2.0**-122,
    integer=12582912.0,
    log_two=(0.693145751953125, 1.428606765330187e-06),
    exp=(0.4999999403953552, 0.16666516661643982, 0.04166810214519501, 0.008369192481040955, 0.001383890165016055),
    digits=23,
)


def numbers(dtype: type) -> Elementary:
    """The constants of a scalar type."""
    return SINGLE if dtype is np.float32 else DOUBLE


def atan2(y: Any, x: Any, dtype: type) -> Any:
    """Angle of the point (x, y), bit for bit what the emitted C computes.

    NaN at infinity and where both are zero or less than every normal number.
    """
    k, one, two = numbers(dtype), dtype(1), dtype(2)
    y, x = np.broadcast_arrays(np.asarray(y, dtype), np.asarray(x, dtype))
    u, v = np.abs(y), np.abs(x)
    small, big = np.where(u > v, v, u), np.where(u > v, u, v)
    middle = (small > dtype(k.eighth) * big).astype(dtype)
    less, more = middle * big, middle * small
    above, below = small - less, big + more
    lost, missed = small - (above + less), more - (below - big)
    r = above / below
    (r_high, r_low), (b_high, b_low) = halves(r, k, dtype), halves(below, k, dtype)
    remainder = (((above - r_high * b_high) - r_high * b_low) - r_low * b_high) - r_low * b_low
    tail = (remainder + (lost - r * missed)) * (one / below)
    z = r * r
    rest = r * (z * polynomial(k.arctan, z, z * z, dtype)) + (tail - z * tail)
    back = np.where(np.signbit(x), -one, one)
    flat = np.where(u > v, -one, one)
    sign = back * flat
    quarters = (two - back * (one + flat)) + sign * middle
    whole, part = quarters * dtype(k.quarter_pi[0]), sign * r
    total = whole + part
    lower = quarters * dtype(k.quarter_pi[1]) + sign * rest
    angle = total + ((part - (total - whole)) + lower)
    return np.where(np.signbit(y), -angle, angle)[()]


def halves(x: Any, k: Elementary, dtype: type) -> tuple[Any, Any]:
    """A number as a sum of two whose products are exact."""
    bits: Any = np.uint32 if dtype is np.float32 else np.uint64
    upper = np.atleast_1d(x).view(bits) >> bits(k.half_bits) << bits(k.half_bits)
    high = upper.view(dtype).reshape(np.shape(x))
    return high, x - high


def exp(x: Any, dtype: type) -> Any:
    """Exponential function, bit for bit what the emitted C computes; NaN from the limit on, either way."""
    k = numbers(dtype)
    bits: Any = np.uint32 if dtype is np.float32 else np.uint64
    x = np.asarray(x, dtype)
    shifted = (x * dtype(k.overflow)) * dtype(k.shrink) + dtype(k.integer)
    n = shifted - dtype(k.integer)
    a, b = x - n * dtype(k.log_two[0]), n * dtype(k.log_two[1])
    r = a - b
    tail = (a - r) - b
    whole = dtype(1) + r
    z = r * r
    rest = (r - (whole - dtype(1))) + (z * polynomial(k.exp, r, z, dtype) + tail)
    scale = np.atleast_1d(shifted).view(bits) << bits(k.digits)
    power = (scale + np.atleast_1d(dtype(1)).view(bits)).view(dtype).reshape(x.shape)
    return ((whole + rest) * power)[()]


# What the C computes by functions of our own, on arrays of a scalar type.
OWN: dict[str, Callable[..., Any]] = {
    "sin": lambda x, dtype: sincos(x, dtype)[0],
    "cos": lambda x, dtype: sincos(x, dtype)[1],
    "atan": lambda x, dtype: atan2(x, 1, dtype),
    "atan2": atan2,
    "exp": exp,
}
ULPS = {"sin": SINCOS_ULPS, "cos": SINCOS_ULPS, "atan": 0.75, "atan2": 0.75, "exp": 0.8}  # their errors, at most
