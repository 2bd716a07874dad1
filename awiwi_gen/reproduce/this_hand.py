"""The first part of the report page: the hand itself, moving and drawn, with its numbers, figures and costs."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from awiwi_gen.diff.figures import Figure, figures
from awiwi_gen.drawing import drawing
from awiwi_gen.hand import Hand
from awiwi_gen.ir.cost import operations_text
from awiwi_gen.web import Live, live_hand

if TYPE_CHECKING:
    from pathlib import Path

    from awiwi_gen.pipeline import Job

Row = tuple[str, ...]
OF_JOINTS = ("torque -", "torque +", "stiffness, least", "stiffness, most", "gravity", "travel")
OF_FINGERS = ("workspace x", "workspace y", "workspace z", "reach", "mass")
NONE = "-"


@dataclass(frozen=True)
class ThisHand:
    """A hand for the page: moving, or why it does not; its drawing as the address of an image; its numbers.

    ``fingers`` has the figures of each finger. ``numbers`` are those of the file: path, text, and source, which is "guess"
    where nobody has measured it. ``costs`` are operations of the kernels by family and finger.
    """

    live: Live | str = ""
    image: str = ""
    fingers: Mapping[str, Sequence[Figure]] = field(default_factory=dict)
    joints: Mapping[str, Sequence[str]] = field(default_factory=dict)
    numbers: Sequence[Row] = ()
    costs: tuple[Row, Sequence[Row]] = ((), ())

    @property
    def lacking(self) -> str:
        """Why the hand does not move; nothing where it does."""
        return self.live if isinstance(self.live, str) else ""

    @property
    def guesses(self) -> int:
        """How many numbers are guesses."""
        return sum(source == "guess" for *_, source in self.numbers)

    @property
    def capability(self) -> tuple[Row, list[Row]]:
        """Columns and rows of a table of all joints."""
        heads, rows = [], []
        for finger, joints in self.joints.items():
            values = {each.name: _text(each) for each in self.fingers[finger]}
            heads += [(finger, joint) for joint in joints]
            rows += [[values.get(_of_joint(kind, joint), NONE) for kind in OF_JOINTS] for joint in joints]
        return _without_empty(("finger", "joint"), heads, OF_JOINTS, rows)

    @property
    def workspace(self) -> tuple[Row, list[Row]]:
        """Columns and rows of a table of the fingers."""
        values = [{each.name: _text(each) for each in found} for found in self.fingers.values()]
        rows = [[each.get(kind, NONE) for kind in OF_FINGERS] for each in values]
        return _without_empty(("finger",), [(name,) for name in self.fingers], OF_FINGERS, rows)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON: figures of the fingers, how many numbers are guesses, whether the hand moves on the page."""
        return {
            "fingers": {
                name: [{"figure": each.name, "value": f"{each.value:.4g}", "unit": each.unit} for each in found]
                for name, found in self.fingers.items()
            },
            "guesses": self.guesses,
            "moves": not isinstance(self.live, str),
        }


def this_hand(job: Job, directory: Path, manifest: Mapping[str, Any]) -> ThisHand:
    """The hand of a job, from what was generated of it; its derivations are in the cache."""
    picture = b64encode(drawing(job.hand).encode()).decode()
    return ThisHand(
        live_hand(job.hand, directory, manifest, job.store),
        f"data:image/svg+xml;base64,{picture}",
        {name: list(_shown(figures(job, name))) for name in job.hand.fingers},
        {name: finger.joints for name, finger in job.hand.fingers.items()},
        list(_numbers(job.hand)),
        _costs(job.hand, manifest),
    )


def _shown(found: Iterable[Figure]) -> Iterator[Figure]:
    """The figures of a finger but for the entries of its coupling, of which there are too many."""
    return (each for each in found if not each.name.startswith("P["))


def _text(figure: Figure) -> str:
    return f"{figure.value:.4g} {figure.unit}"


def _of_joint(kind: str, joint: str) -> str:
    """The name of a joint's figure: "torque +pip", "stiffness pip, least", "gravity pip"."""
    if kind.startswith("torque"):
        return f"{kind}{joint}"
    name, comma, side = kind.partition(",")
    return f"{name} {joint}{comma}{side}"


def _without_empty(
    head: Row, heads: Sequence[Row], columns: Sequence[str], rows: Sequence[Sequence[str]]
) -> tuple[Row, list[Row]]:
    """A table without the columns that have no value; each row begins with what names it."""
    kept = [place for place, _ in enumerate(columns) if any(row[place] != NONE for row in rows)]
    shown = [(*names, *(row[place] for place in kept)) for names, row in zip(heads, rows, strict=True)]
    return (*head, *(columns[place] for place in kept)), shown


def _numbers(hand: Hand) -> Iterator[Row]:
    assumed, sources = hand.assumed(), hand.sources()
    for path, quantity in hand.quantities().items():
        yield path, str(quantity), "guess" if path in assumed else sources[path]


def _costs(hand: Hand, manifest: Mapping[str, Any]) -> tuple[Row, list[Row]]:
    """Operations of the fingers' kernels: a row for each family, a column for each finger."""
    rows: dict[str, dict[str, str]] = {}
    for entry in manifest["kernels"]:
        finger = entry["part"].removeprefix("fingers.")
        if finger in hand.fingers and entry["name"].startswith(f"{finger}_"):
            family = entry["name"].removeprefix(f"{finger}_")
            rows.setdefault(family, {})[finger] = operations_text(entry)
    columns = ("kernel", *hand.fingers)
    return columns, [(family, *(row.get(name, NONE) for name in hand.fingers)) for family, row in rows.items()]
