"""The passes, each a plain function from graph to graph, and the order they run in."""

from __future__ import annotations

from collections.abc import Callable

from awiwi_gen.ir.cost import Cost, cost
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.passes.factor import factor
from awiwi_gen.ir.passes.finish import orient, quotients
from awiwi_gen.ir.passes.flatten import flatten
from awiwi_gen.ir.passes.scale import scale, units
from awiwi_gen.ir.passes.schedule import schedule
from awiwi_gen.ir.passes.share import share_products, share_sums
from awiwi_gen.ir.passes.shift import shift
from awiwi_gen.ir.passes.signs import signs
from awiwi_gen.ir.passes.turn import turn

Pass = Callable[[Graph], Graph]

# Tried in turn, and nothing but the end; the cheapest result wins: whether brackets pay depends on what products share.
BEGINNINGS: tuple[tuple[Pass, ...], ...] = (
    (flatten, turn, share_products, share_sums, factor, scale),
    (flatten, share_products, turn, factor, share_products, share_sums, scale),
    (flatten, turn, factor, scale, share_products, share_sums),
)
AGAIN: tuple[Pass, ...] = (flatten, share_products, share_sums, factor, shift, scale)  # as long as it helps
ONCE: tuple[Pass, ...] = (units, *AGAIN)  # if it helps
END: tuple[Pass, ...] = (quotients, orient, signs, schedule)

Stages = list[tuple[str, Graph]]
Known = dict[tuple[Pass, Graph], Graph]  # what a pass made of a graph: different ways often meet


def stages(graph: Graph, passes: tuple[Pass, ...], known: Known | None = None) -> Stages:
    """The graph after each pass, with the pass's name; what is `known` is not computed again."""
    known = {} if known is None else known
    result = []
    for apply in passes:
        step = apply, graph
        found = known.get(step)
        if found is None:
            found = known[step] = apply(graph)
        graph = found
        result.append((apply.__name__, graph))
    return result


def optimise(graph: Graph) -> Stages:
    """The stages of the cheapest way; the last one is what is emitted."""
    known: Known = {}
    ways = [stages(graph, passes, known) for passes in BEGINNINGS]
    rough, way = min(((_rough(way[-1][1], known).weight, way) for way in ways), key=lambda found: found[0])
    while True:
        further = [*way, *stages(way[-1][1], AGAIN, known)]
        weight = _rough(further[-1][1], known).weight
        if weight >= rough:
            break
        rough, way = weight, further
    further += stages(further[-1][1], ONCE, known)
    if _rough(further[-1][1], known).weight < rough:
        way = further
    way = [*way, *stages(way[-1][1], END, known)]
    plain = _rough(graph, known)
    if plain.weight - plain.neg > cost(way[-1][1]).weight:  # the end takes away negations, and nothing else
        return way
    return min(stages(graph, END, known), way, key=lambda ended: cost(ended[-1][1]).weight)


def _rough(graph: Graph, known: Known) -> Cost:
    """What the end of a way will cost, but for the last few signs."""
    return cost(stages(graph, (quotients, orient), known)[-1][1])
