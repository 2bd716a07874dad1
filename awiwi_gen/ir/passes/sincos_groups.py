"""Groups of angles whose sines and cosines are computed together, since none depends on another's."""

from __future__ import annotations

from awiwi_gen.ir.graph import Graph, Ref, node_of, operands

LANES = 4


def sincos_depths(graph: Graph) -> list[int]:
    """Per node, the length of the longest chain of sines or cosines it depends on, itself included."""
    found: list[int] = []
    for node in graph.nodes:
        is_sincos = node[0] in ("sin", "cos")
        found.append(max((found[node_of(ref)] for ref in operands(node)), default=0) + is_sincos)
    return found


def angle_groups(graph: Graph) -> dict[Ref, tuple[Ref, ...]]:
    """For every angle, its group: up to four angles of equal depth."""
    depth = sincos_depths(graph)
    levels: dict[int, list[Ref]] = {}
    for index, node in enumerate(graph.nodes):
        if node[0] in ("sin", "cos"):
            angles = levels.setdefault(depth[index], [])
            if node[1] not in angles:
                angles.append(node[1])
    groups: dict[Ref, tuple[Ref, ...]] = {}
    for angles in levels.values():
        for first in range(0, len(angles), LANES):
            group = tuple(angles[first : first + LANES])
            groups |= dict.fromkeys(group, group)
    return groups


def deadlines(graph: Graph) -> list[int]:
    """Per node, the depth of the first sine or cosine that depends on it; one more than the last where none does."""
    depth = sincos_depths(graph)
    last = max(depth, default=0) + 1
    found = [last] * len(graph.nodes)
    for index in range(len(graph.nodes) - 1, -1, -1):
        node = graph.nodes[index]
        for ref in operands(node):
            due = depth[index] if node[0] in ("sin", "cos") else last
            found[node_of(ref)] = min(found[node_of(ref)], found[index], due)
    return found
