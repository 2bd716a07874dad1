"""What the schema permits for the numbers of a hand."""

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
    numbers = part.quantities()
    return {path: (each.of(numbers[path].unit) or each).ends for path, each in measures(part).items()}


def measures(part: Part) -> dict[str, Measure]:
    """What every number must be, by its path relative to the part."""
    found: dict[str, Measure] = {}
    for name, field in type(part).model_fields.items():
        if field.exclude:  # no number of the kernels
            continue
        of_field = list(_measures((field.annotation, *field.metadata)))
        _collect(getattr(part, name), field.alias or name, of_field, found)
    return found


def _collect(node: object, path: str, of_field: list[Measure], found: dict[str, Measure]) -> None:
    """The measures of all numbers below a value of a field; all numbers of one field have the same."""
    match node:
        case Quantity():
            found[path] = of_field[0]
        case tuple():
            for index, item in enumerate(node):
                _collect(item, f"{path}[{index}]", of_field, found)
        case dict():
            for key, item in node.items():
                _collect(item, join(path, key), of_field, found)
        case Part():
            found |= {join(path, below): measure for below, measure in measures(node).items()}


def _measures(annotations: Iterable[Any]) -> Iterable[Measure]:
    for annotation in annotations:
        if isinstance(annotation, Measure):
            yield annotation
        yield from _measures(get_args(annotation))
