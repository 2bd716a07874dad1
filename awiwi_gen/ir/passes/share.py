"""Common subexpressions: pairs of terms (factors) that several sums (products) contain are computed once.

Greedy: the pair that most nodes contain is taken out first, until every pair is used once only.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from itertools import combinations

from awiwi_gen.ir.builder import Builder, copy_node
from awiwi_gen.ir.graph import Graph, Output, Ref, node_of, operands

Pair = tuple[Ref, Ref]
Places = defaultdict[Pair, dict[int, int]]  # which groups hold a pair, and how often


def share_sums(graph: Graph) -> Graph:
    """Common partial sums, up to sign."""
    return _share(graph, "add")


def share_products(graph: Graph) -> Graph:
    """Common partial products, constants and reciprocals among the factors."""
    return _share(graph, "mul")


def _share(graph: Graph, operation: str) -> Graph:
    groups = {i: list(node[1:]) for i, node in enumerate(graph.nodes) if node[0] == operation}
    pairs = _extract(groups, first_free=len(graph.nodes))
    return _replay(graph, operation, groups, pairs) if pairs else graph


def _normal(a: Ref, b: Ref) -> tuple[Pair, bool]:
    """The pair in sorted order with a positive first member, and whether it was negated."""
    if node_of(a) > node_of(b):
        a, b = b, a
    return ((~a, ~b), True) if a < 0 else ((a, b), False)


def _extract(groups: dict[int, list[Ref]], first_free: int) -> dict[int, Pair]:
    """Take pairs out of the groups in place; returns the pair behind each new node number."""
    where: Places = defaultdict(dict)
    for index, terms in groups.items():
        for a, b in combinations(terms, 2):
            _count(where, a, b, index, 1)
    heap = [(-len(nodes), pair) for pair, nodes in where.items() if len(nodes) > 1]
    heapq.heapify(heap)
    pairs: dict[int, Pair] = {}
    while heap:
        count, pair = heapq.heappop(heap)
        holders = sorted(where[pair])
        if len(holders) != -count:  # out of date: put back with its present count
            if len(holders) > 1:
                heapq.heappush(heap, (-len(holders), pair))
            continue
        new = first_free + len(pairs)
        pairs[new] = pair
        touched = {pair}  # a group may hold it more than once
        for index in holders:
            touched |= _replace(groups[index], where, index, pair, new)
        for other in sorted(touched):
            if len(where[other]) > 1:
                heapq.heappush(heap, (-len(where[other]), other))
    return pairs


def _count(where: Places, a: Ref, b: Ref, index: int, change: int) -> Pair:
    """Note that a group has a pair once more, or once less; returns the pair in its normal form."""
    pair, _ = _normal(a, b)
    holders = where[pair]
    holders[index] = holders.get(index, 0) + change
    if not holders[index]:
        del holders[index]
    return pair


def _replace(terms: list[Ref], where: Places, index: int, pair: Pair, new: int) -> set[Pair]:
    """Write one group with ``new`` in place of the pair; returns the pairs that it newly contains."""
    first, second = pair
    plain = first in terms and second in terms and (first != second or terms.count(first) > 1)
    for gone in pair if plain else (~first, ~second):
        terms.remove(gone)
        for other in terms:
            _count(where, gone, other, index, -1)
    added = new if plain else ~new
    touched = {_count(where, added, other, index, 1) for other in terms}
    terms.append(added)
    return touched


def _replay(graph: Graph, operation: str, groups: dict[int, list[Ref]], pairs: dict[int, Pair]) -> Graph:
    builder = Builder()
    done: dict[int, Ref] = {}

    def members(index: int) -> tuple[Ref, ...]:
        if index in pairs:
            return pairs[index]
        return tuple(groups[index]) if index in groups else operands(graph.nodes[index])

    def new(ref: Ref) -> Ref:
        return done[ref] if ref >= 0 else ~done[~ref]

    stack = [node_of(ref) for ref in reversed(list(graph.roots))]
    while stack:
        index = stack[-1]
        if index in done:
            stack.pop()
            continue
        terms = members(index)
        missing = [n for n in map(node_of, terms) if n not in done]
        if missing:
            stack += missing
            continue
        stack.pop()
        refs = tuple(map(new, terms))
        grouped = index in pairs or index in groups
        done[index] = builder.make(operation, refs) if grouped else copy_node(builder, graph.nodes[index], refs)
    return builder.graph(Output(o.name, o.shape, tuple(new(r) for r in o.elements)) for o in graph.outputs)
