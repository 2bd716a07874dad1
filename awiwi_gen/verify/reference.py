"""High-precision values of a kernel at the sample points, and the difference between its graphs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, isfinite
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import NUMPY_NAMES, Balls
from awiwi_gen.ir.graph import Graph, Node, Output, Ref
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.ir.passes.schedule import depth_first
from awiwi_gen.kernel import GUARDS

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
    """`ball_values` of several graphs, each at its own inputs; common subexpressions are computed once."""
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
    """All graphs as one, depth first so that few values live at a time, and its output names for each graph.

    An input is named by its values at the samples, which are added to `columns`; a parameter becomes a constant.
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
    """Ball values rounded to pairs of doubles; a ball that contains zero becomes zero."""
    pairs = {id(column): _rounded(column) for elements in values.values() for column in elements}
    high, low = (
        {name: np.array([pairs[id(column)][part] for column in elements]).T for name, elements in values.items()}
        for part in (0, 1)
    )
    return Reference(high, low)


def _rounded(column: list[arb]) -> tuple[list[float], list[float]]:
    """Centres of balls as doubles, and what these leave."""
    first = [0.0 if x.contains(ZERO) else float(x) for x in column]
    return first, [float(x - h) if h else 0.0 for x, h in zip(column, first, strict=True)]


def domain(values: BallArrays) -> list[int]:
    """The samples at which all values are numbers, and all guards positive."""
    columns = [(name == GUARDS, column) for name, elements in values.items() for column in elements]
    samples = range(len(columns[0][1]))
    return [i for i in samples if all(x[i].is_finite() and (not guard or x[i] > 0) for guard, x in columns)]


ZERO = arb(0)


class Sizes:
    """The algebra of term sizes: a value is a pair (value, size of its terms) of arrays over the samples.

    The size of a sum is the sum of the sizes, so nothing cancels. Sines and angles have size 1.
    """

    def const(self, value: Fraction) -> Any:
        """A number."""
        number = np.float64(value.numerator / value.denominator)
        return number, abs(number)

    def neg(self, a: Any) -> Any:
        """Minus a."""
        return -a[0], a[1]

    def add(self, a: Any, b: Any) -> Any:
        """a + b."""
        return a[0] + b[0], a[1] + b[1]

    def sub(self, a: Any, b: Any) -> Any:
        """a - b."""
        return a[0] - b[0], a[1] + b[1]

    def mul(self, a: Any, b: Any) -> Any:
        """A product."""
        return a[0] * b[0], a[1] * b[1]

    def div(self, a: Any, b: Any) -> Any:
        """A quotient."""
        return a[0] / b[0], a[1] / np.abs(b[0])

    def call(self, operation: str, *args: Any) -> Any:
        """A function."""
        value = getattr(np, NUMPY_NAMES.get(operation, operation))(*(a[0] for a in args))
        if operation == "fabs":
            return value, args[0][1]
        return value, np.sqrt(args[0][1]) if operation == "sqrt" else np.maximum(np.abs(value), 1.0)


def term_size(graph: Graph, inputs: Mapping[str, Array], values: Mapping[str, Fraction], output: str) -> float:
    """The largest sum of absolute terms over all elements and samples of an output; 0 where that is not finite."""
    sizes = Sizes()

    def leaf(node: Node) -> Any:
        if node[0] == "param":
            return sizes.const(values[node[1]])
        column = inputs[node[1]][:, node[2]].astype(np.float64)
        return column, np.abs(column)

    with np.errstate(all="ignore"):
        largest = max((float(np.max(size)) for _, size in evaluate(graph, sizes, leaf)[output]), default=0.0)
    return largest if isfinite(largest) else 0.0


def disagreement(a: BallArrays, b: BallArrays, size_of_terms: Callable[[str], float] = lambda _: 0.0) -> float:
    """Worst difference over all outputs and samples, relative to the largest value of that output.

    An output can be zero at every sample: the torque of a finger's only joint does not depend on its velocity. Then the
    difference is relative to the size of the terms. The radius of the balls counts, so two results agree only if both
    are accurate; a value that is not a number gives infinity.
    """
    worst = 0.0
    for name, elements in a.items():
        pairs = [(u, v) for u, v in zip(elements, b[name], strict=True) if u is not v]
        differences = [float((x - y).abs_upper()) for u, v in pairs for x, y in zip(u, v, strict=True)]
        values = [x for u in elements for x in u]
        sizes = [abs(float(x)) for x in values]
        if not all(map(isfinite, differences)) or not all(map(isfinite, sizes)):
            return inf
        largest, scale = max(differences, default=0.0), max(sizes, default=0.0)
        if largest > 0:
            if all(x.contains(0) for x in values):
                scale = size_of_terms(name)
            worst = max(worst, largest / scale if scale > 0 else inf)
    return worst
