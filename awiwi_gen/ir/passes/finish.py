"""The last steps before C: quotients, signs that cost nothing, and the order of evaluation.

These leave the canonical form on purpose: from here on the order of operands is the order of rounding.
"""

from __future__ import annotations

from awiwi_gen.ir.graph import LEAVES, Graph, Node, Output, Ref, node_of, operands, prune


def quotients(graph: Graph) -> Graph:
    """``a * inv(b)`` becomes ``div(a, b)`` where the reciprocal is used once; shared ones stay shared."""
    uses = graph.uses
    nodes: list[Node] = []
    for node in graph.nodes:
        if node[0] == "mul":
            lone = [r for r in node[1:] if graph.nodes[r][0] == "inv" and uses[r] == 1]
            if lone:
                factors = [r for r in node[1:] if r != lone[0]]
                if len(factors) == 1:
                    node = ("div", factors[0], graph.nodes[lone[0]][1])
        nodes.append(node)
    return prune(Graph(tuple(nodes), graph.outputs))


def orient(graph: Graph) -> Graph:
    """Turn nodes that are only used with a minus, and start every sum with a positive term."""
    negative, positive = _signs_of_use(graph)
    nodes: list[Node] = []
    turned = [False] * len(graph.nodes)

    def new(ref: Ref) -> Ref:
        return ~ref if turned[node_of(ref)] else ref

    for index, node in enumerate(graph.nodes):
        if node[0] in LEAVES:
            nodes.append(node)
            continue
        refs = [new(ref) for ref in node[1:]]
        only_negative = bool(negative[index]) and not positive[index]
        if node[0] == "add":
            if only_negative or all(ref < 0 for ref in refs):
                refs = [~ref for ref in refs]
                turned[index] = True
            refs.sort(key=lambda ref: ref < 0)
        elif node[0] == "mul" and graph.nodes[node_of(refs[0])][0] == "const" and only_negative:
            refs[0] = ~refs[0]
            turned[index] = True
        nodes.append((node[0], *refs))
    outputs = tuple(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)
    return Graph(tuple(nodes), outputs)


def _signs_of_use(graph: Graph) -> tuple[list[int], list[int]]:
    """How often each node is used with a minus that costs an operation, and how often without."""
    negative = [0] * len(graph.nodes)
    positive = [0] * len(graph.nodes)
    for node in graph.nodes:
        for ref in operands(node):
            if node[0] == "add" and graph.nodes[node_of(ref)][0] == "mul":
                positive[node_of(ref)] += 1  # a sum takes either sign of a product for nothing
            else:
                (positive if ref >= 0 else negative)[node_of(ref)] += 1
    for ref in graph.roots:
        (positive if ref >= 0 else negative)[node_of(ref)] += 1
    return negative, positive


def schedule(graph: Graph) -> Graph:
    """Evaluate depth first from the outputs, so that few values are alive at any time."""
    order: list[int] = []
    placed = [False] * len(graph.nodes)
    stack = [(node_of(ref), False) for ref in reversed(list(graph.roots))]
    while stack:
        index, expanded = stack.pop()
        if placed[index]:
            continue
        if expanded:
            placed[index] = True
            order.append(index)
            continue
        stack.append((index, True))
        stack += [(node_of(ref), False) for ref in reversed(operands(graph.nodes[index])) if not placed[node_of(ref)]]
    position = {old: new for new, old in enumerate(order)}

    def new(ref: Ref) -> Ref:
        return position[ref] if ref >= 0 else ~position[~ref]

    nodes = tuple(
        node if node[0] in LEAVES else (node[0], *(new(r) for r in node[1:]))
        for node in (graph.nodes[i] for i in order)
    )
    outputs = tuple(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)
    return Graph(nodes, outputs)
