"""Values the interpreter can compute with: floats, balls, error bounds, dimensions.

All of them work on whole batches: a value is an array (or a list) over the samples.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import operator
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
from flint import arb, ctx, fmpq

from awiwi_gen.errors import DimensionError
from awiwi_gen.ir.elementary import OWN, ULPS
from awiwi_gen.units import Unit, one

PRECISION_BITS = 256  # working precision of balls: the checks ask for 200

Array = np.ndarray[Any, Any]


class Floats:
    """IEEE arithmetic in double or single precision on NumPy arrays, bit for bit what C computes.

    Functions are our own, where we have one and it is asked for, or the C library's, for NumPy has others.
    """

    def __init__(self, dtype: type = np.float64, own: bool = False) -> None:
        self.dtype, self.own = dtype, OWN if own else {}

    def const(self, value: Fraction) -> Any:
        return self.dtype(value.numerator / value.denominator)  # the division of integers rounds once

    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    div = staticmethod(operator.truediv)

    def call(self, operation: str, *args: Any) -> Any:
        if operation in CORRECTLY_ROUNDED:
            return CORRECTLY_ROUNDED[operation](args[0])
        if operation in self.own:
            return self.own[operation](*args, self.dtype)
        return np.asarray(libm(operation, self.dtype)(*args), self.dtype)[()]  # a function of numbers alone gives one


CORRECTLY_ROUNDED: dict[str, Callable[..., Any]] = {"sqrt": np.sqrt, "fabs": np.abs}  # NumPy's are the C library's


@cache
def libm(operation: str, dtype: type) -> Callable[..., Any]:
    """A function of the C library as a NumPy ufunc (on objects: slow, but the very same bits)."""
    single = dtype is np.float32
    real = ctypes.c_float if single else ctypes.c_double
    function = getattr(_c_library(), operation + ("f" if single else ""))
    arity = 2 if operation == "atan2" else 1
    function.argtypes, function.restype = [real] * arity, real
    ufunc: Callable[..., Any] = np.frompyfunc(function, arity, 1)
    return ufunc


@cache
def _c_library() -> ctypes.CDLL:
    return ctypes.CDLL(ctypes.util.find_library("m") or None)


class Balls:
    """Rigorous high precision: a value is a list of python-flint balls, one per sample."""

    def __init__(self, samples: int) -> None:
        self.samples = samples
        ctx.prec = PRECISION_BITS

    def const(self, value: Fraction) -> list[arb]:
        return [ball(value)] * self.samples

    def neg(self, a: list[arb]) -> list[arb]:
        return list(map(operator.neg, a))

    def add(self, a: list[arb], b: list[arb]) -> list[arb]:
        return list(map(operator.add, a, b))

    def sub(self, a: list[arb], b: list[arb]) -> list[arb]:
        return list(map(operator.sub, a, b))

    def mul(self, a: list[arb], b: list[arb]) -> list[arb]:
        return list(map(operator.mul, a, b))

    def div(self, a: list[arb], b: list[arb]) -> list[arb]:
        return list(map(operator.truediv, a, b))

    def call(self, operation: str, *args: list[arb]) -> list[arb]:
        return list(map(getattr(arb, FLINT_NAMES.get(operation, operation)), *args))


FLINT_NAMES = {"fabs": "__abs__"}


def ball(value: Fraction | float | int) -> arb:
    """A number as a ball: exact for floats, one rounding at 256 bits for fractions."""
    if isinstance(value, Fraction):
        return arb(fmpq(value.numerator, value.denominator))
    return arb(value)


UNIT_ROUNDOFF: dict[type, float] = {np.float64: 2.0**-53, np.float32: 2.0**-24}
LIBM_ULPS = 4.0  # allowed error of a C library's function, in unit roundoffs of its result
EXACT = {"sqrt": 1.0, "fabs": 1.0}  # correctly rounded functions; an ulp is at most two unit roundoffs


class Bounded:
    """Running error analysis: a value is a pair (approximation, bound of its absolute error).

    The bound covers every rounding of the emitted C, first order and a little more; so a compiled kernel
    whose error exceeds it computes something else than its graph.
    """

    def __init__(self, dtype: type = np.float64, own: bool = False) -> None:
        self.u = UNIT_ROUNDOFF[dtype]
        self.granted = EXACT | {name: 2 * ulps for name, ulps in ULPS.items()} if own else EXACT
        self.tiny = float(np.finfo(dtype).smallest_subnormal)

    def _rounded(self, value: Any, error: Any) -> tuple[Any, Any]:
        return value, error * (1 + 4 * self.u) + self.u * np.abs(value) + self.tiny

    def const(self, value: Fraction) -> tuple[Any, Any]:
        return self._rounded(np.float64(value.numerator / value.denominator), np.float64(0))

    def neg(self, a: Any) -> Any:
        return -a[0], a[1]

    def add(self, a: Any, b: Any) -> Any:
        return self._rounded(a[0] + b[0], a[1] + b[1])

    def sub(self, a: Any, b: Any) -> Any:
        return self._rounded(a[0] - b[0], a[1] + b[1])

    def mul(self, a: Any, b: Any) -> Any:
        return self._rounded(a[0] * b[0], np.abs(a[0]) * b[1] + np.abs(b[0]) * a[1] + a[1] * b[1])

    def div(self, a: Any, b: Any) -> Any:
        quotient = a[0] / b[0]
        margin = np.abs(b[0]) - b[1]
        return self._rounded(quotient, np.where(margin > 0, (a[1] + np.abs(quotient) * b[1]) / margin, np.inf))

    def call(self, operation: str, *args: Any) -> Any:
        value = getattr(np, NUMPY_NAMES.get(operation, operation))(*(a[0] for a in args))
        error = sum(slope * a[1] for slope, a in zip(_slopes(operation, args), args, strict=True))
        roundoff = self.granted.get(operation, LIBM_ULPS) * self.u
        return value, error * (1 + 4 * self.u) + roundoff * np.abs(value) + self.tiny


NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}


def _slopes(operation: str, args: tuple[Any, ...]) -> tuple[Any, ...]:
    """Upper bounds of the absolute partial derivatives over each argument's error interval."""
    x, e = args[0]
    if operation in ("sin", "cos", "fabs", "atan"):
        return (1.0,)
    if operation == "sqrt":
        return (np.where(x > e, 0.5 / np.sqrt(np.maximum(x - e, 0) + (x <= e)), np.inf),)
    if operation in ("acos", "asin"):
        room = 1 - (np.abs(x) + e) ** 2
        return (np.where(room > 0, 1 / np.sqrt(np.where(room > 0, room, 1)), np.inf),)
    if operation == "atan2":
        (y, ey), (x, ex) = args
        radius = np.maximum(np.hypot(y, x) - np.hypot(ey, ex), 0)
        slope = np.where(radius > 0, 1 / np.where(radius > 0, radius, 1), np.inf)
        return slope, slope
    if operation == "exp":
        return (np.exp(x + e),)
    if operation == "log":
        return (np.where(x > e, 1 / np.where(x > e, x - e, 1), np.inf),)
    if operation == "tan":
        return (1 + (np.abs(np.tan(x)) + 2 * e) ** 2,)
    raise KeyError(operation)


class Dimensions:
    """Dimension checking: a value is a unit. Zero, which fits any unit, is None."""

    def __init__(self) -> None:
        self._units: dict[Unit, Unit] = {one: one}  # one object per unit: comparing equal units is slow
        self._products: dict[tuple[int, int], tuple[Unit, Unit, Unit]] = {}  # by the factors' identities
        self._inverses: dict[int, tuple[Unit, Unit]] = {}

    def _same(self, unit: Unit) -> Unit:
        return self._units.setdefault(unit, unit)

    def const(self, value: Fraction) -> Unit | None:
        return one if value else None

    def neg(self, a: Unit | None) -> Unit | None:
        return a

    def add(self, a: Unit | None, b: Unit | None) -> Unit | None:
        if a is None or b is None:
            return b if a is None else a
        if a is not b and a != b:
            raise DimensionError(f"adds {a} and {b}")
        return a

    sub = add

    def mul(self, a: Unit | None, b: Unit | None) -> Unit | None:
        if a is None or b is None:
            return None
        names = id(a), id(b)
        if names not in self._products:
            self._products[names] = a, b, self._same(a * b)
        return self._products[names][2]

    def div(self, a: Unit | None, b: Unit | None) -> Unit | None:
        if a is None or b is None:
            return None
        if id(b) not in self._inverses:
            self._inverses[id(b)] = b, self._same(b**-1)
        return self.mul(a, self._inverses[id(b)][1])

    def call(self, operation: str, *args: Unit | None) -> Unit | None:
        if operation in ("sqrt", "fabs"):
            return None if args[0] is None else args[0] ** (Fraction(1, 2) if operation == "sqrt" else 1)
        if operation == "atan2":
            self.add(*args)
        else:
            for unit in args:
                if unit is not None and unit != one:
                    raise DimensionError(f"takes {operation} of {unit}")
        return one


@contextmanager
def precision_restored() -> Iterator[None]:
    """Set python-flint's precision, which is global, back to what the caller had."""
    precision = ctx.prec
    try:
        yield
    finally:
        ctx.prec = precision
