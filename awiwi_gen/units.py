"""Units: SI exponents as exact fractions, their algebra, and text such as "6.2 mm" read without rounding.

A designer writes `"6.5 mm"` and `"-20 deg"`; a kernel's author writes `N * m / rad`. Both become a `Unit`. Values are
`Fraction`s in SI, so 6.5 mm is 13/2000 m and rounding happens once, when a `float` is asked for.

The radian is dimensionless, as in SI: a pulley's radius times its angle *is* a length. It stays in the label, so that
"N m/rad" is printed as it was written, and so that the reader of a hand file can tell "20 rad/s" from "20 Hz".
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import NamedTuple

from awiwi_gen.errors import Fault, InputError

# fmt: off
__all__ = [
    "A", "Hz", "J", "N", "Pa", "Quantity", "Unit", "V", "W", "kg", "m", "name_of", "one", "parse_quantity",
    "parse_unit", "rad", "s",
]
# fmt: on


class Dimension(NamedTuple):
    """SI exponents of a unit, without its scale and its name."""

    m: Fraction = Fraction(0)
    kg: Fraction = Fraction(0)
    s: Fraction = Fraction(0)
    A: Fraction = Fraction(0)


@dataclass(frozen=True)
class Unit:
    """An SI unit: a dimension, and the factors it was written with.

    Equality and hash compare the dimension only: `N * m`, `J` and `N * m / rad` may be added, and that is what the
    dimension checker asks. The factors serve the label.
    """

    dimension: Dimension
    factors: tuple[tuple[str, Fraction], ...] = field(compare=False)

    def __mul__(self, other: Unit) -> Unit:
        return Unit(
            Dimension(*(a + b for a, b in zip(self.dimension, other.dimension, strict=True))),
            _merged((*self.factors, *other.factors)),
        )

    def __truediv__(self, other: Unit) -> Unit:
        return self * other**-1

    def __pow__(self, exponent: int | Fraction) -> Unit:
        return Unit(
            Dimension(*(a * exponent for a in self.dimension)),
            _merged((symbol, power * exponent) for symbol, power in self.factors),
        )

    @property
    def radians(self) -> Fraction:
        """Exponent of the radian, which the dimension leaves out: 1 for rad/s, 0 for Hz."""
        return dict(self.factors).get("rad", Fraction(0))

    @cached_property
    def label(self) -> str:
        """The unit as text that `parse_unit` reads back: "N m/rad", "kg m^2", "1"."""
        above = " ".join(_power(symbol, power) for symbol, power in self.factors if power > 0)
        below = [_power(symbol, -power) for symbol, power in self.factors if power < 0]
        if not below:
            return above or "1"
        return f"{above or '1'}/{below[0] if len(below) == 1 else '(' + ' '.join(below) + ')'}"

    def __str__(self) -> str:
        return self.label

    def __repr__(self) -> str:
        return f"Unit({self.label})"


def _merged(factors: Iterable[tuple[str, Fraction]]) -> tuple[tuple[str, Fraction], ...]:
    """Add the exponents of equal symbols, in order of first appearance, and drop those that cancel."""
    total: dict[str, Fraction] = {}
    for symbol, power in factors:
        total[symbol] = total.get(symbol, Fraction(0)) + power
    return tuple((symbol, power) for symbol, power in total.items() if power)


def _power(symbol: str, exponent: Fraction) -> str:
    if exponent == 1:
        return symbol
    return f"{symbol}^{exponent}" if exponent.denominator == 1 else f"{symbol}^({exponent})"


def _base(symbol: str, dimension: Dimension) -> Unit:
    return Unit(dimension, ((symbol, Fraction(1)),))


def _named(symbol: str, unit: Unit) -> Unit:
    """The same dimension under a name of its own."""
    return _base(symbol, unit.dimension)


one = Unit(Dimension(), ())
m = _base("m", Dimension(m=Fraction(1)))
kg = _base("kg", Dimension(kg=Fraction(1)))
s = _base("s", Dimension(s=Fraction(1)))
A = _base("A", Dimension(A=Fraction(1)))
rad = _named("rad", one)
Hz = _named("Hz", one / s)
N = _named("N", kg * m / s**2)
J = _named("J", N * m)
W = _named("W", J / s)
Pa = _named("Pa", N / m**2)
V = _named("V", W / A)

# The radian is part of the key: "20 Hz" for an angular velocity is wrong by a factor 2 pi and must be refused.
_NAMES: dict[tuple[Dimension, Fraction], str] = {
    (unit.dimension, unit.radians): name
    for unit, name in (
        (one, "a plain number"),
        (rad, "an angle"),
        (m, "a length"),
        (m**2, "an area"),
        (m**3, "a volume"),
        (kg, "a mass"),
        (s, "a time"),
        (A, "a current"),
        (one / s, "a frequency"),
        (rad / s, "an angular velocity"),
        (rad / s**2, "an angular acceleration"),
        (m / s, "a velocity"),
        (m / s**2, "an acceleration"),
        (m / rad, "a length per angle"),
        (rad / m, "an angle per length"),
        (N, "a force"),
        (N * m, "a torque"),
        (N * s, "a momentum"),
        (N / m, "a stiffness"),
        (N / m**2, "a pressure"),
        (N * s / m, "a damping"),
        (N * m / rad, "a rotational stiffness"),
        (N * m * s / rad, "a rotational damping"),
        (N * m / A, "a torque constant"),
        (kg * m**2, "a moment of inertia"),
        (kg / m**3, "a density"),
        (W, "a power"),
        (V, "a voltage"),
    )
}


def name_of(unit: Unit) -> str:
    """The noun for a quantity of this unit, with its article; the SI exponents where English has no noun."""
    found = _NAMES.get((unit.dimension, unit.radians)) or _NAMES.get((unit.dimension, Fraction(0)))
    if found:
        return found
    exponents = zip(Dimension._fields, unit.dimension, strict=True)
    return f"a quantity in {Unit(unit.dimension, _merged(exponents)).label}"


@dataclass(frozen=True, slots=True)
class Quantity:
    """An exact value in SI, its unit, and the text it was read from (which equality ignores)."""

    value: Fraction
    unit: Unit
    text: str = field(compare=False)

    def __float__(self) -> float:
        """The double nearest to the exact value."""
        return float(self.value)

    def __str__(self) -> str:
        return self.text


# 100 digits: more than the 200 bits at which two derivations are compared.
_PI = Fraction("3.1415926535897932384626433832795028841971693993751058209749445923078164062862089986280348253421170680")
_PREFIXES = {"": 0, "n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "k": 3, "M": 6, "G": 9}  # micro has two code points
_SYMBOLS: dict[str, tuple[Fraction, Unit]] = {
    prefix + symbol: (Fraction(10) ** power * scale, unit)
    for symbol, scale, unit in (
        ("m", Fraction(1), m),
        ("g", Fraction(1, 1000), kg),
        ("s", Fraction(1), s),
        ("A", Fraction(1), A),
        ("N", Fraction(1), N),
        ("Nm", Fraction(1), N * m),
        ("J", Fraction(1), J),
        ("W", Fraction(1), W),
        ("V", Fraction(1), V),
        ("Pa", Fraction(1), Pa),
        ("Hz", Fraction(1), Hz),
        ("rad", Fraction(1), rad),
    )
    for prefix, power in _PREFIXES.items()
} | {
    "cm": (Fraction(1, 100), m),
    "deg": (_PI / 180, rad),
    "°": (_PI / 180, rad),
    "rpm": (_PI / 30, rad / s),
}

_MOST_TEXT = 80
_MOST_POWER_OF_TEN = 30  # refused before any arithmetic: Fraction("1e999999999") would fill the memory
_NUMBER = re.compile(r"(?P<mantissa>[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))(?:[eE](?P<power>[+-]?[0-9]+))?")
_FACTOR = re.compile(r"(?P<symbol>[^\W\d_]+|°)(?:\^(?P<power>-?(?:[1-3][0-9]|[1-9])))?")
_SUPERSCRIPTS = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
# Units that are not read, with their value in one that is.
_FOREIGN = {
    "in": ("inches", "25.4", "mm"), "inch": ("inches", "25.4", "mm"), "inches": ("inches", "25.4", "mm"),
    '"': ("inches", "25.4", "mm"), "mil": ("thousandths of an inch", "0.0254", "mm"), "ft": ("feet", "304.8", "mm"),
    "lb": ("pounds", "453.59237", "g"), "lbs": ("pounds", "453.59237", "g"), "oz": ("ounces", "28.349523125", "g"),
    "lbf": ("pounds of force", "4.4482216152605", "N"), "kgf": ("kilograms of force", "9.80665", "N"),
    "min": ("minutes", "60", "s"), "bar": ("bars", "100", "kPa"), "psi": ("pounds per square inch", "6894.757", "Pa"),
}  # fmt: skip


def parse_quantity(text: str) -> Quantity:
    """Read "6.2 mm", "-20 deg", "35 g mm^2" or "0.5" exactly.

    Raises `InputError` with one fault (key: the text, message: a predicate) for any text but a finite number followed
    by known units.
    """
    text = text.strip()
    if len(text) > _MOST_TEXT:
        raise _fault(text, f"is longer than {_MOST_TEXT} characters")
    number = _NUMBER.match(text)
    if number is None:
        raise _fault(text, 'does not begin with a number; expected something such as "6.2 mm"')
    if abs(int(number["power"] or 0)) > _MOST_POWER_OF_TEN:
        raise _fault(text, f"is too large or too small; powers of ten end at {_MOST_POWER_OF_TEN}")
    written = text[number.end() :].strip()
    if written in _FOREIGN:
        name, factor, known = _FOREIGN[written]
        value = Fraction(number[0]) * Fraction(factor)
        raise _fault(text, f'is in {name}, which are not read; did you mean "{_decimal(value)} {known}"?')
    scale, unit = _scaled_unit(text, written)
    return Quantity(Fraction(number[0]) * scale, unit, text)


def parse_unit(text: str) -> Unit:
    """Read a label such as "N m/rad", "kg m^2", "1/s" or "1"; scaled units become their SI unit.

    Raises `InputError` for unknown units.
    """
    return _scaled_unit(text, text.strip())[1]


def _scaled_unit(whole: str, text: str) -> tuple[Fraction, Unit]:
    try:
        return _parse_scaled_unit(text)
    except ValueError as error:
        raise _fault(whole, str(error)) from None


@lru_cache(maxsize=256)  # a hand file has hundreds of numbers in a dozen units
def _parse_scaled_unit(text: str) -> tuple[Fraction, Unit]:
    """Product, then at most one slash, then one factor or a bracket: so that "N/m s" cannot be read in two ways."""
    above, slash, below = (part.strip() for part in text.partition("/"))
    scale, unit = (Fraction(1), one) if above in ("", "1") else _parse_product(above)
    if not slash:
        return scale, unit
    bracket = re.fullmatch(r"\(([^()]*)\)", below)
    if "/" in below or (bracket is None and len(below.split()) != 1):
        raise ValueError('divides by several factors; bracket them, as in "kg/(m s^2)"')
    divisor, divisor_unit = _parse_product(bracket[1] if bracket else below)
    return scale / divisor, unit / divisor_unit


def _parse_product(text: str) -> tuple[Fraction, Unit]:
    scale, unit = Fraction(1), one
    for word in text.replace("*", " ").replace("·", " ").split() or [""]:
        factor = _FACTOR.fullmatch(word)
        if factor is None or factor["symbol"] not in _SYMBOLS:
            raise ValueError(f'has the unknown unit "{word}"{_suggestion(word)}')
        symbol_scale, symbol_unit = _SYMBOLS[factor["symbol"]]
        power = int(factor["power"] or 1)
        scale, unit = scale * symbol_scale**power, unit * symbol_unit**power
    return scale, unit


def _suggestion(word: str) -> str:
    """A known unit that looks like this one; case is the likeliest slip, so "MM" gives "mm", and "mm²" gives "mm^2"."""
    plain = _SUPERSCRIPTS.sub(lambda found: "^" + unicodedata.normalize("NFKC", found[0]).replace("\u2212", "-"), word)
    symbol, *power = re.split(r"(?=\^|\d)", plain, maxsplit=1)
    near = [symbol] if symbol in _SYMBOLS else [known for known in _SYMBOLS if known.lower() == symbol.lower()]
    near = near or difflib.get_close_matches(symbol[:_MOST_TEXT], _SYMBOLS, n=1, cutoff=0.4)
    exponent = "^" + power[0].lstrip("^") if power else ""
    meant = near[0] + exponent if near else ""
    return f'; did you mean "{meant}"?' if _FACTOR.fullmatch(meant) else f'; did you mean "{near[0]}"?' if near else ""


def _decimal(value: Fraction) -> str:
    """A number as a designer writes it, to nine digits."""
    return f"{float(value):.9g}"


def _fault(text: str, message: str) -> InputError:
    shown = text if len(text) <= _MOST_TEXT else text[:_MOST_TEXT] + "..."
    return InputError(Fault(key=f'"{shown}"', message=message))
