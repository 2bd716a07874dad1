"""Complete brackets: ``x*(a*y + b*z) + c*y`` is ``(x + c/a)*(a*y + b*z) - (b*c/a)*z``.

That pays where the sum has a term in z already, or where z is a constant or x itself, for which the bracket has room.
Only sines and cosines are shifted, and by no more than what they may be themselves: then little cancels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from awiwi_gen.ir.builder import Builder, copy_node, rebuild
from awiwi_gen.ir.graph import Graph, Node, Ref, node_of

Factors = tuple[int, ...]  # of a term, besides its coefficient; none for a constant
Terms = dict[Factors, Fraction]


@dataclass(frozen=True)
class _Bracket:
    """A term of a sum that is x times a bracket, and by how much x is to be shifted."""

    position: int
    x: int
    inner: Terms
    by: Fraction


def shift(graph: Graph) -> Graph:
    """The same graph with fewer terms beside brackets."""
    found: dict[Node, _Bracket] = {}
    shifted: set[tuple[int, Fraction]] = set()
    for node in graph.nodes:
        if node[0] == "add" and (bracket := _best(graph, node, shifted)):
            found[node] = bracket
            shifted.add((bracket.x, bracket.by))
    if not found:
        return graph
    renamed: dict[Node, Ref] = {}

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        result = copy_node(builder, node, refs)
        if node in found:
            result = _completed(builder, found[node], list(refs), node[found[node].position] >= 0, new)
        renamed[node] = result
        return result

    def new(index: int) -> Ref:
        return renamed[graph.nodes[index]]

    return rebuild(graph, rule)


def _best(graph: Graph, node: Node, shifted: set[tuple[int, Fraction]]) -> _Bracket | None:
    """The shift that saves most operations of a sum."""
    outer = _terms(graph, node)
    best, most = None, 0
    for position, ref in enumerate(node[1:], 1):
        product = graph.nodes[node_of(ref)]
        if product[0] != "mul" or len(product) != 3 or graph.uses[node_of(ref)] > 1:
            continue
        for x, bracket in (product[1:], product[:0:-1]):
            if graph.nodes[bracket][0] != "add" or graph.uses[bracket] > 1 or graph.nodes[x][0] not in ("cos", "sin"):
                continue
            inner = _terms(graph, graph.nodes[bracket])
            for factors in [common for common in inner if common in outer and common not in ((), (x,))]:
                times = outer[factors] / inner[factors]
                by = times if ref >= 0 else -times
                gain = _gain(x, inner, outer, times) - ((x, by) not in shifted)
                if gain > most and abs(by) <= 1:
                    best, most = _Bracket(position, x, inner, by), gain
    return best


def _terms(graph: Graph, node: Node) -> Terms:
    """A sum's coefficients."""
    terms: Terms = {}
    for ref in node[1:]:
        factor, index = Fraction(1 if ref >= 0 else -1), node_of(ref)
        factors: Factors = (index,)
        if graph.nodes[index][0] == "const":
            factors = ()
            factor *= graph.nodes[index][1]
        elif graph.nodes[index][0] == "mul" and graph.nodes[graph.nodes[index][1]][0] == "const":
            factors = graph.nodes[index][2:]
            factor *= graph.nodes[graph.nodes[index][1]][1]
        terms[factors] = factor
    return terms


def _gain(x: int, inner: Terms, outer: Terms, times: Fraction) -> int:
    """Operations saved where the outer sum loses its part of the inner one."""
    inside, outside = () in inner, () in outer
    gain = -((x,) in inner and not inside) - (((x,) in inner or inside) and not outside)
    for factors in inner.keys() - {(), (x,)}:
        before = outer.get(factors, Fraction(0))
        gain += _price(before) - _price(before - times * inner[factors])
    return gain


def _price(coefficient: Fraction) -> int:
    """Operations of a term with this coefficient."""
    return 0 if not coefficient else 1 if abs(coefficient) == 1 else 2


def _completed(builder: Builder, found: _Bracket, refs: list[Ref], plus: bool, new: Callable[[int], Ref]) -> Ref:
    """The sum with its bracket completed."""
    x, by = found.x, found.by
    inner = {(): Fraction(0), (x,): Fraction(0)} | found.inner
    inner[()] -= by * inner[x,]

    def products(terms: Terms, times: Fraction | int) -> list[Ref]:
        return [builder.mul([builder.const(c * times), *map(new, factors)]) for factors, c in terms.items()]

    del refs[found.position - 1]
    product = builder.mul((builder.add((new(x), builder.const(by))), builder.add(products(inner, 1))))
    del inner[x,]
    return builder.add([*refs, product if plus else ~product, *products(inner, -by if plus else by)])
