"""Complete brackets: ``x*(a*y + b*z) + c*y`` is ``(x + c/a)*(a*y + b*z) - (c*b/a)*z``.

That pays where the sum has a term in z already, or where z is x itself or a constant, whose share fits in the bracket.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from awiwi_gen.ir.builder import Builder, copy_node, rebuild
from awiwi_gen.ir.graph import Graph, Node, Ref, node_of

Terms = dict[int | None, Fraction]  # coefficients of nodes; that of None is the constant


def shift(graph: Graph) -> Graph:
    """The same graph with fewer terms beside brackets."""
    uses = graph.uses
    shifted: set[tuple[int, Fraction]] = set()

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        if node[0] != "add":
            return copy_node(builder, node, refs)
        for old, ref in zip(node[1:], refs, strict=True):
            product = builder.nodes[node_of(ref)]
            if product[0] != "mul" or len(product) != 3 or uses[node_of(old)] > 1:
                continue
            for x, bracket in (product[1:], product[:0:-1]):
                alone = any(uses[r] == 1 and graph.nodes[r][0] == "add" for r in graph.nodes[node_of(old)][1:])
                if builder.nodes[bracket][0] == "add" and alone and builder.nodes[x][0] != "const":
                    inner, outer = _terms(builder, builder.nodes[bracket][1:]), _terms(builder, refs)
                    by = _best(builder, x, inner, outer, 1 if ref >= 0 else -1, shifted)
                    if by:
                        shifted.add((x, by))
                        return _shifted(builder, x, by, inner, [r for r in refs if r != ref], ref >= 0)
        return copy_node(builder, node, refs)

    return rebuild(graph, rule)


def _terms(builder: Builder, refs: Iterable[Ref]) -> Terms:
    return {base: coefficient for coefficient, base in map(builder.split, refs)}


def _best(builder: Builder, x: int, inner: Terms, outer: Terms, sign: int, shifted: set[tuple[int, Fraction]]) -> Fraction | None:
    """The shift of x that saves most operations."""
    found = None
    most = 0
    for base, coefficient in inner.items():
        if base is None or base == x or base not in outer:
            continue
        by = sign * outer[base] / coefficient
        gain = -1 if (x, by) not in shifted else 0
        gain -= x in inner and None not in inner
        for other, value in inner.items():
            if other is None or other == x:
                continue
            before = outer.get(other, Fraction(0))
            gain += _price(before) - _price(before - sign * by * value)
        gain -= (None in inner or x in inner) and None not in outer
        if gain > most:
            found, most = by, gain
    return found


def _price(coefficient: Fraction) -> int:
    """Operations of a term with this coefficient."""
    return 0 if not coefficient else 1 if abs(coefficient) == 1 else 2


def _shifted(builder: Builder, x: int, by: Fraction, inner: Terms, others: list[Ref], plus: bool) -> Ref:
    inner = {**inner, None: inner.get(None, Fraction(0)) - by * inner.get(x, Fraction(0))}
    sign = 1 if plus else -1

    def sums(terms: Terms) -> list[Ref]:
        return [builder.const(c) if base is None else builder.scaled(c, base) for base, c in terms.items() if c]

    left = sums({base: -sign * by * c for base, c in inner.items() if base != x})
    product = builder.mul((builder.add((x, builder.const(by))), builder.add(sums(inner))))
    return builder.add([*others, *left, product if plus else ~product])
