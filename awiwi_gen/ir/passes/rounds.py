"""Rounds of angles: those that do not wait for each other's sines have them computed together."""

from __future__ import annotations

from awiwi_gen.ir.graph import Graph, Ref, node_of, operands

LANES = 4


def waits(graph: Graph) -> list[int]:
    """Per node, how many sines or cosines of one another must be known before it."""
    found: list[int] = []
    for node in graph.nodes:
        own = node[0] in ("sin", "cos")
        found.append(max((found[node_of(ref)] for ref in operands(node)), default=0) + own)
    return found


def angle_groups(graph: Graph) -> dict[Ref, tuple[Ref, ...]]:
    """For every angle, the angles whose sines and cosines are computed with its own: up to four."""
    depth = waits(graph)
    rounds: dict[int, list[Ref]] = {}
    for index, node in enumerate(graph.nodes):
        if node[0] in ("sin", "cos"):
            angles = rounds.setdefault(depth[index], [])
            if node[1] not in angles:
                angles.append(node[1])
    groups: dict[Ref, tuple[Ref, ...]] = {}
    for angles in rounds.values():
        for first in range(0, len(angles), LANES):
            group = tuple(angles[first : first + LANES])
            groups |= dict.fromkeys(group, group)
    return groups


def rounds(graph: Graph) -> list[int]:
    """Per node, the first round of angles that cannot do without it; beyond the last one for what none needs."""
    depth = waits(graph)
    last = max(depth, default=0) + 1
    found = [last] * len(graph.nodes)
    for index in range(len(graph.nodes) - 1, -1, -1):
        node = graph.nodes[index]
        for ref in operands(node):
            due = depth[index] if node[0] in ("sin", "cos") else last
            found[node_of(ref)] = min(found[node_of(ref)], found[index], due)
    return found
