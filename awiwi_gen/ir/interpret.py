"""The one interpreter: a graph evaluated in any algebra.

The same ten lines give floating-point results, 200-bit results, error bounds, dimensions and CasADi
expressions. Operands are combined from left to right, exactly as the emitted C does.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, Protocol, TypeVar

from awiwi_gen.ir.graph import LEAVES, Graph, Node, Ref, node_of, operands

T = TypeVar("T")


class Algebra(Protocol[T]):
    """What a value must be able to do."""

    def const(self, value: Fraction) -> T: ...
    def neg(self, a: T) -> T: ...
    def add(self, a: T, b: T) -> T: ...
    def sub(self, a: T, b: T) -> T: ...
    def mul(self, a: T, b: T) -> T: ...
    def div(self, a: T, b: T) -> T: ...
    def call(self, operation: str, *args: T) -> T: ...


def evaluate(graph: Graph, algebra: Algebra[T], leaf: Callable[[Node], T]) -> dict[str, list[T]]:
    """Values of all output elements, by output name.

    ``leaf`` gives the value of an ``("input", port, element)`` or ``("param", path)`` node.
    """
    values: list[T] = []
    last = graph.last_uses
    gone: Any = None

    def at(ref: Ref) -> T:
        return values[ref] if ref >= 0 else algebra.neg(values[~ref])

    for index, node in enumerate(graph.nodes):
        values.append(_node(node, algebra, leaf, values, at))
        for ref in operands(node):  # batches are large: free values after their last use
            if last[node_of(ref)] == index:
                values[node_of(ref)] = gone
    return {output.name: [at(ref) for ref in output.elements] for output in graph.outputs}


def _node(node: Node, algebra: Algebra[T], leaf: Callable[[Node], T], values: list[T], at: Callable[[Ref], T]) -> T:
    operation = node[0]
    if operation == "const":
        return algebra.const(node[1])
    if operation in LEAVES:
        return leaf(node)
    result = at(node[1])
    if operation == "add":
        for ref in node[2:]:
            result = algebra.add(result, values[ref]) if ref >= 0 else algebra.sub(result, values[~ref])
        return result
    if operation == "mul":
        for ref in node[2:]:
            result = algebra.mul(result, at(ref))
        return result
    if operation == "div":
        return algebra.div(result, at(node[2]))
    if operation == "inv":
        return algebra.div(algebra.const(Fraction(1)), result)
    return algebra.call(operation, result, *(at(ref) for ref in node[2:]))
