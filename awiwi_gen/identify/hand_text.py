"""Measured numbers in the text of a hand file; comments, order and all other text stay."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from awiwi_gen.editing import changed
from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.lines import values_of_keys
from awiwi_gen.identify.bench import Finding, Number

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand

Change = tuple[str, str, str]  # key, the value before or nothing, the value now


def with_numbers(
    file: HandFile, hand: Hand, findings: Sequence[Finding], tendon: int | None, source: str
) -> tuple[str, list[Change]]:
    """The text with all numbers, of one tendon in its table of [[spring.units]], and what has changed.

    Raises InputError where the text cannot be edited.
    """
    section = findings[0].section
    numbers = [number for finding in findings for number in finding.numbers]
    if section == "spring" and tendon is not None:
        text, changes = _in_unit(file, hand, numbers, tendon, source)
    else:
        text, changes = file.text, []
        for number in numbers:
            text, change = _replaced(
                HandFile.parse(text, file.name), f"{section}.{number.key}", json.dumps(number.text)
            )
            changes.append(change)
        old = getattr(hand, section).source
        parts = dict.fromkeys((number.key.partition(".")[0].partition("[")[0] for number in numbers), source)
        cited = ({"default": old} if isinstance(old, str) else dict(old)) | parts
        text, _ = _replaced(HandFile.parse(text, file.name), f"{section}.source", _inline(cited))
    return text, changes


def _replaced(file: HandFile, key: str, value: str) -> tuple[str, Change]:
    text, _, old, new = changed(file, key, value)
    return text, (key, old, new)


def _in_unit(
    file: HandFile, hand: Hand, numbers: Sequence[Number], tendon: int, source: str
) -> tuple[str, list[Change]]:
    """The numbers in the table of a tendon, which is added where there is none."""
    units = [] if hand.spring is None else [unit.tendon for unit in hand.spring.units]
    values: dict[str, Any] = {}
    for number in numbers:
        key, _, end = number.key.partition(".")
        values[key] = values.get(key, {}) | {end: number.text} if end else number.text
    written = {key: _inline(each) if isinstance(each, dict) else json.dumps(each) for key, each in values.items()}
    if tendon not in units:
        lines = ["", "[[spring.units]]", f"tendon = {tendon}", *(f"{key} = {value}" for key, value in written.items())]
        text = _after(file, "spring", [*lines, f"source = {json.dumps(source)}"])
        changes = [(f"spring.units[{len(units)}].{key}", "", value) for key, value in written.items()]
        return _required(text, file, "spring", {"tendon": tendon, **values, "source": source}, len(units)), changes
    index, text, changes = units.index(tendon), file.text, []
    for key, value in {**written, "source": json.dumps(source)}.items():
        path = f"spring.units[{index}].{key}"
        now = HandFile.parse(text, file.name)
        if ("spring", "units", index, key) in values_of_keys(text):
            text, change = _replaced(now, path, value)
        else:
            lines, row = text.split("\n"), now.line(("spring", "units", index, "source")) or 1
            text, change = "\n".join([*lines[: row - 1], f"{key} = {value}", *lines[row - 1 :]]), (path, "", value)
        changes += [change] * (key != "source")
    return _required(
        text, file, "spring", {**file.data["spring"]["units"][index], **values, "source": source}, index
    ), changes


def _after(file: HandFile, table: str, lines: Sequence[str]) -> str:
    """The text with lines behind the last value of a table."""
    raw = file.text.encode()
    end = max(place.stop for keys, place in values_of_keys(file.text).items() if keys[0] == table)
    stop = raw.find(b"\n", end)
    stop = len(raw) if stop < 0 else stop
    return (raw[:stop] + b"\n" + "\n".join(lines).encode() + raw[stop:]).decode()


def _required(text: str, file: HandFile, table: str, unit: dict[str, Any], index: int) -> str:
    """The text, if it says what it should and nothing else."""
    wanted = {**file.data, table: {**file.data[table]}}
    units = list(wanted[table].get("units", []))
    wanted[table]["units"] = [*units[:index], unit, *units[index + 1 :]]
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        found = {}
    if found != wanted:
        message = "cannot be edited; expected tables [[spring.units]] with a key on each line"
        raise InputError(Fault(file=file.name, line=file.line((table,)), key=f"{table}.units", message=message))
    return text


def _inline(table: dict[str, str]) -> str:
    return f"{{ {', '.join(f'{key} = {json.dumps(value, ensure_ascii=False)}' for key, value in table.items())} }}"
