"""The ranges that the schema permits for the numbers of a hand."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any, get_args

from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.parts import Part, join
from awiwi_gen.units import Quantity

Range = tuple[Fraction, Fraction]


def ranges(part: Part) -> dict[str, Range]:
    """Lower and upper end of the range of every number, by its path relative to the part."""
    found: dict[str, Range] = {}
    for name, field in type(part).model_fields.items():
        measures = list(_measures((field.annotation, *field.metadata)))
        _collect(getattr(part, name), field.alias or name, measures, found)
    return found


def _collect(node: object, path: str, measures: list[Measure], found: dict[str, Range]) -> None:
    """The ranges of all numbers below a value of a field; all numbers of one field have one range."""
    match node:
        case Quantity():
            found[path] = measures[0].ends
        case tuple():
            for index, item in enumerate(node):
                _collect(item, f"{path}[{index}]", measures, found)
        case dict():
            for key, item in node.items():
                _collect(item, join(path, key), measures, found)
        case Part():
            found |= {join(path, below): ends for below, ends in ranges(node).items()}


def _measures(annotations: Iterable[Any]) -> Iterable[Measure]:
    for annotation in annotations:
        if isinstance(annotation, Measure):
            yield annotation
        yield from _measures(get_args(annotation))
