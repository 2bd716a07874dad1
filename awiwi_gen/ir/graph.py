"""The expression graph: hash-consed, in canonical order; the only thing passes see.

A node is a plain tuple. Leaves are ``("const", Fraction)``, ``("input", port, element)`` and
``("param", path)``; every other node is ``(operation, *references)``. A reference is an ``int``: ``i`` means
the value of node ``i`` and ``~i`` means *minus* that value. Negation therefore is no node of its own, and two
expressions that differ by sign only share one node.

Canonical form, kept by `Builder`:

- constants are exact, non-negative fractions (``-2`` is the reference ``~i`` of the constant 2);
- ``add`` and ``mul`` take any number of operands, sorted by node; like terms and powers are collected;
- the first non-constant term of a sum is positive: ``b - a`` is ``~(a - b)``;
- ``mul`` holds at most one constant, first; signs are pulled out of products, quotients and odd functions;
- a quotient is a product with ``inv``. Only the last passes introduce ``div``.

The floating-point meaning of a node is fixed too: operands are combined from left to right.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

Node = tuple[Any, ...]
Ref = int

LEAVES = frozenset({"const", "input", "param"})
ODD = frozenset({"sin", "tan", "asin", "atan"})
EVEN = frozenset({"cos", "fabs"})
UNARY = ODD | EVEN | {"sqrt", "acos", "exp", "log"}
BINARY = frozenset({"div", "atan2"})
VARIADIC = frozenset({"add", "mul"})
OPERATIONS = UNARY | BINARY | VARIADIC | {"inv"}

# Longer fractions are rounded to this many bits: far beyond the 200 bits at which passes are compared.
FRACTION_BITS = 512


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
                counts[node_of(ref)] += 1
        for ref in self.roots:
            counts[node_of(ref)] += 1
        return tuple(counts)

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


class Builder:
    """Makes nodes in canonical form; equal expressions get equal references."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._index: dict[Node, int] = {}

    # -- leaves -------------------------------------------------------------------------------------------

    def const(self, value: Fraction | int) -> Ref:
        """A constant; any sign."""
        value = shorten(Fraction(value))
        return self._intern(("const", value)) if value >= 0 else ~self._intern(("const", -value))

    def input(self, port: str, element: int) -> Ref:
        """Element number ``element`` (row by row) of an input port."""
        return self._intern(("input", port, element))

    def param(self, path: str) -> Ref:
        """A number of the hand, by its path in the hand file."""
        return self._intern(("param", path))

    def value(self, ref: Ref) -> Fraction | None:
        """The value of a reference to a constant; None for anything else."""
        node = self.nodes[node_of(ref)]
        if node[0] != "const":
            return None
        return node[1] if ref >= 0 else -node[1]

    # -- arithmetic ---------------------------------------------------------------------------------------

    def add(self, refs: Iterable[Ref]) -> Ref:
        """The sum of any number of references; like terms are collected."""
        refs = list(refs)
        if self._all_unlike(refs):
            return self._sum(sorted(refs, key=node_of))
        coefficients: dict[int, Fraction] = {}
        constant = Fraction(0)
        for ref in refs:
            coefficient, base = self.split(ref)
            if base is None:
                constant += coefficient
            else:
                coefficients[base] = coefficients.get(base, Fraction(0)) + coefficient
        terms = [self.scaled(c, base) for base, c in coefficients.items() if c]
        terms.sort(key=node_of)
        if constant:
            terms.append(self.const(constant))
        return self._sum(terms)

    def _all_unlike(self, refs: list[Ref]) -> bool:
        """Whether no two terms differ by a rational factor only, and none is a constant: the common case."""
        seen = set()
        for ref in refs:
            node = self.nodes[node_of(ref)]
            if node[0] == "const":
                return False
            is_scaled = node[0] == "mul" and self.nodes[node[1]][0] == "const"
            base = node[2:] if is_scaled else node[1:] if node[0] == "mul" else (node_of(ref),)
            if base in seen:
                return False
            seen.add(base)
        return True

    def _sum(self, terms: list[Ref]) -> Ref:
        if not terms:
            return self.const(0)
        if len(terms) == 1:
            return terms[0]
        if terms[0] < 0:
            return ~self._intern(("add", *(~t for t in terms)))
        return self._intern(("add", *terms))

    def mul(self, refs: Sequence[Ref]) -> Ref:
        """The product of any number of references; powers are collected, numbers multiplied."""
        coefficient = Fraction(1)
        powers: dict[int, int] = {}
        numbers = [ref for ref in refs if self.nodes[node_of(ref)][0] == "const"]
        for ref in refs:
            if ref < 0:
                ref, coefficient = ~ref, -coefficient
            node = self.nodes[ref]
            if node[0] == "const":
                coefficient *= node[1]
            elif numbers and node[0] == "mul" and self.value(node[1]) is not None:
                coefficient *= self.nodes[node[1]][1]
                for factor in node[2:]:
                    powers[factor] = powers.get(factor, 0) + 1
            elif node[0] == "inv":
                powers[node[1]] = powers.get(node[1], 0) - 1
            else:
                powers[ref] = powers.get(ref, 0) + 1
        if not coefficient:
            return self.const(0)
        factors: list[Ref] = []
        for base, power in powers.items():
            factors += [base] * power if power > 0 else [self.inv(base)] * -power
        return self._product(coefficient, factors)

    def inv(self, ref: Ref) -> Ref:
        """The reciprocal."""
        if ref < 0:
            return ~self.inv(~ref)
        node = self.nodes[ref]
        if node[0] == "const" and node[1]:
            return self.const(1 / node[1])
        if node[0] == "inv":
            return int(node[1])
        if node[0] == "mul" and self.value(node[1]) is not None:  # keep numbers out of denominators
            rest = self._product(Fraction(1), list(node[2:]))
            return self._product(1 / self.nodes[node[1]][1], [self.inv(rest)])
        return self._intern(("inv", ref))

    def sub(self, a: Ref, b: Ref) -> Ref:
        """``a - b``."""
        return self.add((a, ~b))

    def div(self, a: Ref, b: Ref) -> Ref:
        """``a / b``, kept as a product with a reciprocal."""
        return self.mul((a, self.inv(b)))

    def power(self, base: Ref, exponent: int) -> Ref:
        """An integer power."""
        return self.mul([base] * exponent) if exponent >= 0 else self.inv(self.mul([base] * -exponent))

    def call(self, operation: str, *refs: Ref) -> Ref:
        """A function such as ``sin`` or ``atan2``; the signs of odd and even functions are pulled out."""
        if operation in EVEN:
            refs = tuple(node_of(ref) for ref in refs)
        elif operation in ODD and refs[0] < 0:
            return ~self.call(operation, ~refs[0])
        if all(self.value(ref) == 0 for ref in refs) and operation in AT_ZERO:
            return self.const(AT_ZERO[operation])
        if operation == "sqrt" and self.value(refs[0]) == 1:
            return refs[0]
        return self._intern((operation, *refs))

    def make(self, operation: str, refs: Sequence[Ref]) -> Ref:
        """Any operation by name: what a pass uses to rebuild a node."""
        if operation == "add":
            return self.add(refs)
        if operation == "mul":
            return self.mul(refs)
        if operation == "inv":
            return self.inv(refs[0])
        if operation == "div":
            return self.div(*refs)
        return self.call(operation, *refs)

    # -- taking terms apart -------------------------------------------------------------------------------

    def split(self, ref: Ref) -> tuple[Fraction, int | None]:
        """A term as (rational coefficient, the rest); the rest of a constant is None."""
        sign = 1 if ref >= 0 else -1
        base = node_of(ref)
        node = self.nodes[base]
        if node[0] == "const":
            return sign * node[1], None
        if node[0] == "mul" and self.nodes[node[1]][0] == "const":
            return sign * self.nodes[node[1]][1], self._product(Fraction(1), list(node[2:]))
        return Fraction(sign), base

    def scaled(self, coefficient: Fraction, base: int) -> Ref:
        """``coefficient * base`` for a base without coefficient of its own."""
        if coefficient == 1:
            return base
        if coefficient == -1:
            return ~base
        node = self.nodes[base]
        return self._product(coefficient, list(node[1:]) if node[0] == "mul" else [base])

    def _product(self, coefficient: Fraction, factors: list[Ref]) -> Ref:
        if coefficient < 0:
            return ~self._product(-coefficient, factors)
        ordered = sorted(factors)
        coefficient = shorten(coefficient)
        if coefficient != 1:
            ordered = [self.const(coefficient), *ordered]
        if not ordered:
            return self.const(1)
        return ordered[0] if len(ordered) == 1 else self._intern(("mul", *ordered))

    def _intern(self, node: Node) -> int:
        index = self._index.get(node)
        if index is None:
            index = self._index[node] = len(self.nodes)
            self.nodes.append(node)
        return index

    # -- finishing ----------------------------------------------------------------------------------------

    def graph(self, outputs: Iterable[Output]) -> Graph:
        """The graph of these outputs: unreachable nodes dropped, the rest in canonical order."""
        return canonical(Graph(tuple(self.nodes), tuple(outputs)))


AT_ZERO = {"sin": 0, "cos": 1, "tan": 0, "asin": 0, "atan": 0, "exp": 1, "sqrt": 0, "fabs": 0}


def shorten(value: Fraction) -> Fraction:
    """The fraction itself, or a dyadic neighbour when exact arithmetic has made it very long."""
    excess = value.denominator.bit_length() - FRACTION_BITS
    if excess <= 0 or value.numerator == 0:
        return value
    scale = FRACTION_BITS + max(0, value.denominator.bit_length() - value.numerator.bit_length())
    return Fraction(round(value * (1 << scale)), 1 << scale)


def reachable(graph: Graph) -> list[bool]:
    """Which nodes the outputs depend on."""
    marked = [False] * len(graph.nodes)
    for ref in graph.roots:
        marked[node_of(ref)] = True
    for index in range(len(graph.nodes) - 1, -1, -1):
        if marked[index]:
            for ref in operands(graph.nodes[index]):
                marked[node_of(ref)] = True
    return marked


def rebuild(graph: Graph, rule: Callable[[Builder, Node, tuple[Ref, ...]], Ref]) -> Graph:
    """Replay a graph node by node: ``rule(builder, old node, new operands)`` returns the new reference."""
    builder = Builder()
    renamed: list[Ref] = [0] * len(graph.nodes)
    marked = reachable(graph)

    def new(ref: Ref) -> Ref:
        return renamed[ref] if ref >= 0 else ~renamed[~ref]

    for index, node in enumerate(graph.nodes):
        if marked[index]:
            renamed[index] = rule(builder, node, tuple(new(ref) for ref in operands(node)))
    return builder.graph(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)


def copy_node(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
    """The rule that changes nothing."""
    if node[0] == "const":
        return builder.const(node[1])
    if node[0] == "input":
        return builder.input(node[1], node[2])
    if node[0] == "param":
        return builder.param(node[1])
    return builder.make(node[0], refs)


def graft(builder: Builder, graph: Graph, leaves: Mapping[Node, Ref]) -> dict[str, list[Ref]]:
    """Replay a graph inside another builder with some leaves replaced; returns the output references."""
    renamed: list[Ref] = []

    def new(ref: Ref) -> Ref:
        return renamed[ref] if ref >= 0 else ~renamed[~ref]

    for node in graph.nodes:
        given = leaves.get(node)
        renamed.append(copy_node(builder, node, tuple(new(r) for r in operands(node))) if given is None else given)
    return {o.name: [new(r) for r in o.elements] for o in graph.outputs}


def canonical(graph: Graph) -> Graph:
    """Number the nodes level by level in an order that depends on the expressions alone.

    Neither the order of construction nor any hash decides; constants compare last, so that a changed
    number hardly moves anything else.
    """
    marked = reachable(graph)
    height = [0] * len(graph.nodes)
    levels: dict[int, list[int]] = {}
    for index, node in enumerate(graph.nodes):
        if marked[index]:
            height[index] = 1 + max((height[node_of(r)] for r in operands(node)), default=-1)
            levels.setdefault(height[index], []).append(index)

    nodes: list[Node] = []
    numbers: dict[Node, int] = {}
    renamed: list[Ref] = [0] * len(graph.nodes)

    def new(ref: Ref) -> Ref:
        return renamed[ref] if ref >= 0 else ~renamed[~ref]

    def moved(node: Node) -> Node:
        """The node with renamed operands, those of sums and products sorted; constants where they belong."""
        if node[0] in LEAVES:
            return node
        refs = [new(r) for r in node[1:]]
        if node[0] in VARIADIC:
            is_sum = node[0] == "add"
            refs.sort(key=lambda r: (is_sum == (nodes[node_of(r)][0] == "const"), node_of(r)))
        return (node[0], *refs)

    def key(node: Node) -> tuple[Any, ...]:
        if node[0] in LEAVES:
            return node
        variables = [r for r in node[1:] if nodes[node_of(r)][0] != "const"]
        constants = [nodes[node_of(r)][1] * (1 if r >= 0 else -1) for r in node[1:] if nodes[node_of(r)][0] == "const"]
        return (node[0], len(variables), [node_of(r) for r in variables], variables, constants)

    for level in sorted(levels):
        for node, index in sorted(((moved(graph.nodes[i]), i) for i in levels[level]), key=lambda pair: key(pair[0])):
            turned = node[0] == "add" and node[1] < 0
            if turned:
                node = (node[0], *(~r for r in node[1:]))
            number = numbers.setdefault(node, len(nodes))
            if number == len(nodes):
                nodes.append(node)
            renamed[index] = ~number if turned else number
    outputs = tuple(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)
    return Graph(tuple(nodes), outputs)


def prune(graph: Graph) -> Graph:
    """Drop the nodes no output depends on; the order of the others stays."""
    marked = reachable(graph)
    if all(marked):
        return graph
    position = {index: new for new, index in enumerate(i for i, kept in enumerate(marked) if kept)}

    def new(ref: Ref) -> Ref:
        return position[ref] if ref >= 0 else ~position[~ref]

    nodes = tuple(
        node if node[0] in LEAVES else (node[0], *(new(r) for r in node[1:]))
        for index, node in enumerate(graph.nodes)
        if marked[index]
    )
    outputs = tuple(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)
    return Graph(nodes, outputs)
