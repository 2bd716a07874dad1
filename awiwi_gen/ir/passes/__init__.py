"""The passes, each a plain function from graph to graph, and the order they run in."""

from __future__ import annotations

from collections.abc import Callable

from awiwi_gen.ir.cost import Cost, cost
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.passes.factor import factor
from awiwi_gen.ir.passes.finish import orient, quotients
from awiwi_gen.ir.passes.flatten import flatten
from awiwi_gen.ir.passes.phase import phase
from awiwi_gen.ir.passes.scale import scale, units
from awiwi_gen.ir.passes.schedule import schedule
from awiwi_gen.ir.passes.share import share_products, share_sums
from awiwi_gen.ir.passes.shift import shift
from awiwi_gen.ir.passes.signs import signs

Pass = Callable[[Graph], Graph]

# Orders that are all tried, as whether factoring pays depends on what products share; the cheapest result wins.
ORDERS: tuple[tuple[Pass, ...], ...] = (
    (flatten, phase, share_products, share_sums, factor, scale),
    (flatten, share_products, phase, factor, share_products, share_sums, scale),
    (flatten, phase, factor, scale, share_products, share_sums),
)
REPEATED: tuple[Pass, ...] = (flatten, share_products, share_sums, factor, shift, scale)  # as long as it helps
ONCE: tuple[Pass, ...] = (units, *REPEATED)  # if it helps
FINAL: tuple[Pass, ...] = (quotients, orient, signs, schedule)

Stages = list[tuple[str, Graph]]


class Memo:
    """Results of passes: different orders often reach the same graph, which is then one object and hashed once."""

    def __init__(self) -> None:
        self._graphs: dict[Graph, Graph] = {}
        self._results: dict[tuple[Pass, int], Graph] = {}

    def graph(self, graph: Graph) -> Graph:
        """The one object for all graphs that are equal to this one; it is kept, and so is its identity."""
        return self._graphs.setdefault(graph, graph)

    def after(self, apply: Pass, graph: Graph) -> Graph:
        """The graph after a pass, for a graph from this memo."""
        step = apply, id(graph)
        if step not in self._results:
            self._results[step] = self.graph(apply(graph))
        return self._results[step]


def stages(graph: Graph, passes: tuple[Pass, ...], memo: Memo | None = None) -> Stages:
    """The graph after each pass, with the pass's name; results in the memo are not computed again."""
    memo = memo or Memo()
    graph, result = memo.graph(graph), []
    for apply in passes:
        graph = memo.after(apply, graph)
        result.append((apply.__name__, graph))
    return result


def optimise(graph: Graph, memo: Memo | None = None) -> Stages:
    """The stages of the cheapest order of passes; the last one is emitted. Graphs that are alike may share a memo."""
    memo = memo or Memo()
    graph = memo.graph(graph)
    candidates = [stages(graph, passes, memo) for passes in ORDERS]
    weight, best = min(((_rough(c[-1][1], memo).weight, c) for c in candidates), key=lambda pair: pair[0])
    while True:
        further = [*best, *stages(best[-1][1], REPEATED, memo)]
        lighter = _rough(further[-1][1], memo).weight
        if lighter >= weight:
            break
        weight, best = lighter, further
    further += stages(further[-1][1], ONCE, memo)
    if _rough(further[-1][1], memo).weight < weight:
        best = further
    best = [*best, *stages(best[-1][1], FINAL, memo)]
    plain = _rough(graph, memo)
    if plain.weight - plain.neg > cost(best[-1][1]).weight:  # the final passes save negations only
        return best
    return min(stages(graph, FINAL, memo), best, key=lambda result: cost(result[-1][1]).weight)


def _rough(graph: Graph, memo: Memo) -> Cost:
    """The cost after the final passes, but for a few negations."""
    return cost(stages(graph, (quotients, orient), memo)[-1][1])
