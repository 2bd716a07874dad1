"""Merge a sum (product) into the only sum (product) that reads it.

Products are always merged: what several of them share is found again by `share`, and better so.
"""

from __future__ import annotations

from awiwi_gen.ir.builder import Builder, rebuild
from awiwi_gen.ir.graph import Graph, Node, Ref, node_of


def flatten(graph: Graph) -> Graph:
    """The same graph with longer sums and products."""
    uses = graph.uses

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        if node[0] == "const":
            return builder.const(node[1])
        if node[0] == "input":
            return builder.input(node[1], node[2])
        if node[0] == "param":
            return builder.param(node[1])
        if node[0] not in ("add", "mul"):
            return builder.make(node[0], refs)
        merged: list[Ref] = []
        for old, ref in zip(node[1:], refs, strict=True):
            inner = builder.nodes[node_of(ref)]
            if inner[0] == node[0] == "mul":
                merged += [inner[1] if ref >= 0 else ~inner[1], *inner[2:]]
            elif inner[0] == node[0] == "add" and uses[node_of(old)] == 1:
                merged += inner[1:] if ref >= 0 else [~r for r in inner[1:]]
            elif node[0] == "add" and uses[node_of(old)] == 1 and _scaled_sum(graph, builder, old, ref):
                factor, total = inner[1:]
                terms = [builder.mul((factor, term)) for term in builder.nodes[total][1:]]
                merged += terms if ref >= 0 else [~r for r in terms]
            else:
                merged.append(ref)
        return builder.make(node[0], merged)

    return rebuild(graph, rule)


def _scaled_sum(graph: Graph, builder: Builder, old: Ref, ref: Ref) -> bool:
    """Whether a term is a constant times a sum that nothing else uses."""
    parts = graph.nodes[node_of(old)][1:]
    inner = builder.nodes[node_of(ref)][1:]
    return (
        graph.nodes[node_of(old)][0] == builder.nodes[node_of(ref)][0] == "mul"
        and len(parts) == len(inner) == 2
        and builder.nodes[inner[0]][0] == "const"
        and builder.nodes[inner[1]][0] == "add"
        and all(graph.uses[part] == 1 for part in parts if graph.nodes[part][0] == "add")
    )
