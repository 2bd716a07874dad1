"""The error bound of our own sine and cosine in double precision, proven: every rounding followed in ball arithmetic.

The reduced angle is r + rest, r a double and rest what its rounding lost. The interval of r is cut into pieces; on each
piece every rounding of the algorithm is bounded by half a unit in the last place of the largest value it rounds, and
the polynomials' distance from sine and cosine by their common Taylor expansion about the middle of the piece.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from math import floor, log2

import pytest
from flint import arb, arb_series, ctx

from awiwi_gen.ir.trig import DOUBLE, ULPS

U = 2.0**-53
STEP = 2.0**-14  # of the upper part of r
TOP = 0.7853981633974483 + 3e-13  # r beyond pi/4 where rounding chose the other quadrant's edge
REST = 2.0**-54 + 2.0**-58  # half a unit in the last place of the largest r, and the third part of pi/2
PIECES = 100  # to every power of two
TERMS = 16


def half_unit(x: float) -> float:
    """Half a unit in the last place of numbers up to x."""
    return 2.0 ** (floor(log2(x)) - 53) if x > 0 else 0.0


def top(x: arb) -> float:
    return float(abs(x).upper())


@dataclass
class Value:
    """What a variable is in exact arithmetic on this piece, and how far the computed one may be from it."""

    exact: arb
    error: float = 0.0

    def __add__(self, other: Value) -> Value:
        return rounded(self.exact + other.exact, self.error + other.error)

    def __sub__(self, other: Value) -> Value:
        return rounded(self.exact - other.exact, self.error + other.error)

    def __mul__(self, other: Value) -> Value:
        error = top(self.exact) * other.error + top(other.exact) * self.error + self.error * other.error
        return rounded(self.exact * other.exact, error)


def rounded(exact: arb, error: float) -> Value:
    return Value(exact, error + half_unit(top(exact) + error))


def polynomial(coefficients: tuple[float, ...], z: Value, zz: Value) -> Value:
    """As in the algorithm: two terms at a time."""
    first, *others = (Value(arb(c)) for c in coefficients)
    value = first + z * others[0] if others else first
    return value + zz * polynomial(coefficients[2:], z, zz) if len(others) > 1 else value


def plain(coefficients: tuple[float, ...], z: arb_series) -> arb_series:
    value = arb_series([0])
    for c in reversed(coefficients):
        value = value * z + c
    return value


def distance(difference: arb_series, radius: float) -> float:
    """Largest magnitude of a Taylor expansion over a piece; beyond its terms that of sine or cosine is left."""
    terms = sum(top(difference[k]) * radius**k for k in range(TERMS))
    return terms + radius**TERMS


def bounds(low_end: float, high_end: float) -> tuple[float, float]:
    """Errors of sine and cosine for r between two numbers, in units in the last place of the results."""
    k, middle, radius = DOUBLE, (low_end + high_end) / 2, (high_end - low_end) / 2
    ball = arb(middle, radius)
    r = Value(ball)
    high = Value(ball + arb(0, STEP / 2))  # it and what is said to be exact has no rounding error
    rest = Value(arb(0, REST), U * REST + 2.0**-111)
    low = rounded(arb(0, STEP / 2 + REST), rest.error)
    z, gap = r * r, low * (high + Value(arb(0.5) * low.exact, 0.5 * low.error))
    zz = z * z
    square = Value(high.exact * high.exact)
    part = Value(k.sixth * square.exact)
    small = (r * z) * polynomial(k.sine, z, zz) + ((rest - low * part) - r * (Value(arb(k.third)) * gap))
    added = small - Value(high.exact * part.exact)
    flat = zz * polynomial(k.cosine, z, zz) - gap

    x = arb_series([arb(middle), 1])
    sine, cosine = x.sin(), x.cos()
    p = x - arb(k.sixth) * x * x * x + x * x * x * plain(k.sine, x * x)
    q = 1 - x * x / 2 + x * x * x * x * plain(k.cosine, x * x)
    off = REST * (top(ball.cos() - 1 + 3 * arb(k.sixth) * ball * ball) + k.sixth * STEP / 2 * (3 * high_end + STEP))
    sine_error = added.error + distance(p - sine, radius) + off + REST**2
    off = REST * (top(ball.sin() - ball) + STEP)
    cosine_error = flat.error + distance(q - cosine, radius) + off + REST**2
    units = [2.0 ** (floor(log2(float(f.lower()))) - 52) for f in (ball.sin(), ball.cos())]
    return 0.5 + sine_error / units[0], 0.5 + cosine_error / units[1]


@pytest.fixture(autouse=True)
def precision():
    ctx.prec, ctx.cap = 150, TERMS
    yield
    ctx.prec, ctx.cap = 53, 10


def test_the_error_is_below_the_stated_one_for_every_double_of_the_domain():
    """Below 2^-26 what is added to r is less than half a unit in its last place, and is known to 50 bits."""
    ends = [2.0**e * (1 + i / PIECES) for e in range(-26, 0) for i in range(PIECES)]
    found = [bounds(a, min(b, TOP)) for a, b in itertools.pairwise(ends) if a < TOP]

    assert max(sine for sine, _ in found) < ULPS
    assert max(cosine for _, cosine in found) < ULPS


def test_parts_of_half_pi_have_bits_to_spare_for_every_multiple_and_miss_it_by_next_to_nothing():
    limit = round(DOUBLE.limit * 2 / 3.14) + 1
    first, second, third = DOUBLE.half_pi
    for part, last in ((first, 2.0**-42), (second, 2.0**-67)):
        multiple = part / last

        assert multiple == int(multiple)
        assert limit * multiple < 2**53
    missing = arb.pi() / 2 - first - second - third

    assert limit * top(missing) + half_unit(limit * third) < 2.0**-111
    assert limit * third + 2.0**-54 < REST


def test_upper_parts_have_so_few_bits_that_squares_and_cubes_are_exact():
    sixth, upper = DOUBLE.sixth * 2**11, round(1.0 / STEP)

    assert sixth == int(sixth)
    assert (0.79 * upper + 1) ** 3 * sixth < 2**53
