"""Factor out: ``a*b + a*c`` becomes ``a*(b + c)``.

Only products that nothing else uses are taken apart. The factor found in most terms goes first.
"""

from __future__ import annotations

from collections import Counter

from awiwi_gen.ir.builder import Builder, copy_node, rebuild
from awiwi_gen.ir.graph import Graph, Node, Ref, node_of


def factor(graph: Graph) -> Graph:
    """The same graph with fewer multiplications."""
    uses = graph.uses
    if not any(_has_common_factors(graph, node) for node in graph.nodes if node[0] == "add"):
        return graph

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        if node[0] != "add":
            return copy_node(builder, node, refs)
        private: list[Ref] = []
        fixed: list[Ref] = []
        for old, ref in zip(node[1:], refs, strict=True):
            is_product = builder.nodes[node_of(ref)][0] == "mul"
            (private if is_product and uses[node_of(old)] == 1 else fixed).append(ref)
        return bracket(builder, private, fixed)

    return rebuild(graph, rule)


def _has_common_factors(graph: Graph, total: Node) -> bool:
    """Whether a sum has two terms with a factor in common, one of them a product that nothing else uses."""
    terms = [node_of(ref) for ref in total[1:]]
    private = [t for t in terms if graph.nodes[t][0] == "mul" and graph.uses[t] == 1]
    factors: set[Ref] = set()
    for product in private:
        own = graph.nodes[product][1:]
        if not factors.isdisjoint(own):
            return True
        factors.update(own)
    return bool(factors) and any(t in factors for t in terms if t not in private)


def bracket(builder: Builder, products: list[Ref], others: list[Ref]) -> Ref:
    """The sum of ``products`` and ``others`` with the products' common factors taken out."""
    factors = {ref: list(builder.nodes[node_of(ref)][1:]) for ref in products}
    counts = Counter(f for fs in factors.values() for f in set(fs))
    for ref in others:  # a bare x is 1*x
        if node_of(ref) in counts:
            counts[node_of(ref)] += 1
    best = min(counts, key=lambda f: (-counts[f], f), default=None)
    if best is None or counts[best] < 2:
        return builder.add([*products, *others])
    inside, rest = [], []
    for ref in products:
        if best in factors[ref]:
            remaining = factors[ref].copy()
            remaining.remove(best)
            inner = builder.mul(remaining)
            inside.append(inner if ref >= 0 else ~inner)
        else:
            rest.append(ref)
    left = []
    for ref in others:
        if node_of(ref) == best:
            inside.append(builder.const(1 if ref >= 0 else -1))
        else:
            left.append(ref)
    deeper = [r for r in inside if builder.nodes[node_of(r)][0] == "mul"]
    plain = [r for r in inside if builder.nodes[node_of(r)][0] != "mul"]
    term = builder.mul([best, bracket(builder, deeper, plain)])
    return bracket(builder, rest, [*left, term])
