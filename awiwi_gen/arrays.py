"""Arrays on the way to C: what counts as numbers, and the shortest way of one sample to a kernel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Decimal
from math import prod
from numbers import Real
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Shape = tuple[int, ...]
Samples = tuple[Array, int, int]  # an array to point at, the steps from sample to sample and element to element

KINDS = {"c": "complex numbers", "U": "text", "S": "bytes", "M": "dates", "m": "durations", "V": "records"}

# Written out for each kernel, as `collections.namedtuple` does it: loops over ports would double what a call costs.
SOURCE = """
def call({inputs}):
    if not ({tests}):
        return None
    {allocate}
    status = c({pointers})
    return {result}
"""
TEST = "type({0}) is ndarray and {0}.shape == {1} and {0}.dtype is dtype and {0}.flags.carray"


def as_numbers(value: Any) -> Array:
    """An array of real numbers. Raises TypeError or ValueError for all that NumPy would silently make numbers of."""
    derived = isinstance(value, np.ndarray) and type(value) is not np.ndarray  # np.ma is slow to import
    if derived and isinstance(value, np.ma.MaskedArray):
        raise TypeError("it is masked; fill it, or choose the samples that are not")
    array = np.asarray(value)
    kind = array.dtype.kind
    if kind == "O":  # numbers of Python and SymPy, but neither None nor dates nor texts
        for one in array.flat:
            if not isinstance(one, (Real, Decimal)):
                raise TypeError(f"it holds a {type(one).__name__}")
        return array.astype(float)
    if kind not in "fiub":
        raise TypeError(f"it holds {KINDS.get(kind, array.dtype.name)}")
    return array


def direct_call(
    inputs: Sequence[Shape],
    outputs: Sequence[Shape],
    result: Callable[..., Any] | None,
    c: Callable[..., Any],
    pointer: Callable[[Any], Any],
    dtype: Any,
) -> Callable[..., Any]:
    """A function of the inputs, arrays of these shapes, that calls the C function `c` and returns what it writes.

    `c` takes what `pointer` makes of each array, and returns a status if `result` has a field for it. `result` makes a
    named tuple of outputs and status; None is for a single output. The function returns None, and calls nothing, where
    an argument is no array of the shape and type that C reads: writeable, aligned and in C's order.
    """
    given, found = [f"i{k}" for k in range(len(inputs))], [f"o{k}" for k in range(len(outputs))]
    fields = [*found, "array(status, intc)"][: len(result._fields) if result else 1]  # type: ignore[attr-defined]
    text = SOURCE.format(
        inputs=", ".join(given),
        tests=" and ".join(TEST.format(name, shape) for name, shape in zip(given, inputs, strict=True)) or "True",
        allocate="; ".join(f"{name} = empty({shape}, dtype)" for name, shape in zip(found, outputs, strict=True)),
        pointers=", ".join(f"pointer({name})" for name in (*given, *found)),
        result=f"result({', '.join(fields)})" if result else fields[0],
    )
    names: dict[str, Any] = {"ndarray": np.ndarray, "empty": np.empty, "array": np.array, "intc": np.intc}
    names |= {"c": c, "pointer": pointer, "dtype": dtype, "result": result}
    exec(text, names)  # noqa: S102 names and numbers of a checked manifest
    made: Callable[..., Any] = names["call"]
    return made


def as_samples(array: Array, own: tuple[int, ...], lead: tuple[int, ...], shape: tuple[int, ...]) -> Samples:
    """An input as samples and elements that are evenly apart; the step between elements is 0 where there is one."""
    size = prod(shape)
    tight = size, int(size > 1)
    flags = array.flags
    if flags.c_contiguous and flags.aligned and (own == lead or not own):
        return array, size if own else 0, tight[1]
    if not prod(lead):
        return np.empty(0, array.dtype), *tight
    matrix = array if array.ndim == 2 and own == lead and len(lead) == 1 else rows(array, lead + shape, size)
    (step, misfit), (element, askew) = (divmod(stride, array.itemsize) for stride in matrix.strides)
    if misfit or askew or not flags.aligned or (size > 1 and not element):
        return np.array(matrix, order="C"), *tight
    return matrix, step, element if size > 1 else 0


def packed(array: Array, step: int, element: int) -> tuple[Array, int]:
    """The same with elements one after another."""
    return (array, step) if element in (0, 1) else (np.array(array, order="C"), array.shape[1])


def rows(array: Array, shape: tuple[int, ...], size: int) -> Array:
    """An array broadcast to a shape, as a matrix with a row for each sample."""
    return np.broadcast_to(array, shape).reshape(-1, size)


def rolled(array: Array, count: int) -> Array:
    """The first so many dimensions after the others."""
    return array.transpose(*range(count, array.ndim), *range(count))
