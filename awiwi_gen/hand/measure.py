"""What a number of a hand file must be: its dimension and its plausible range."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from awiwi_gen.errors import InputError
from awiwi_gen.units import Quantity, Unit, name_of, parse_quantity

__all__ = ["Measure"]

_LEAST = Fraction(1, 10**40)  # in SI; far below the rounding errors in exported models


@dataclass(frozen=True)
class Measure:
    """The dimension of a number (that of the example) and its plausible range, ends included.

    A number whose dimension depends on others of its table has a measure for each in `others`, the first for a slide.

    The ranges cover every hand that people build, of a cat's or a crane's size; they catch "6.2 km" and "6.2 fm". A
    range that begins below zero includes zero, and rounding errors of other programs, but no "1e-30 nm^39/m^38".
    """

    example: str
    low: str
    high: str
    others: tuple[Measure, ...] = ()

    @cached_property
    def unit(self) -> Unit:
        """The unit of the example."""
        return parse_quantity(self.example).unit

    @cached_property
    def ends(self) -> tuple[Fraction, Fraction]:
        """Both ends of the range, in SI units."""
        return parse_quantity(self.low).value, parse_quantity(self.high).value

    @property
    def expected(self) -> str:
        """For error messages: `a length such as "6.2 mm"`."""
        return f'{name_of(self.unit)} such as "{self.example}"'

    def fits(self, unit: Unit) -> bool:
        """Whether a unit has this dimension. Units compare without the radian, but here it counts."""
        return (unit, unit.radians) == (self.unit, self.unit.radians)

    def of(self, unit: Unit) -> Measure | None:
        """This measure or the one of `others` that has the dimension of a unit; None if none has."""
        return next((each for each in (self, *self.others) if each.fits(unit)), None)

    def read(self, value: object) -> Quantity:
        """Read one value of the file. Raises `ValueError` with a predicate: 'is a force; expected a length ...'."""
        match value:
            case str():
                pass
            case int() | float() if not isinstance(value, bool):
                raise ValueError(f"has no unit; expected text: {self.expected}")
            case _:
                raise ValueError(f"is not text; expected {self.expected}")
        try:
            quantity = parse_quantity(value)
        except InputError as error:
            raise ValueError(error.faults[0].message) from None
        measure = self.of(quantity.unit)
        if measure is None:
            kinds = [self.expected, *(each.expected for each in self.others)]
            raise ValueError(f"is {name_of(quantity.unit)}; expected {' or '.join(kinds)}")
        measure.require(value, quantity)
        return quantity

    def require(self, value: str, quantity: Quantity) -> None:
        """Raise `ValueError` where a quantity of this dimension, read from a text, is outside the range."""
        low, high = self.ends
        if low > 0 and quantity.value <= 0:
            raise ValueError(f"must be above zero; expected {self.expected}")
        if not low <= quantity.value <= high:
            slip = self._other_angle(value, quantity)
            raise ValueError(f"is not plausible; expected {self.expected}, from {self.low} to {self.high}{slip}")
        if 0 < abs(quantity.value) < _LEAST:
            zero = f'"0 {self.example.partition(" ")[2]}"'
            raise ValueError(f"is not plausible; expected zero, written {zero}, or {self.expected}")

    def _other_angle(self, text: str, quantity: Quantity) -> str:
        """A hint where degrees were written as radians: "80 rad" for an angle."""
        if self.unit.label != "rad" or not text.endswith("rad"):
            return ""
        degrees = text.removesuffix("rad") + "deg"
        return f'; did you mean "{degrees}"?' if abs(parse_quantity(degrees).value) <= self.ends[1] else ""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        text = core_schema.str_schema(metadata={"pydantic_js_updates": {"examples": [self.example]}})
        return core_schema.no_info_plain_validator_function(self.read, json_schema_input_schema=text)
