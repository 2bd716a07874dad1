"""The expression graph: hash-consed, in canonical order; the only thing passes see.

A node is a plain tuple. Leaves are ``("const", Fraction)``, ``("input", port, element)`` and
``("param", path)``; every other node is ``(operation, *references)``. A reference is an ``int``: ``i`` means
the value of node ``i`` and ``~i`` means *minus* that value. Negation therefore is no node of its own, and two
expressions that differ by sign only share one node.

Canonical form, established by `builder.Builder`:

- constants are exact, non-negative fractions (``-2`` is the reference ``~i`` of the constant 2);
- ``add`` and ``mul`` take any number of operands, sorted by node; like terms and powers are collected;
- the first non-constant term of a sum is positive: ``b - a`` is ``~(a - b)``;
- ``mul`` holds at most one constant, first; signs are pulled out of products, quotients and odd functions;
- a quotient is a product with ``inv``. Only the last passes introduce ``div``.

The floating-point meaning of a node is fixed too: operands are combined from left to right.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any

Node = tuple[Any, ...]
Ref = int

LEAVES = frozenset({"const", "input", "param"})
VARIADIC = frozenset({"add", "mul"})
ODD = frozenset({"sin", "tan", "asin", "atan"})
EVEN = frozenset({"cos", "fabs"})
SIGNLESS = ODD | EVEN | {"mul", "inv"}  # operations whose operands are all positive references


def node_of(ref: Ref) -> int:
    """The node a reference points to, without its sign."""
    return ref if ref >= 0 else ~ref


def operands(node: Node) -> tuple[Ref, ...]:
    """The references a node holds: none for a leaf."""
    return () if node[0] in LEAVES else node[1:]


@dataclass(frozen=True)
class Output:
    """One output array: its name, its shape and one reference per element, row by row."""

    name: str
    shape: tuple[int, ...]
    elements: tuple[Ref, ...]

    def renamed(self, renamed: Sequence[Ref]) -> Output:
        """The same output of a graph in which node i has become the reference ``renamed[i]``."""
        return Output(self.name, self.shape, tuple(renamed[r] if r >= 0 else ~renamed[~r] for r in self.elements))


@dataclass(frozen=True)
class Graph:
    """Nodes in an order in which operands come first, and the outputs that refer to them."""

    nodes: tuple[Node, ...]
    outputs: tuple[Output, ...]

    @cached_property
    def uses(self) -> tuple[int, ...]:
        """How often each node is referred to, outputs included."""
        counts = [0] * len(self.nodes)
        for node in self.nodes:
            for ref in operands(node):
                counts[ref if ref >= 0 else ~ref] += 1
        for ref in self.roots:
            counts[node_of(ref)] += 1
        return tuple(counts)

    @cached_property
    def last_uses(self) -> tuple[int, ...]:
        """The last node that refers to each node; beyond all of them for what is an output."""
        last = [-1] * len(self.nodes)
        for index, node in enumerate(self.nodes):
            for ref in operands(node):
                last[node_of(ref)] = index
        for ref in self.roots:
            last[node_of(ref)] = len(self.nodes)
        return tuple(last)

    @property
    def roots(self) -> Iterator[Ref]:
        """The references of all output elements, in order."""
        return (ref for output in self.outputs for ref in output.elements)

    @cached_property
    def params(self) -> tuple[str, ...]:
        """Paths of the hand's numbers this graph depends on, sorted."""
        return tuple(sorted(node[1] for node in self.nodes if node[0] == "param"))

    @cached_property
    def digest(self) -> str:
        """A fingerprint of the graph that is the same on every machine and in every run."""
        return hashlib.sha256(repr((self.nodes, self.outputs)).encode()).hexdigest()


def reachable(graph: Graph) -> list[bool]:
    """Which nodes the outputs depend on."""
    marked = [False] * len(graph.nodes)
    for ref in graph.roots:
        marked[node_of(ref)] = True
    for index in range(len(graph.nodes) - 1, -1, -1):
        if marked[index]:
            for ref in operands(graph.nodes[index]):
                marked[ref if ref >= 0 else ~ref] = True
    return marked


def levels(graph: Graph) -> list[list[int]]:
    """The nodes that outputs depend on: leaves first, then those that are made of leaves, and so on."""
    found: list[list[int]] = []
    heights: list[int] = []
    for index, (node, marked) in enumerate(zip(graph.nodes, reachable(graph), strict=True)):
        height = 0
        if marked and node[0] not in LEAVES:
            height = 1 + max([heights[ref if ref >= 0 else ~ref] for ref in node[1:]])
        heights.append(height)
        if marked:
            if height == len(found):
                found.append([])
            found[height].append(index)
    return found


def canonical(graph: Graph) -> Graph:
    """Number the nodes level by level in an order that depends on the expressions alone.

    Neither the order of construction nor any hash decides; constants compare last, so that a changed
    number hardly moves anything else.
    """
    first, *others = levels(graph) or [[]]
    nodes: list[Node] = []
    numbers: dict[Node, int] = {}
    renamed: list[Ref] = [0] * len(graph.nodes)
    for index in sorted(first, key=graph.nodes.__getitem__):
        if not nodes or nodes[-1] != graph.nodes[index]:
            nodes.append(graph.nodes[index])
        renamed[index] = len(nodes) - 1
    constants = {number for number, node in enumerate(nodes) if node[0] == "const"}
    for level in others:
        found = [(*_moved(graph.nodes[index], renamed, nodes, constants), index) for index in level]
        found.sort(key=_KEY)
        for _, node, negated, index in found:
            if node[0] == "add" and node[1] < 0:
                node, negated = (node[0], *[~ref for ref in node[1:]]), True
            number = numbers.setdefault(node, len(nodes))
            if number == len(nodes):
                nodes.append(node)
            renamed[index] = ~number if negated else number
    return Graph(tuple(nodes), tuple(output.renamed(renamed) for output in graph.outputs))


_KEY = itemgetter(0)


def _moved(node: Node, renamed: list[Ref], nodes: list[Node], constants: set[int]) -> tuple[Any, Node, bool]:
    """What to sort an operation by, the operation with renamed operands, and whether its sign was pulled out.

    Operands of sums and products are sorted. An operand may have been negated since the node was made, and products
    keep no signs inside.
    """
    operation = node[0]
    refs = [renamed[ref] if ref >= 0 else ~renamed[~ref] for ref in node[1:]]
    signless, negated = min(refs) >= 0, False
    bare = refs if signless else [ref if ref >= 0 else ~ref for ref in refs]
    if operation in SIGNLESS and not signless:
        negated = operation not in EVEN and sum([ref < 0 for ref in refs]) % 2 == 1
        refs, signless = bare, True
    variables, numbers = refs, []
    if not constants.isdisjoint(bare):
        variables = [ref for ref in refs if node_of(ref) not in constants]
        numbers = [ref for ref in refs if node_of(ref) in constants]
    if operation in VARIADIC:
        variables.sort(key=None if signless else node_of)
        numbers.sort(key=node_of)
        refs = variables + numbers if operation == "add" else numbers + variables
    values = [nodes[ref][1] if ref >= 0 else -nodes[~ref][1] for ref in numbers]
    bare = variables if signless else [node_of(ref) for ref in variables]
    return (operation, len(variables), bare, variables, values), (operation, *refs), negated


def prune(graph: Graph) -> Graph:
    """Drop the nodes no output depends on; the order of the others stays."""
    marked = reachable(graph)
    return graph if all(marked) else reordered(graph, [index for index, needed in enumerate(marked) if needed])


def reordered(graph: Graph, order: Sequence[int]) -> Graph:
    """The same graph with its nodes, or those of them that outputs depend on, in another order; operands come first."""
    position = {old: new for new, old in enumerate(order)}

    def new(ref: Ref) -> Ref:
        return position[ref] if ref >= 0 else ~position[~ref]

    nodes = tuple(
        node if node[0] in LEAVES else (node[0], *(new(r) for r in node[1:]))
        for node in (graph.nodes[i] for i in order)
    )
    outputs = tuple(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)
    return Graph(nodes, outputs)
