"""The order of evaluation: a list scheduler that keeps few values live, so that registers can hold them.

A step computes a value, or adds one term to a sum. C compilers move a value that is used once to its use, but leave an
accumulated sum in place. Sums are therefore cut into partial sums, and each term is added as soon as it is known, which
frees the registers of its operands.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from heapq import heapify, heappop, heappush
from itertools import groupby
from typing import NamedTuple

from awiwi_gen.ir.graph import LEAVES, Graph, Node, Output, Ref, node_of, operands, reordered
from awiwi_gen.ir.passes.sincos_groups import deadlines

AHEAD = 128  # more gains nothing for a finger and mixes up the tendons of a wrist


class Step(NamedTuple):
    """Compute a node, or add one term to it, from values in registers."""

    node: int
    term: Ref | None
    reads: tuple[int, ...]


def schedule(graph: Graph) -> Graph:
    """The same expressions in the order of the `Scheduler`, sums accumulated term by term."""
    graph = depth_first(merged(graph))
    return accumulate(graph, Scheduler(graph, steps(graph)))


def merged(graph: Graph) -> Graph:
    """Merge sums that a single sum reads, which passes after `flatten` leave.

    The sum of an angle starts with leaves: they are known first, and much depends on the angle.
    """
    nodes: list[Node] = []
    angles = {node_of(node[1]) for node in graph.nodes if node[0] in ("sin", "cos")}
    for index, node in enumerate(graph.nodes):
        if node[0] == "add":
            terms: list[Ref] = []
            for ref in node[1:]:
                inner = nodes[node_of(ref)]
                merges = inner[0] == "add" and graph.uses[node_of(ref)] == 1
                terms += [r if ref >= 0 else ~r for r in inner[1:]] if merges else [ref]
            if index in angles:
                terms.sort(key=lambda ref: nodes[node_of(ref)][0] not in LEAVES)
            node = ("add", *_positive_first(terms))
        nodes.append(node)
    return Graph(tuple(nodes), graph.outputs)


def _positive_first(terms: list[Ref]) -> list[Ref]:
    """Move negative terms to the end if one is first: a leading minus would cost an operation."""
    return sorted(terms, key=lambda ref: ref < 0 and terms[0] < 0)


def depth_first(graph: Graph) -> Graph:
    """The nodes that outputs depend on, in the order in which a recursive evaluation of the outputs meets them."""
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
    return reordered(graph, order)


def steps(graph: Graph) -> list[Step]:
    """All steps in the order of the nodes. Constants, and nodes that are used once and are no sums, need no register."""
    roots = {node_of(ref) for ref in graph.roots}
    needs: list[tuple[int, ...]] = []  # the values in registers that reading a node reads
    found = []
    for index, node in enumerate(graph.nodes):
        reads = tuple(dict.fromkeys(value for ref in operands(node) for value in needs[node_of(ref)]))
        in_register = node[0] in ("input", "add", "sin", "cos") or graph.uses[index] > 1 or index in roots
        is_number = node[0] in ("const", "param")
        needs.append((index,) if in_register and not is_number else reads)
        if node[0] == "add":
            found += [Step(index, ref, needs[node_of(ref)]) for ref in node[1:]]
        elif in_register and node[0] not in LEAVES:
            found.append(Step(index, None, reads))
    return found


class Scheduler:
    """Iterates over the steps in scheduled order. Among the steps whose operands are known, those that an earlier sine or
    cosine depends on go first, then the first that needs no further register. If all need one, a step that needs fewer
    may go up to `AHEAD` steps early for each register it saves.
    """

    def __init__(self, graph: Graph, steps: list[Step]) -> None:
        self.steps, self.deadline = steps, deadlines(graph)
        self.is_input = [node[0] == "input" for node in graph.nodes]
        self.loaded = [False] * len(graph.nodes)  # occupies a register, whole or as a partial sum
        self.of_node: list[list[int]] = [[] for _ in graph.nodes]
        self.readers: list[list[int]] = [[] for _ in graph.nodes]
        for number, step in enumerate(steps):
            self.of_node[step.node].append(number)
            for value in step.reads:
                self.readers[value].append(number)
        self.missing = [sum(not self.is_input[value] for value in step.reads) for step in steps]
        self.taken = [False] * len(steps)
        self.parts = [len(numbers) for numbers in self.of_node]
        self.unread = [len(numbers) for numbers in self.readers]
        # Registers a step occupies less those it frees: a new result, inputs not loaded yet, values read for the last time.
        self.filled = [1 + sum(self.is_input[v] - (self.unread[v] == 1) for v in step.reads) for step in steps]
        self.heap = [self._key(number) for number, count in enumerate(self.missing) if not count]
        heapify(self.heap)

    def __iter__(self) -> Iterator[Step]:
        while self.heap:
            entry = heappop(self.heap)
            number = entry[-1]
            if not self.taken[number] and entry == self._key(number):
                self.taken[number] = True
                self._take(self.steps[number])
                yield self.steps[number]

    def _key(self, number: int) -> tuple[int, bool, int, int]:
        needed = max(self.filled[number], 0)
        return self.deadline[self.steps[number].node], needed > 0, number + AHEAD * needed, number

    def _take(self, step: Step) -> None:
        """Update the register needs of other steps, and offer those that become possible."""
        for value in (step.node, *(v for v in step.reads if self.is_input[v])):
            if not self.loaded[value]:
                self.loaded[value] = True
                self._release(self.readers[value] if self.is_input[value] else self.of_node[value])
        for value in step.reads:
            self.unread[value] -= 1
            if self.unread[value] == 1:
                self._release(self.readers[value])
        self.parts[step.node] -= 1
        if not self.parts[step.node]:
            for reader in self.readers[step.node]:
                self.missing[reader] -= 1
                self._offer(reader)

    def _release(self, numbers: list[int]) -> None:
        for number in numbers:
            self.filled[number] -= 1
            self._offer(number)

    def _offer(self, number: int) -> None:
        if not self.taken[number] and not self.missing[number]:
            heappush(self.heap, self._key(number))


def accumulate(graph: Graph, steps: Iterable[Step]) -> Graph:
    """The graph as these steps compute it: a sum is cut where other steps interrupt it."""
    writer = Writer(graph)
    for index, leaf in enumerate(graph.nodes):
        if leaf[0] in LEAVES:
            writer.new(index)
    for node, group in groupby(steps, key=lambda step: step.node):
        if graph.nodes[node][0] == "add":
            writer.add(node, [step.term for step in group if step.term is not None])
        else:
            writer.new(node)
    outputs = tuple(Output(o.name, o.shape, tuple(writer.new(ref) for ref in o.elements)) for o in graph.outputs)
    return Graph(tuple(writer.nodes), outputs)


class Writer:
    """Writes the nodes of a graph in the order of the calls."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.nodes: list[Node] = []
        self.renamed: dict[int, int] = {}
        self.coming = {
            i: len(node) - 1 for i, node in enumerate(graph.nodes) if node[0] == "add"
        }  # terms not added yet
        self.held: dict[int, list[Ref]] = {}  # terms that wait until the sum can start
        self.partial: dict[int, int] = {}

    def new(self, ref: Ref) -> Ref:
        """The new reference of an old one; writes the nodes that are missing."""
        index = node_of(ref)
        if index not in self.renamed:
            node = self.graph.nodes[index]
            refs = node[1:] if node[0] in LEAVES else tuple(self.new(r) for r in node[1:])
            self.renamed[index] = self._write((node[0], *refs))
        return self.renamed[index] if ref >= 0 else ~self.renamed[index]

    def add(self, index: int, terms: list[Ref]) -> None:
        """Add terms to a sum. It starts with two terms, and with a positive one if there is any."""
        self.coming[index] -= len(terms)
        terms = self.held.pop(index, []) + terms
        if index not in self.partial and self.coming[index] and (len(terms) < 2 or all(ref < 0 for ref in terms)):
            self.held[index] = terms
            return
        refs = [self.new(ref) for ref in terms]
        so_far = [self.partial[index]] if index in self.partial else []
        if not so_far:
            refs = _positive_first(refs)
        self.partial[index] = self._write(("add", *so_far, *refs))
        if not self.coming[index]:
            self.renamed[index] = self.partial[index]

    def _write(self, node: Node) -> int:
        self.nodes.append(node)
        return len(self.nodes) - 1
