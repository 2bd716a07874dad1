"""High-precision values of a kernel at the sample points, and how far its graphs agree on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import inf, isfinite
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls, ball
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate

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
    samples = len(next(iter(inputs.values())))

    def leaf(node: Node) -> list[arb]:
        if node[0] == "param":
            return [ball(values[node[1]])] * samples
        return [arb(x) for x in inputs[node[1]][:, node[2]].astype(np.float64).tolist()]

    return evaluate(graph, Balls(samples), leaf)


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
