"""Masses, centres and inertia tensors from a table in CSV, written into a hand file whose text otherwise stays.

A row has a `link`, written finger.joint, and any of `mass`, `com_x com_y com_z` and `xx yy zz xy xz yz`. A number has its
unit, or the head of its column has it: `mass [g]`. `frame` says what the numbers refer to:

    link     the link's axes, the tensor about the centre of mass (if the column is left out)
    origin   the link's axes, the tensor about the link's origin
    base     the finger's base frame with all joints at zero, the tensor about the centre of mass
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from awiwi_gen.errors import Fault, InputError, unknown
from awiwi_gen.hand import Hand
from awiwi_gen.hand.file import HandFile
from awiwi_gen.interchange.export import Part, parts, value, vector
from awiwi_gen.interchange.model import Array
from awiwi_gen.interchange.toml import cite, mass_and_inertia
from awiwi_gen.reading import read_table
from awiwi_gen.units import parse_quantity

_COM, _INERTIA = ("com_x", "com_y", "com_z"), ("xx", "yy", "zz", "xy", "xz", "yz")
_UNITS = {"mass": "kg", **dict.fromkeys(_COM, "m"), **dict.fromkeys(_INERTIA, "kg m^2")}
_FRAMES = ("link", "origin", "base")
_STRING = r'"[^"\n]*"'


@dataclass(frozen=True)
class Row:
    """A row of the table: its line in the file, the link that it names, its numbers in SI, and their frame."""

    line: int
    finger: str
    joint: str
    numbers: dict[str, float]
    frame: str


def updated(hand_path: Path, table: Path) -> tuple[str, list[str]]:
    """The hand file's text with the table's numbers, and a sentence for each link that changes.

    Raises `InputError` for a bad table, for links that the hand does not have, and where the text cannot be edited.
    """
    file, hand = HandFile.read(hand_path), Hand.load(hand_path)
    text, changes = file.text, []
    for row in _rows(table):
        if row.finger not in hand.fingers:
            raise _row_fault(table, row, str(unknown("finger", row.finger, hand.fingers, "see the hand file")))
        finger = hand.fingers[row.finger]
        joints = [link.joint for link in finger.links]
        if row.joint not in joints:
            raise _row_fault(table, row, str(unknown("joint", row.joint, joints, "see the hand file")))
        index = joints.index(row.joint)
        new = _properties(table, row, parts(finger), index)
        edited = _edited(text, (row.finger, index), new, cite(f"{table.name} line {row.line}"))
        if edited != text:
            changes.append(f"{row.finger}.{row.joint}: {', '.join(new)}")
        text = edited
    return text, changes


# -- the table -------------------------------------------------------------------------------------------------------


def _rows(table: Path) -> list[Row]:
    columns, rows = read_table(table)
    names = [name for name, _ in columns]
    for name in names:
        if name not in ("link", "frame", *_UNITS):
            raise InputError(
                Fault(file=str(table), line=1, message=str(unknown("column", name, ["link", "frame", *_UNITS])))
            )
    if "link" not in names:
        raise InputError(
            Fault(file=str(table), line=1, message='has no column "link"; expected rows such as index.pip')
        )
    return [_row(table, line, dict(zip(names, cells, strict=False)), dict(columns)) for line, cells in rows]


def _row(table: Path, line: int, cells: dict[str, str], units: Mapping[str, str]) -> Row:
    finger, _, joint = cells.pop("link").strip().partition(".")
    frame = cells.pop("frame", "").strip() or "link"
    numbers = {}
    for name, cell in cells.items():
        if cell.strip():
            numbers[name] = _number(table, line, name, f"{cell.strip()} {units[name]}".strip())
    row = Row(line, finger, joint, numbers, frame)
    if frame not in _FRAMES:
        raise _row_fault(table, row, f'frame = "{frame}" is none of {", ".join(_FRAMES)}')
    for group in (_COM, _INERTIA):
        given = [name for name in group if name in numbers]
        if given and len(given) < len(group):
            absent = ", ".join(name for name in group if name not in numbers)
            raise _row_fault(table, row, f"has {', '.join(given)} but not {absent}; expected all of them")
    return row


def _number(table: Path, line: int, name: str, text: str) -> float:
    try:
        found = parse_quantity(text)
        expected = parse_quantity(f"1 {_UNITS[name]}").unit
        if found.unit != expected:
            raise InputError(Fault(key=f'"{text}"', message=f"has another unit; expected one such as {_UNITS[name]}"))
    except InputError as error:
        fault = error.faults[0]
        raise InputError(
            Fault(file=str(table), line=line, key=f"{name} = {fault.key}", message=fault.message)
        ) from None
    return float(found)


def _row_fault(table: Path, row: Row, message: str) -> InputError:
    return InputError(Fault(file=str(table), line=row.line, key=f"{row.finger}.{row.joint}", message=message))


def _properties(table: Path, row: Row, links: list[Part], index: int) -> dict[str, str]:
    """The hand file's values of those of mass, com and inertia that the row changes, as TOML."""
    link, numbers = links[index].link, row.numbers
    mass = numbers.get("mass", value(link.mass))
    com = np.array([numbers[name] for name in _COM]) if _COM[0] in numbers else vector(link.com or (0, 0, 0))
    x, y, z, xy, xz, yz = (numbers.get(name, 0.0) for name in _INERTIA)
    tensor = np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])
    if row.frame == "base":
        axes, origin = _pose_at_zero(links, index)
        com = axes.T @ (com - origin) if _COM[0] in numbers else com
        tensor = axes.T @ tensor @ axes
    if row.frame == "origin" and _INERTIA[0] in numbers:
        if not mass:
            raise _row_fault(table, row, "has a tensor about the origin, but no mass; expected a mass")
        tensor = tensor - mass * (com @ com * np.eye(3) - np.outer(com, com))
    texts = mass_and_inertia(mass, com, tensor)
    changed = {"mass": "mass", "com": _COM[0], "inertia": _INERTIA[0]}
    return {key: texts[key] for key, column in changed.items() if column in numbers}


def _pose_at_zero(links: list[Part], index: int) -> tuple[Array, Array]:
    axes, origin = np.eye(3), np.zeros(3)
    for part in links[: index + 1]:
        own_axes, own_origin = part.at_zero
        axes, origin = axes @ own_axes, origin + axes @ own_origin
    return axes, origin


# -- the hand file's text --------------------------------------------------------------------------------------------


def _edited(text: str, place: tuple[str, int], new: Mapping[str, str], source: str) -> str:
    """The text with new values of a link's keys. Raises `InputError` where they do not stand on one line each."""
    finger, index = place
    file = HandFile.parse(text, "hand")
    lines, wanted = text.split("\n"), tomllib.loads(text)
    link = wanted["fingers"][finger]["links"][index]
    old = link["source"]
    entries = (dict(old) if isinstance(old, dict) else {"default": old}) | dict.fromkeys(new, source)
    values = {**new, "source": _inline(entries)}
    inserted: list[str] = []
    for key, written in values.items():
        link[key] = tomllib.loads(f"{key} = {written}")[key]
        row = file.line(("fingers", finger, "links", index, key))
        found = re.match(rf"\s*{key}\s*=\s*", lines[row - 1]) if row else None
        if found and row:
            comment = re.search(rf"^(?:[^\"#]|{_STRING})*?(\s*#.*)$", lines[row - 1])
            lines[row - 1] = f"{found[0]}{written}{comment[1] if comment else ''}"
        else:
            inserted.append(f"{key} = {written}")
    row = file.line(("fingers", finger, "links", index, "source")) or 1
    lines[row - 1 : row - 1] = inserted
    edited = "\n".join(lines)
    try:
        as_wanted = tomllib.loads(edited) == wanted
    except tomllib.TOMLDecodeError:
        as_wanted = False
    if not as_wanted:
        keys = f"fingers.{finger}.links[{index}]"
        message = "cannot be edited; expected mass, com, inertia and source on one line each, in a [[...links]] table"
        raise InputError(Fault(file=file.name, key=keys, message=message))
    return edited


def _inline(table: Mapping[str, Any]) -> str:
    """A table of texts, or of tables of texts, as TOML on one line."""
    rows = [f"{key} = {_inline(each) if isinstance(each, dict) else _quoted(each)}" for key, each in table.items()]
    return f"{{ {', '.join(rows)} }}"


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
