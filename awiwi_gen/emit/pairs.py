"""What the C of a force distribution needs to solve a finger's antagonistic pairs in a straight line, without loops.

The stiffness of a finger's tendons is one program with the same numbers for each, or with other ones for a calibrated
spring. Here it becomes a function of one tendon, which compilers inline and put into the lanes of vectors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from awiwi_gen.emit.c import Printer
from awiwi_gen.emit.lanes import NUMBER, merged
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.builder import Builder, copy_node, rebuild
from awiwi_gen.ir.graph import Graph, Node, Output, Ref, node_of, prune
from awiwi_gen.ir.passes import optimise
from awiwi_gen.kernel import GUARDS, Solver


@dataclass(frozen=True)
class Pair:
    """Two tendons, and the joints that they move."""

    first: int
    second: int
    joints: tuple[int, ...]


@dataclass(frozen=True)
class Straight:
    """The pairs, the C of one tendon's curve and of its domain, and numbers of each tendon where these differ.

    ``groups`` are the numbers of the pairs that share joints, one or two. ``coupling`` are the numbers of a constant
    coupling, else empty. ``params`` tells whether the curve reads numbers at run time.
    """

    pairs: tuple[Pair, ...]
    groups: tuple[tuple[int, ...], ...]
    spring: tuple[str, ...]
    numbers: tuple[tuple[str, ...], ...]
    domain: tuple[str, ...]
    coupling: tuple[str, ...]
    params: bool


def straight_line(solver: Solver, graphs: Mapping[str, Graph], options: Options) -> Straight | None:
    """The pairs of a distribution; None if it has none, or if the curves of its tendons are different programs."""
    stiffness, coupling = graphs["tendon_stiffness"], graphs["coupling"]
    order = [pair[side] for side in (0, 1) for pair in solver.pairs]
    springs = ["\n".join(Printer(_of_one(stiffness, i), options, "").statements()) for i in order]
    if len({NUMBER.sub("#", spring) for spring in springs}) != 1:
        return None
    spring, numbers = merged(springs)
    P, joints = [_number(coupling, ref) for ref in coupling.outputs[0].elements], len(solver.unknowns)
    pairs = [
        Pair(first, second, tuple(j for j in range(joints) if P[first * joints + j] != 0))
        for first, second, _ in solver.pairs
    ]
    groups = dict.fromkeys(tuple(sorted({i, partner})) for i, (_, _, partner) in enumerate(solver.pairs))
    return Straight(
        tuple(pairs),
        tuple(groups),
        spring,
        tuple(zip(*numbers, strict=True)),
        tuple(Printer(_domain(stiffness), options, "").statements()),
        tuple(options.literal(each) for each in P if each is not None) if None not in P else (),
        bool(stiffness.params),
    )


def _number(graph: Graph, ref: Ref) -> Fraction | None:
    """The value of a constant, else None."""
    node = graph.nodes[node_of(ref)]
    if node[0] != "const":
        return None
    value: Fraction = node[1]
    return value if ref >= 0 else -value


def _of_one(graph: Graph, tendon: int) -> Graph:
    """The outputs of one tendon, as functions of an array of one force."""
    nodes = [("input", node[1], 0) if node[0] == "input" else node for node in graph.nodes]
    outputs = [Output(o.name, (1,), (o.elements[tendon],)) for o in graph.outputs if o.name != GUARDS]
    return prune(Graph(tuple(nodes), tuple(outputs)))


def _domain(graph: Graph) -> Graph:
    """The guards where all forces are the same."""

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        return copy_node(builder, ("input", node[1], 0) if node[0] == "input" else node, refs)

    same = rebuild(Graph(graph.nodes, tuple(o for o in graph.outputs if o.name == GUARDS)), rule)
    return optimise(same)[-1][1]
