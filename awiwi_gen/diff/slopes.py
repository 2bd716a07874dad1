"""Values with their derivatives by some numbers of the hand: an algebra for the interpreter of graphs."""

from __future__ import annotations

import operator
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
    """A value (samples, ...), or a number, and its derivatives (numbers, samples, ...); None where there are none.

    Derivatives may have ones in place of the samples. Sums, products and quotients are those of values without further
    dimensions.
    """

    value: Any
    slope: Any = None
    __array_ufunc__ = None  # NumPy's numbers leave the operators to this class

    def at(self, *index: int) -> Sloped:
        """One element, at all samples."""
        place = (slice(None), *index)
        return Sloped(self.value[place], None if self.slope is None else self.slope[(slice(None), *place)])

    def __neg__(self) -> Sloped:
        return Sloped(-self.value, _times(self.slope, -1))

    def __add__(self, other: Any) -> Sloped:
        b = _sloped(other)
        return Sloped(self.value + b.value, _sum(self.slope, b.slope))

    def __sub__(self, other: Any) -> Sloped:
        return self + -_sloped(other)

    def __mul__(self, other: Any) -> Sloped:
        b = _sloped(other)
        return Sloped(self.value * b.value, _sum(_times(self.slope, b.value), _times(b.slope, self.value)))

    def __truediv__(self, other: Any) -> Sloped:
        b = _sloped(other)
        quotient = self.value / b.value
        return Sloped(quotient, _sum(_times(self.slope, 1 / b.value), _times(b.slope, -quotient / b.value)))

    __radd__, __rmul__ = __add__, __mul__


def function(operation: str, *args: Sloped) -> Sloped:
    """A function of a graph."""
    values = [each.value for each in args]
    found = getattr(np, NUMPY_NAMES.get(operation, operation))(*values)
    if all(each.slope is None for each in args):
        return Sloped(found)
    if operation == "atan2":
        (y, x), square = values, values[0] ** 2 + values[1] ** 2
        return Sloped(found, _sum(_times(args[0].slope, x / square), _times(args[1].slope, -y / square)))
    return Sloped(found, _times(args[0].slope, DERIVATIVES[operation](values[0], found)))


DERIVATIVES: dict[str, Callable[[Any, Any], Any]] = {  # of the argument and the value
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


class Slopes:
    """The algebra of `Sloped` values over the samples: forward differentiation."""

    neg, add, sub = staticmethod(operator.neg), staticmethod(operator.add), staticmethod(operator.sub)
    mul, div, call = staticmethod(operator.mul), staticmethod(operator.truediv), staticmethod(function)

    def const(self, value: Fraction) -> Sloped:
        """A number without derivatives."""
        return Sloped(np.float64(value.numerator / value.denominator))


def _sloped(value: Any) -> Sloped:
    return value if isinstance(value, Sloped) else Sloped(value)


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
