"""Constants that know what they were computed from.

Passes compute with constants. Where the hand's numbers are read at run time, a constant stands for an expression of
them: it has a value, with which passes decide, and the expression, which becomes C. Its value is generic: no two
expressions have the same unless they are equal for all numbers, so no pass relies on a coincidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from awiwi_gen.ir.builder import FRACTION_BITS, Builder
from awiwi_gen.ir.graph import Ref

ROUNDED_BITS = FRACTION_BITS - 2


class Traced(Fraction):
    """A fraction, and its expression as a reference into a builder. Arithmetic keeps both."""

    numbers: Builder
    ref: Ref

    @classmethod
    def of(cls, value: Fraction, numbers: Builder, ref: Ref) -> Fraction:
        """A value with its expression; a plain fraction where the expression is a constant."""
        constant = numbers.value(ref)
        if constant is not None:
            return constant
        if value.denominator.bit_length() > FRACTION_BITS:  # a builder would shorten it and lose the expression
            value = Fraction(round(value * (1 << ROUNDED_BITS)), 1 << ROUNDED_BITS)
        made = cls(value.numerator, value.denominator)
        made.numbers, made.ref = numbers, ref
        return made

    def __neg__(self) -> Fraction:
        return Traced.of(super().__neg__(), self.numbers, ~self.ref)

    def __abs__(self) -> Fraction:
        return self if self.numerator >= 0 else -self

    def __add__(self, other: Any) -> Any:
        return _combined(Fraction.__add__, self, other, Builder.add)

    def __sub__(self, other: Any) -> Any:
        return self + -other if isinstance(other, (int, Fraction)) else NotImplemented

    def __mul__(self, other: Any) -> Any:
        return _combined(Fraction.__mul__, self, other, Builder.mul)

    def __truediv__(self, other: Any) -> Any:
        if not isinstance(other, (int, Fraction)):
            return NotImplemented
        return _combined(Fraction.__truediv__, self, other, lambda numbers, refs: numbers.div(*refs))

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __rtruediv__(self, other: Any) -> Any:
        return _combined(Fraction.__rtruediv__, self, other, lambda numbers, refs: numbers.div(refs[1], refs[0]))

    def __pow__(self, exponent: Any) -> Any:
        value = super().__pow__(exponent)
        return Traced.of(Fraction(value), self.numbers, self.numbers.power(self.ref, int(exponent)))

    __radd__, __rmul__ = __add__, __mul__


def _combined(
    operation: Callable[[Any, Any], Any], a: Traced, b: Any, expression: Callable[[Builder, list[Ref]], Ref]
) -> Any:
    if not isinstance(b, (int, Fraction)):
        return NotImplemented
    ref = b.ref if isinstance(b, Traced) else a.numbers.const(b)
    return Traced.of(operation(a, b), a.numbers, expression(a.numbers, [a.ref, ref]))


def computed(value: Fraction, arguments: Sequence[Fraction], expression: Callable[..., Ref]) -> Fraction:
    """The value of a function of constants; traced where one of them is. ``expression`` takes a builder and references."""
    traced = next((each for each in arguments if isinstance(each, Traced)), None)
    if traced is None:
        return value
    numbers = traced.numbers
    refs = [each.ref if isinstance(each, Traced) else numbers.const(each) for each in arguments]
    return Traced.of(value, numbers, expression(numbers, *refs))


def hypotenuse(numbers: Builder, a: Ref, b: Ref) -> Ref:
    """The square root of a sum of two squares."""
    return numbers.call("sqrt", numbers.add((numbers.mul((a, a)), numbers.mul((b, b)))))
