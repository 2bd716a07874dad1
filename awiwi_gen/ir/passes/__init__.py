"""The passes, each a plain function from graph to graph, and the order they run in."""

from __future__ import annotations

from collections.abc import Callable

from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.passes.factor import factor
from awiwi_gen.ir.passes.finish import orient, quotients, schedule
from awiwi_gen.ir.passes.flatten import flatten
from awiwi_gen.ir.passes.gather import gather
from awiwi_gen.ir.passes.scale import scale
from awiwi_gen.ir.passes.share import share_products, share_sums
from awiwi_gen.ir.passes.turn import turn

Pass = Callable[[Graph], Graph]

# Tried in turn, the cheapest result wins: whether brackets pay depends on what products share.
PIPELINES: tuple[tuple[Pass, ...], ...] = (
    (flatten, turn, share_products, share_sums, factor, scale, quotients, orient, schedule, gather),
    (flatten, turn, factor, scale, share_products, share_sums, quotients, orient, schedule, gather),
    (quotients, orient, schedule, gather),
)


def stages(graph: Graph, passes: tuple[Pass, ...]) -> list[tuple[str, Graph]]:
    """The graph after each pass, with the pass's name."""
    result = []
    for apply in passes:
        graph = apply(graph)
        result.append((apply.__name__, graph))
    return result


def optimise(graph: Graph) -> list[tuple[str, Graph]]:
    """The stages of the cheapest pipeline; the last one is what is emitted."""
    return min((stages(graph, passes) for passes in PIPELINES), key=lambda s: cost(s[-1][1]).weight)
