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


def stages(graph: Graph, passes: tuple[Pass, ...], known: dict[tuple[Pass, ...], Graph] | None = None) -> Stages:
    """The graph after each pass, with the pass's name; what begins as something `known` is not computed again."""
    known = {} if known is None else known
    result = []
    for count, apply in enumerate(passes, 1):
        if passes[:count] not in known:
            known[passes[:count]] = apply(graph)
        graph = known[passes[:count]]
        result.append((apply.__name__, graph))
    return result


def optimise(graph: Graph) -> Stages:
    """The stages of the cheapest way; the last one is what is emitted."""
    known: dict[tuple[Pass, ...], Graph] = {}
    ways = [stages(graph, passes, known) for passes in BEGINNINGS]
    rough, way = min(((_rough(way[-1][1]).weight, way) for way in ways), key=lambda found: found[0])
    while True:
        further = [*way, *stages(way[-1][1], AGAIN)]
        weight = _rough(further[-1][1]).weight
        if weight >= rough:
            break
        rough, way = weight, further
    further += stages(further[-1][1], ONCE)
    if _rough(further[-1][1]).weight < rough:
        way = further
    way = [*way, *stages(way[-1][1], END)]
    plain = _rough(graph)
    if plain.weight - plain.neg > cost(way[-1][1]).weight:  # the end takes away negations, and nothing else
        return way
    return min(stages(graph, END), way, key=lambda ended: cost(ended[-1][1]).weight)


def _rough(graph: Graph) -> Cost:
    """What the end of a way will cost, but for the last few signs."""
    return cost(orient(quotients(graph)))
