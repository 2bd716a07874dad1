"""Bind the hand's named numbers to their values and fold constants."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from flint import arb, ctx

from awiwi_gen.ir.algebras import FLINT_NAMES, ball
from awiwi_gen.ir.builder import Builder, rebuild
from awiwi_gen.ir.graph import VARIADIC, Graph, Node, Ref

ARITHMETIC = VARIADIC | {"inv", "div"}
FOLDING_BITS = 400  # the rounding of a folded square root stays far below what the pass checks resolve
LEAST = arb(2) ** -300  # what is left of the cosine of a right angle: pi has 100 digits


def bind(graph: Graph, values: Mapping[str, Fraction]) -> Graph:
    """Replace every parameter that has a value by it, exactly; the others stay named."""

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        if node[0] == "param":
            return builder.const(values[node[1]]) if node[1] in values else builder.param(node[1])
        return fold(builder, node, refs)

    return rebuild(graph, rule)


def fill(graph: Graph, values: Mapping[str, Fraction]) -> Graph:
    """Replace parameters by values and simplify nothing: it rounds as the C with run-time parameters does."""
    nodes = (("const", values[node[1]]) if node[0] == "param" else node for node in graph.nodes)
    return Graph(tuple(nodes), graph.outputs)


def fold(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
    """Rebuild a node; a function of constants becomes a constant of 400 bits."""
    if node[0] == "const":
        return builder.const(node[1])
    if node[0] == "input":
        return builder.input(node[1], node[2])
    if node[0] not in ARITHMETIC:
        arguments = [builder.value(ref) for ref in refs]
        if None not in arguments:
            return builder.const(_value(node[0], [a for a in arguments if a is not None]))
    return builder.make(node[0], refs)


def _value(operation: str, arguments: list[Fraction]) -> Fraction:
    with ctx.workprec(FOLDING_BITS):
        result = getattr(arb, FLINT_NAMES.get(operation, operation))(*(ball(a) for a in arguments))
        if not result.is_finite():
            raise ZeroDivisionError(f"{operation}({', '.join(str(float(a)) for a in arguments)}) is not a number")
        if abs(result) < LEAST:
            return Fraction(0)
        mantissa, exponent = result.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
