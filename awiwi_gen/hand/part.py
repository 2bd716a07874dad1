"""What all parts of a hand have in common: types of numbers, and access to the numbers of a part."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from awiwi_gen.hand.measure import Measure
from awiwi_gen.units import Quantity

Keys = tuple[str | int, ...]
"""The path of a value in a hand file: `("fingers", "index", "links", 1, "mass")`."""


Angle = Annotated[Quantity, Measure("20 deg", "-360 deg", "360 deg")]
Length = Annotated[Quantity, Measure("6.2 mm", "-1 m", "1 m")]
Size = Annotated[Quantity, Measure("6.2 mm", "10 um", "1 m")]
# Models have bodies of a microgram and less where two joint axes meet.
Mass = Annotated[Quantity, Measure("1.5 g", "1 ng", "10 kg")]
Moment = Annotated[Quantity, Measure("35 g mm^2", "1e-9 g mm^2", "1 kg m^2")]
Product = Annotated[Quantity, Measure("-2 g mm^2", "-1 kg m^2", "1 kg m^2")]
Point = Annotated[tuple[Length, Length, Length], Field(strict=False, examples=['["6 mm", "0 mm", "0 mm"]'])]
Component = Annotated[Quantity, Measure("0.6", "-1", "1")]
Direction = Annotated[tuple[Component, Component, Component], Field(strict=False, examples=['["0", "0", "1"]'])]


def absent(value: object) -> bool:
    """Whether an optional key is not in the file: then it is not in the digest either, so that older digests stay."""
    return value is None


# ---------------------------------------------------------------------------------------------------- parts


class Part(BaseModel):
    """A frozen part of a hand."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    def quantities(self) -> dict[str, Quantity]:
        """Every number by its path, relative to this part: `links[1].mass`."""
        return {path: quantity for path, quantity, _ in _leaves(self)}

    def sources(self) -> dict[str, str]:
        """The source of each number, by the same paths as `quantities`."""
        return {path: source for path, _, source in _leaves(self)}

    def assumed(self) -> dict[str, Quantity]:
        """The numbers whose source marks them as guesses."""
        return {path: quantity for path, quantity, source in _leaves(self) if source.startswith("assumed")}

    def symbolic(self, leaf: Callable[[str, Quantity], object]) -> Any:
        """The same tree, methods included, with `leaf(path, quantity)` in the place of each number."""
        return _replaced(self, "", leaf)

    def digest(self) -> str:
        """SHA-256 of the values of this part, as 64 hexadecimal digits; the layout of its text does not count.

        "6.5 mm" and "0.65 cm" are the same number and give the same digest.
        """
        exact = self.symbolic(lambda _, quantity: str(quantity.value))
        return hashlib.sha256(json.dumps(exact.model_dump(mode="json", by_alias=True)).encode()).hexdigest()

    def __hash__(self) -> int:
        return hash(self.digest())  # pydantic cannot hash the dictionaries inside

    def entries(self) -> Iterator[tuple[str, str, object]]:
        """Key in the file, attribute and value of each field, in the order of the schema."""
        for name, field in type(self).model_fields.items():
            yield field.alias or name, name, getattr(self, name)


def _leaves(node: object) -> Iterator[tuple[str, Quantity, str]]:
    """All (relative path, quantity, source) below a node; the nearest `source` above a number applies."""
    match node:
        case Quantity():
            yield "", node, ""
        case tuple() | dict():
            items = node.items() if isinstance(node, dict) else ((f"[{i}]", item) for i, item in enumerate(node))
            for key, item in items:
                for path, quantity, source in _leaves(item):
                    yield join(key, path), quantity, source
        case Part():
            own = getattr(node, "source", {})
            for key, _, item in node.entries():
                for below, quantity, source in _leaves(item):
                    path = join(key, below)
                    yield path, quantity, source or _source_of(own, path)


def _source_of(source: str | dict[str, str], path: str) -> str:
    """The entry of a table's `source` for one of its numbers: the longest key that covers it, else the default."""
    if isinstance(source, str):
        return source
    covering = [key for key in source if covers(key, path)]
    return source[max(covering, key=len)] if covering else source.get("default", "")


def covers(key: str, path: str) -> bool:
    """Whether a path is `key` or lies below it: "com" covers "com[1]", not "com_x"."""
    return path == key or path.startswith((f"{key}.", f"{key}["))


def _replaced(node: object, path: str, leaf: Callable[[str, Quantity], object]) -> Any:
    match node:
        case Quantity():
            return leaf(path, node)
        case tuple():
            return tuple(_replaced(item, f"{path}[{index}]", leaf) for index, item in enumerate(node))
        case dict():
            return {key: _replaced(item, join(path, key), leaf) for key, item in node.items()}
        case Part():
            new = {name: _replaced(item, join(path, key), leaf) for key, name, item in node.entries()}
            return node.model_copy(update=new)
    return node


def join(path: str, below: str) -> str:
    """The path of what lies below another path."""
    return f"{path}{below}" if below.startswith("[") or not below or not path else f"{path}.{below}"
