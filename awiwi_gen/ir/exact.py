"""Values of graphs that depend on numbers of the hand alone."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from flint import arb, ctx

from awiwi_gen.ir.algebras import FLINT_NAMES, ball
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate

BITS = 400  # the rounding stays far below what the pass checks resolve


class _Balls:
    """Balls, one number at a time."""

    const = staticmethod(ball)
    neg = staticmethod(lambda a: -a)
    add = staticmethod(lambda a, b: a + b)
    sub = staticmethod(lambda a, b: a - b)
    mul = staticmethod(lambda a, b: a * b)
    div = staticmethod(lambda a, b: a / b)

    def call(self, operation: str, *args: arb) -> arb:
        return getattr(arb, FLINT_NAMES.get(operation, operation))(*args)


def exact_values(graph: Graph, values: Mapping[str, Fraction]) -> dict[str, Fraction]:
    """The first element of each output, to 400 bits; zero where these leave nothing of it.

    Raises ZeroDivisionError where one is no finite number.
    """

    def leaf(node: Node) -> Any:
        return ball(values[node[1]])

    with ctx.workprec(BITS):
        found = {name: elements[0] for name, elements in evaluate(graph, _Balls(), leaf).items()}
        return {name: _fraction(name, value) for name, value in found.items()}


def _fraction(name: str, value: arb) -> Fraction:
    if not value.is_finite():
        raise ZeroDivisionError(f"{name} is not a number")
    if value.contains(0):
        return Fraction(0)
    mantissa, exponent = value.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
