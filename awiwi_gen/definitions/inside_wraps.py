"""Tendons through the inside of a sphere or cylinder: straight where that meets the body, else bent at one point of it.

Both ends are outside. The string is as short as it can be with a point on the surface, so there it makes equal angles with
the normal, in the plane of both ends (Alhazen's problem). With the angle G between the ends, the ratios A and B of the
radius to their distances, and the point's angle d from the middle between them, this is

    sin 2d - A sin(d - G/2) - B sin(d + G/2) = 0.

With s = sin(G/2) and c = cos(G/2), n = tan(d) / s is the least root of

    F(n) = n / sqrt(1 + s^2 n^2) - a n + b,    a = c (A + B) / 2,    b = (A - B) / 2,

which is curved towards n = 0 from there to the root, so steps from n = 0 by the parabola that touches F arrive on one side.
A fixed number of them converges to 1e-30 as long as both ends have `INSIDE_CLEARANCE`. They count as constant in
derivatives: the length is stationary in n, so one differentiable step more gives its first and second derivatives.
"""

import sympy
from sympy import Expr

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.wraps import Wrap, clearance
from awiwi_gen.hand.wraps import INSIDE_CLEARANCE

_STEPS = 4


def bent_length(wrap: Wrap, derivation: Derivation) -> Expr:
    """Length [m] of a run through the inside of its body."""
    name, radius = derivation.name, wrap.body.radius
    straight = name(_length(wrap.end - wrap.start))
    distances = [name(_length(point)) for point in (wrap.start, wrap.end)]
    first, last = (derivation.name_all(x / d) for x, d in zip((wrap.start, wrap.end), distances, strict=True))
    bends = derivation.hold(_indicator(lift(wrap)) * _indicator(_nearest(wrap)))
    # Where the string is straight, all that follows is replaced by what always exists.
    ratios = [name(bends * radius / distance) for distance in distances]
    half = derivation.name_all(last - first)
    square = name(bends * half.dot(half) / 4)
    cosine = name(sympy.sqrt(1 - square))
    n = _root(square, name(cosine * sum(ratios) / 2), name((ratios[0] - ratios[1]) / 2), derivation)
    across = name(1 / sympy.sqrt(1 + square * n**2))
    bent = sum(
        name(sympy.sqrt(distance**2 + radius**2 - 2 * distance * radius * across * (cosine - sign * square * n)))
        for sign, distance in zip((1, -1), distances, strict=True)
    )
    planar = name(straight + bends * (bent - straight))
    return planar if wrap.body.axis is None else name(sympy.sqrt(planar**2 + wrap.rise**2))


def converges(wrap: Wrap) -> Expr:
    """Positive where both ends have the clearance that iterations need, or the string is straight."""
    near = _nearest(wrap)
    return _larger(_larger(near - sympy.Rational(INSIDE_CLEARANCE), -near), -lift(wrap))


def lift(wrap: Wrap) -> Expr:
    """How far a straight line misses the body: by the cosines of the ends' angle and of that where it just touches."""
    first, last = wrap.directions
    one, other = (wrap.body.radius / _length(point) for point in (wrap.start, wrap.end))
    return first.dot(last) - one * other + sympy.sqrt(_positive(1 - one**2) * _positive(1 - other**2))


def _root(square: Expr, a: Expr, b: Expr, derivation: Derivation) -> Expr:
    """The least root of F."""
    n = derivation.hold(-b / (1 - a))
    for step in range(_STEPS + 1):
        across = derivation.name(1 / sympy.sqrt(1 + square * n**2))
        value, slope = derivation.name(n * across - a * n + b), derivation.name(across**3 - a)
        if step == _STEPS:
            return derivation.name(n - value / slope)
        curvature = -3 * square * n * across**5
        n = derivation.hold(n - 2 * value / (slope + sympy.sqrt(_positive(slope**2 - 2 * value * curvature))))
    raise AssertionError("there are no steps")


def _nearest(wrap: Wrap) -> Expr:
    """How far the nearer end is outside the body: (distance / radius)^2 - 1."""
    return -_larger(*(-clearance(wrap, point) for point in (wrap.start, wrap.end)))


def _indicator(value: Expr) -> Expr:
    return (1 + sympy.sign(value)) / 2


def _larger(one: Expr, other: Expr) -> Expr:
    return (one + other + abs(one - other)) / 2


def _positive(value: Expr) -> Expr:
    return _larger(value, sympy.S.Zero)


def _length(vector: sympy.Matrix) -> Expr:
    return sympy.sqrt(vector.dot(vector))
