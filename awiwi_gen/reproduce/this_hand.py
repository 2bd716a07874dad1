"""The first part of the report page: the hand itself, in a drawing, in figures of each finger, and in its numbers."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from awiwi_gen.diff.figures import figures
from awiwi_gen.drawing import drawing
from awiwi_gen.hand import Hand

if TYPE_CHECKING:
    from awiwi_gen.pipeline import Job

Row = tuple[str, ...]
COLUMNS = ("figure", "value", "unit")


@dataclass(frozen=True)
class ThisHand:
    """A hand for the page: its drawing as the address of an image, and tables.

    ``fingers`` has the figures of each finger (`COLUMNS`), ``numbers`` those of the file: path, text, and source, which is
    "guess" where nobody has measured it.
    """

    image: str = ""
    fingers: dict[str, list[Row]] = field(default_factory=dict)
    numbers: list[Row] = field(default_factory=list)

    @property
    def guesses(self) -> int:
        """How many numbers are guesses."""
        return sum(source == "guess" for *_, source in self.numbers)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON, without the drawing."""
        return {
            "fingers": {
                name: [dict(zip(COLUMNS, row, strict=True)) for row in rows] for name, rows in self.fingers.items()
            },
            "guesses": self.guesses,
        }


def this_hand(job: Job) -> ThisHand:
    """The hand of a job, whose derivations are in the cache."""
    picture = b64encode(drawing(job.hand).encode()).decode()
    shown = {name: list(_rows(job, name)) for name in job.hand.fingers}
    return ThisHand(f"data:image/svg+xml;base64,{picture}", shown, list(_numbers(job.hand)))


def _rows(job: Job, finger: str) -> Iterator[Row]:
    """The figures of a finger but for the entries of its coupling, of which there are too many."""
    for figure in figures(job, finger):
        if not figure.name.startswith("P["):
            yield figure.name, f"{figure.value:.4g}", figure.unit


def _numbers(hand: Hand) -> Iterator[Row]:
    assumed, sources = hand.assumed(), hand.sources()
    for path, quantity in hand.quantities().items():
        yield path, str(quantity), "guess" if path in assumed else sources[path]
