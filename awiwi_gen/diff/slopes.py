"""Values with their derivatives by some numbers of the hand: an algebra for the interpreter of graphs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from awiwi_gen.ir.algebras import NUMPY_NAMES
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.kernel import GUARDS

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Sloped:
    """A value of any shape, and its derivatives (numbers, *shape), or None where it depends on none of the numbers.

    The derivatives may have ones in place of the shape; they broadcast.
    """

    value: Any
    slope: Any = None


class Slopes:
    """The algebra of `Sloped` values over the samples (forward differentiation)."""

    def const(self, value: Fraction) -> Sloped:
        """A number without derivatives."""
        return Sloped(np.float64(value.numerator / value.denominator))

    def neg(self, a: Sloped) -> Sloped:
        """Minus a."""
        return Sloped(-a.value, None if a.slope is None else -a.slope)

    def add(self, a: Sloped, b: Sloped) -> Sloped:
        """a + b."""
        return Sloped(a.value + b.value, _sum(a.slope, b.slope))

    def sub(self, a: Sloped, b: Sloped) -> Sloped:
        """a - b."""
        return self.add(a, self.neg(b))

    def mul(self, a: Sloped, b: Sloped) -> Sloped:
        """A product."""
        return Sloped(a.value * b.value, _sum(_times(a.slope, b.value), _times(b.slope, a.value)))

    def div(self, a: Sloped, b: Sloped) -> Sloped:
        """A quotient."""
        quotient = a.value / b.value
        return Sloped(quotient, _sum(_times(a.slope, 1 / b.value), _times(b.slope, -quotient / b.value)))

    def call(self, operation: str, *args: Sloped) -> Sloped:
        """A function of the graph."""
        values = [each.value for each in args]
        found = getattr(np, NUMPY_NAMES.get(operation, operation))(*values)
        if all(each.slope is None for each in args):
            return Sloped(found)
        if operation == "atan2":
            (y, x), square = values, values[0] ** 2 + values[1] ** 2
            return Sloped(found, _sum(_times(args[0].slope, x / square), _times(args[1].slope, -y / square)))
        return Sloped(found, _times(args[0].slope, _DERIVATIVES[operation](values[0], found)))


_DERIVATIVES: dict[str, Callable[[Any, Any], Any]] = {  # of the argument and the value
    "sin": lambda x, _: np.cos(x),
    "cos": lambda x, _: -np.sin(x),
    "tan": lambda _, t: 1 + t**2,
    "asin": lambda x, _: 1 / np.sqrt(1 - x**2),
    "acos": lambda x, _: -1 / np.sqrt(1 - x**2),
    "atan": lambda x, _: 1 / (1 + x**2),
    "exp": lambda _, e: e,
    "log": lambda x, _: 1 / x,
    "sqrt": lambda _, r: 0.5 / r,
    "fabs": lambda x, _: np.sign(x),
}


def _sum(a: Any, b: Any) -> Any:
    return b if a is None else a if b is None else a + b


def _times(slope: Any, factor: Any) -> Any:
    return None if slope is None else slope * factor


def outputs(
    graph: Graph, inputs: Mapping[str, Sloped], numbers: Mapping[str, Sloped], samples: int, counted: int = 0
) -> dict[str, Sloped]:
    """All outputs of a graph (samples, *shape), with derivatives (counted, samples, *shape) if ``counted`` is not zero.

    ``inputs`` have values (samples, size), ``numbers`` are scalars by path. A sample is NaN in all outputs where an
    output is not finite, or a guard not positive.
    """

    def leaf(node: Node) -> Sloped:
        if node[0] == "param":
            return numbers[node[1]]
        port, element = inputs[node[1]], node[2]
        return Sloped(port.value[:, element], None if port.slope is None else port.slope[:, :, element])

    with np.errstate(all="ignore"):
        found = evaluate(graph, Slopes(), leaf)
    arrays: dict[str, Sloped] = {}
    inside = np.ones(samples, dtype=bool)
    for output in graph.outputs:
        value = np.stack([np.broadcast_to(each.value, samples) for each in found[output.name]], axis=-1)
        inside &= np.isfinite(value).all(axis=1) & ((value > 0).all(axis=1) if output.name == GUARDS else True)
        slope = None
        if counted:
            slope = np.zeros((counted, *value.shape))
            for index, each in enumerate(found[output.name]):
                slope[:, :, index] = 0.0 if each.slope is None else each.slope
            slope = slope.reshape(counted, samples, *output.shape)
        arrays[output.name] = Sloped(value.reshape(samples, *output.shape), slope)
    arrays.pop(GUARDS, None)
    for each in arrays.values():
        each.value[~inside] = np.nan
    return arrays
