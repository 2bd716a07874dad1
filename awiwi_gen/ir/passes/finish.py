"""The last passes before scheduling: quotients, and signs that cost nothing.

These leave the canonical form on purpose: from here on the order of operands is the order of rounding.
"""

from __future__ import annotations

from awiwi_gen.ir.graph import LEAVES, Graph, Node, Output, Ref, node_of, prune


def quotients(graph: Graph) -> Graph:
    """``a * inv(b)`` becomes ``div(a, b)`` where the reciprocal is used once; shared ones stay shared."""
    uses = graph.uses
    nodes: list[Node] = []
    for node in graph.nodes:
        if node[0] == "mul":
            single = [r for r in node[1:] if graph.nodes[r][0] == "inv" and uses[r] == 1]
            if single:
                factors = [r for r in node[1:] if r != single[0]]
                if len(factors) == 1:
                    node = ("div", factors[0], graph.nodes[single[0]][1])
        nodes.append(node)
    return prune(Graph(tuple(nodes), graph.outputs))


def orient(graph: Graph) -> Graph:
    """Let minus signs fall where they cost nothing, and start every sum with a positive term.

    Walks from the outputs down: a node whose uses would all pay for a minus computes its negative instead,
    by negating its terms, its constant, or a factor that only it uses.
    """
    nodes = list(graph.nodes)
    uses = graph.uses
    outputs = [list(output.elements) for output in graph.outputs]
    paid = [0] * len(nodes)  # uses with a minus that would be an operation, less those without
    for ref in graph.roots:
        paid[node_of(ref)] += 1 if ref < 0 else -uses[node_of(ref)]
    negated = [False] * len(nodes)
    for index in range(len(nodes) - 1, -1, -1):
        operation, *refs = nodes[index]
        if operation in LEAVES:
            continue
        if paid[index] == uses[index]:
            negated[index] = _negate(nodes, uses, operation, refs)
        for ref in refs:
            free = operation == "add" and nodes[node_of(ref)][0] != "add"
            paid[node_of(ref)] += 1 if ref < 0 and not free else -uses[node_of(ref)]
        nodes[index] = (operation, *refs)

    def new(ref: Ref) -> Ref:
        return ~ref if negated[node_of(ref)] else ref

    for index, (operation, *refs) in enumerate(nodes):
        if operation not in LEAVES:
            refs = [new(ref) for ref in refs]
            if operation == "add":
                refs.sort(key=lambda ref: ref < 0)
            nodes[index] = (operation, *refs)
    return Graph(
        tuple(nodes),
        tuple(
            Output(o.name, o.shape, tuple(new(r) for r in elements))
            for o, elements in zip(graph.outputs, outputs, strict=True)
        ),
    )


def _negate(nodes: list[Node], uses: tuple[int, ...], operation: str, refs: list[Ref]) -> bool:
    """Negate a node in place at no cost; False where that is impossible."""
    if operation == "add":
        refs[:] = [~ref for ref in refs]
        return True
    if operation not in ("mul", "div"):
        return False
    for position, ref in enumerate(refs):
        kind = nodes[node_of(ref)][0]
        if kind == "const" or (kind == "add" and uses[node_of(ref)] == 1):
            refs[position] = ~ref
            return True
    return False
