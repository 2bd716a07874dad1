"""High-precision values of a kernel at the sample points, and how far its graphs agree on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, isfinite
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls
from awiwi_gen.ir.graph import Graph, Node, Output, Ref
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.ir.passes.schedule import depth_first

Array = np.ndarray[Any, Any]
BallArrays = dict[str, list[list[arb]]]


@dataclass(frozen=True)
class Reference:
    """Exact values rounded to a sum of two doubles, (samples, size) per output: some 106 bits."""

    high: dict[str, Array]
    low: dict[str, Array]

    def error(self, output: str, computed: Array) -> Array:
        """Absolute errors of computed values."""
        error: Array = np.abs((computed.astype(np.float64) - self.high[output]) - self.low[output])
        return error


def ball_values(graph: Graph, inputs: Mapping[str, Array], values: Mapping[str, Fraction]) -> BallArrays:
    """A graph in ball arithmetic at all samples: per output, per element, a list over the samples."""
    return ball_values_together([(graph, inputs)], values)[0]


def ball_values_together(
    cases: Sequence[tuple[Graph, Mapping[str, Array]]], values: Mapping[str, Fraction]
) -> list[BallArrays]:
    """`ball_values` of several graphs, each at its own inputs; what they have in common is computed once."""
    columns: dict[bytes, Array] = {}
    joint, outputs = _joined(cases, values, columns)

    def leaf(node: Node) -> list[arb]:
        return [arb(x) for x in columns[node[1]].astype(np.float64).tolist()]

    samples = len(next(iter(cases[0][1].values())))
    found = evaluate(joint, Balls(samples), leaf)
    return [{name: found[key] for name, key in names.items()} for names in outputs]


def _joined(
    cases: Sequence[tuple[Graph, Mapping[str, Array]]], values: Mapping[str, Fraction], columns: dict[bytes, Array]
) -> tuple[Graph, list[dict[str, str]]]:
    """One graph of all, depth first so that few values live at a time, and its names for each one's outputs.

    An input is named by its values at the samples, which are put into `columns`; a parameter is its value.
    """
    numbers: dict[Node, int] = {}
    outputs: list[Output] = []
    names: list[dict[str, str]] = []
    for number, (given, inputs) in enumerate(cases):
        graph = depth_first(given)
        renamed: list[int] = []

        def new(ref: Ref, renamed: list[int] = renamed) -> Ref:
            return renamed[ref] if ref >= 0 else ~renamed[~ref]

        for node in graph.nodes:
            if node[0] == "input":
                column = inputs[node[1]][:, node[2]]
                node = ("input", column.tobytes())
                columns[node[1]] = column
            elif node[0] == "param":
                node = ("const", values[node[1]])
            elif node[0] != "const":
                node = (node[0], *map(new, node[1:]))
            renamed.append(numbers.setdefault(node, len(numbers)))
        names.append({output.name: f"{number} {output.name}" for output in graph.outputs})
        outputs += [Output(f"{number} {o.name}", o.shape, tuple(map(new, o.elements))) for o in graph.outputs]
    return Graph(tuple(numbers), tuple(outputs)), names


def reference(values: BallArrays) -> Reference:
    """Round ball values to pairs of doubles; a ball that contains zero is zero."""
    high, low = {}, {}
    for name, elements in values.items():
        centres = [[ZERO if x.contains(0) else x.mid() for x in column] for column in elements]
        first = [[float(x) for x in column] for column in centres]
        rest = [[float(x - h) for x, h in zip(c, f, strict=True)] for c, f in zip(centres, first, strict=True)]
        high[name], low[name] = np.array(first).T, np.array(rest).T
    return Reference(high, low)


ZERO = arb(0)


def disagreement(a: BallArrays, b: BallArrays) -> float:
    """Worst difference over all outputs and samples, relative to the largest value of that output.

    The radius of the balls counts, so two results agree only if both are known well enough; anything that
    is not a number gives infinity.
    """
    worst = 0.0
    for name, elements in a.items():
        pairs = [(u, v) for u, v in zip(elements, b[name], strict=True) if u is not v]
        differences = [float((x - y).abs_upper()) for u, v in pairs for x, y in zip(u, v, strict=True)]
        sizes = [abs(float(x)) for u in elements for x in u]
        if not all(map(isfinite, differences)) or not all(map(isfinite, sizes)):
            return inf
        largest, scale = max(differences, default=0.0), max(sizes, default=0.0)
        if largest > 0:
            worst = max(worst, largest / scale if scale > 0 else inf)
    return worst
