"""Choose for every value whether it or its negative is computed, so that fewer minus signs are operations of their own.

`orient` decides from the outputs down, once for each node. Here a node is negated together with the
products that read it wherever that helps, until nothing does.
"""

from __future__ import annotations

from awiwi_gen.ir.graph import LEAVES, Graph, Node, Output, Ref, node_of, operands


class _Signs:
    """A choice of signs, and what it costs."""

    def __init__(self, graph: Graph) -> None:
        self.nodes = graph.nodes
        self.negated = [False] * len(graph.nodes)
        self.users: list[list[int]] = [[] for _ in graph.nodes]
        for index, node in enumerate(graph.nodes):
            for ref in set(map(node_of, operands(node))):
                self.users[ref].append(index)
        self.constant = [node[0] in ("mul", "div") and _constant(graph.nodes, node) is not None for node in graph.nodes]
        self.results: list[list[Ref]] = [[] for _ in graph.nodes]
        for ref in graph.roots:
            self.results[node_of(ref)].append(ref)
        self.spent = [self.cost(index) for index in range(len(graph.nodes))]

    def minus(self, ref: Ref) -> bool:
        """Whether a reference needs the negative of what is computed."""
        return (ref < 0) != self.negated[node_of(ref)]

    def cost(self, index: int) -> int:
        """Negations in the computation of a node and in its results."""
        node, negated, results = self.nodes[index], self.negated, self.results[index]
        own = sum(map(self.minus, results)) if results and node[0] != "const" else 0
        if node[0] in LEAVES or self.constant[index]:
            return own
        minuses: list[bool] = [(ref < 0) != negated[ref if ref >= 0 else ~ref] for ref in node[1:]]
        if node[0] == "add":
            return own + int(negated[index] not in minuses)
        if node[0] in ("mul", "div"):
            return own + int((sum(minuses) % 2 == 1) != negated[index])
        return own + sum(minuses)

    def absorbing(self, index: int) -> set[int]:
        """The terms of a sum that take a sign at no cost: products with a constant that nothing else uses."""
        if self.nodes[index][0] != "add":
            return set()
        terms = {node_of(ref) for ref in self.nodes[index][1:]}
        alone = {term for term in terms if len(self.users[term]) == 1 and not self.results[term]}
        return {term for term in alone if self.nodes[term][0] == "mul" and _constant(self.nodes, self.nodes[term])}

    def gain(self, group: set[int]) -> int:
        """Negations saved by computing the negatives of these nodes."""
        near = group | {user for index in group for user in self.users[index]}
        before = sum([self.spent[index] for index in near])
        self._flip(group)
        after = sum(map(self.cost, near))
        self._flip(group)
        return before - after

    def negate(self, group: set[int]) -> None:
        """Compute the negatives of these nodes instead."""
        self._flip(group)
        for near in group | {user for index in group for user in self.users[index]}:
            self.spent[near] = self.cost(near)

    def _flip(self, group: set[int]) -> None:
        for index in group:
            self.negated[index] = not self.negated[index]


def signs(graph: Graph) -> Graph:
    """The same graph with fewer negations."""
    choice = _Signs(graph)
    free = [index for index, node in enumerate(graph.nodes) if node[0] in ("add", "mul", "div")]
    while True:
        changed = False
        for index in reversed(free):
            products = {user for user in choice.users[index] if graph.nodes[user][0] in ("mul", "div")}
            for group in ({index}, {index} | products, {index} | products | choice.absorbing(index)):
                if choice.gain(group) > 0:
                    choice.negate(group)
                    changed = True
        if not changed:
            return _rewritten(graph, choice)


def _constant(nodes: tuple[Node, ...], node: Node) -> int | None:
    """The position of a constant among a product's factors, which takes a sign at no cost."""
    return next((place for place, ref in enumerate(node[1:], 1) if nodes[node_of(ref)][0] == "const"), None)


def _rewritten(graph: Graph, choice: _Signs) -> Graph:
    def new(ref: Ref) -> Ref:
        return ~node_of(ref) if choice.minus(ref) else node_of(ref)

    nodes: list[Node] = []
    for index, node in enumerate(graph.nodes):
        if node[0] in LEAVES:
            nodes.append(node)
            continue
        refs = [new(ref) for ref in node[1:]]
        if node[0] == "add":
            refs = [~ref if choice.negated[index] else ref for ref in refs]
            refs.sort(key=lambda ref: ref < 0)
        elif node[0] in ("mul", "div"):
            odd = (sum(ref < 0 for ref in refs) % 2 == 1) != choice.negated[index]
            place = _constant(graph.nodes, node) or 1
            refs = [node_of(ref) for ref in refs]
            refs[place - 1] = ~refs[place - 1] if odd else refs[place - 1]
        nodes.append((node[0], *refs))
    outputs = tuple(Output(o.name, o.shape, tuple(map(new, o.elements))) for o in graph.outputs)
    return Graph(tuple(nodes), outputs)
