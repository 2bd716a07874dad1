"""How well each number is known: `--spread 'pulleys*=0.05 mm'`, a pattern of paths and a half width."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from math import pi

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.ranges import ranges
from awiwi_gen.units import Quantity, parse_quantity

USUAL = ("*=5 %", "*=0.2 mm", "*=1 deg")  # where nothing else is said: by unit, and in percent for all others


def share_or_quantity(text: str) -> float | Quantity:
    """``5 %`` as 0.05, or a quantity with its unit. Raises InputError for anything else."""
    number, percent, rest = text.partition("%")
    if not percent:
        return parse_quantity(text)
    try:
        share = float(number) / 100
    except ValueError:
        share = -1.0
    if rest.strip() or not 0 <= share < 1:
        raise InputError(f"{text!r} is not a share such as 5 %, from 0 to below 100 %")
    return share


def spreads_of(hand: Hand, finger: str, paths: Sequence[str], given: Sequence[str]) -> dict[str, float]:
    """The half width of each number's range, in SI units; the last pattern that fits a number counts.

    A width with a unit holds for numbers of that unit only. Raises InputError for a pattern that fits no number, and
    where a number would leave the range that the hand file permits.
    """
    numbers, permitted = hand.quantities(), ranges(hand)
    found = dict.fromkeys(paths, 0.0)
    for text in (*USUAL, *given):
        pattern, equals, width = text.rpartition("=")
        if not equals or not width.strip():
            raise InputError(f"--spread {text}: expected PATTERN=WIDTH such as 'pulleys*=0.05 mm' or 'spring.*=2 %'")
        spread = share_or_quantity(width.strip())
        fitting = [path for path in paths if _fits(path, finger, pattern.strip()) and _measures(spread, numbers[path])]
        if not fitting and text in given:
            raise InputError(f"--spread {text}: no number of the study has such a path and unit; see awiwi-gen list")
        for path in fitting:
            value = float(numbers[path])
            found[path] = float(spread) if isinstance(spread, Quantity) else abs(float(value)) * float(spread)
    for path, spread in found.items():
        (low, high), value = permitted[path], float(numbers[path])
        if not float(low) <= value - spread <= value + spread <= float(high):
            raise InputError(
                f"{path} = {numbers[path].text} leaves its range of {float(low):g} to {float(high):g} with a spread of "
                f"{spread:g}; choose a smaller one: --spread '{path}=...'"
            )
    return found


def _measures(spread: float | Quantity, number: Quantity) -> bool:
    return not isinstance(spread, Quantity) or (spread.unit, spread.unit.radians) == (number.unit, number.unit.radians)


def _fits(path: str, finger: str, pattern: str) -> bool:
    """Whether a path, or what it is below the finger, fits a pattern with * and ?; brackets are those of paths."""
    literal = pattern.replace("[", "[[]")
    return fnmatchcase(path, literal) or fnmatchcase(path.removeprefix(f"fingers.{finger}."), literal)


SHOWN = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180 / pi),
    "kg": ("g", 1e3),
    "1": ("%", 1e2),
}  # what people read, and how many


def shown(value: float, unit: str, digits: int = 3) -> str:
    """A value in SI units as people read it: lengths in mm, angles in degrees, masses in g, shares in percent."""
    other, scale = SHOWN.get(unit, (unit, 1.0))
    return f"{value * scale:.{digits}g} {other}"
