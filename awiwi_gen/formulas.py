"""Graphs back into SymPy, to be read: an expression for each output element, shared parts by a name where it helps."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from typing import Any

import sympy

from awiwi_gen.ir.graph import LEAVES, Graph, Node, Ref, node_of, operands

OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": sympy.Add, "mul": sympy.Mul, "div": lambda a, b: a / b, "inv": lambda a: 1 / a,
    "sin": sympy.sin, "cos": sympy.cos, "tan": sympy.tan, "asin": sympy.asin, "acos": sympy.acos, "atan": sympy.atan,
    "atan2": sympy.atan2, "exp": sympy.exp, "log": sympy.log, "fabs": sympy.Abs, "sqrt": sympy.sqrt,
}  # fmt: skip
UNNAMED = LEAVES | {"sin", "cos"}
Parts = list[tuple[sympy.Symbol, sympy.Expr]]


def formulas(graph: Graph, most: int, scalars: Collection[str] = ()) -> tuple[Parts, dict[str, list[sympy.Expr]]]:
    """Named parts, then the expressions of all elements of each output; ports named in ``scalars`` have no index.

    Parts that several expressions share have names only where the formulas would have more than ``most`` operations
    without them; sines and cosines never have.
    """
    named, shares = numbers(graph), expanded(graph) > most
    values: list[Any] = []
    parts: Parts = []

    def leaf(node: Node) -> sympy.Symbol:
        if node[0] == "param":
            return named[node[1]]
        return sympy.Symbol(node[1] if node[1] in scalars else f"{node[1]}_{node[2]}", real=True)

    def at(ref: Ref) -> Any:
        return values[ref] if ref >= 0 else -values[~ref]

    for index, node in enumerate(graph.nodes):
        value = _value(node, leaf, at)
        if shares and node[0] not in UNNAMED and graph.uses[index] > 1 and not value.is_Atom:
            parts.append((sympy.Symbol(f"t_{len(parts)}", real=True), value))
            value = parts[-1][0]
        values.append(value)
    return parts, {output.name: [at(ref) for ref in output.elements] for output in graph.outputs}


def _value(node: Node, leaf: Callable[[Node], sympy.Symbol], at: Callable[[Ref], Any]) -> Any:
    if node[0] == "const":
        return sympy.Rational(node[1].numerator, node[1].denominator)
    return leaf(node) if node[0] in LEAVES else OPERATIONS[node[0]](*map(at, node[1:]))


def numbers(graph: Graph) -> dict[str, sympy.Symbol]:
    """The symbol of each number of the hand: ``com_1,0`` for links[1].com[0]; the whole path where two look alike."""
    found = {path: _number(path) for path in graph.params}
    taken = [*found.values(), *(sympy.Symbol(node[1], real=True) for node in graph.nodes if node[0] == "input")]
    return {path: s if taken.count(s) == 1 else sympy.Symbol(path, real=True) for path, s in found.items()}


def _number(path: str) -> sympy.Symbol:
    *_, last = re.findall(r"[A-Za-z]\w*", path)
    indices = ",".join(re.findall(r"\[(\d+)\]", path))
    return sympy.Symbol(f"{last}_{indices}" if indices else last, real=True)


def expanded(graph: Graph) -> int:
    """The number of operations if nothing was shared."""
    sizes: list[int] = []
    for node in graph.nodes:
        refs = operands(node)
        sizes.append(sum(sizes[node_of(ref)] for ref in refs) + max(1, len(refs) - 1) if refs else 0)
    return sum(sizes[node_of(ref)] for ref in graph.roots)
