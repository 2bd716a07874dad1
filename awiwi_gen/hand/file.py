"""From a file on disk to validated parts: every fault gets its line, its key path and a way to mend it.

A good file costs one `tomllib` parse. Lines of keys come from a second parser, which is imported only to complain.
"""

from __future__ import annotations

import difflib
import json
import os
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand.parts import Keys, Measure

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails
    from tree_sitter import Node

__all__ = ["HandFile", "key_path"]

Model = TypeVar("Model", bound=BaseModel)
_MOST_BYTES = 1_000_000  # a hand file has about 15 kB; a disk image must not be parsed to learn that it is none
_MOST_COLUMNS = 1000  # the time to parse a dotted key grows with its square


def key_path(keys: Keys) -> str:
    """Spell a path as a message does: `fingers.index.links[1].mass`. Keys that need quotes get them, in plain ASCII."""
    text = ""
    for key in keys:
        if isinstance(key, int):
            text += f"[{key}]"
        else:
            plain = re.fullmatch(r"[A-Za-z0-9_-]{1,60}", key)
            text += ("." if text else "") + (key if plain else json.dumps(key if len(key) <= 60 else key[:60] + "..."))
    return text


@dataclass(frozen=True)
class HandFile:
    """The text of a hand file, parsed but not yet believed."""

    name: str
    text: str
    data: dict[str, Any]

    @classmethod
    def read(cls, path: str | os.PathLike[str], name: str | None = None) -> HandFile:
        """Read and parse a file; `name` is what messages call it. Raises `InputError` if it is no TOML text file."""
        name = name or os.fspath(path)
        try:
            with Path(path).open("rb") as stream:
                raw = stream.read(_MOST_BYTES + 1)
        except (OSError, ValueError) as error:  # ValueError: a null character in the path
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
            raise InputError(Fault(file=name, message=f"cannot be read: {reason[:1].lower()}{reason[1:]}")) from None
        if len(raw) > _MOST_BYTES:
            raise InputError(Fault(file=name, message=f"is longer than {_MOST_BYTES} bytes; that is no hand file"))
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = raw.count(b"\n", 0, error.start) + 1
            message = f"is not UTF-8 text: byte {raw[error.start]:#04x} at offset {error.start}"
            raise InputError(Fault(file=name, line=line, message=message)) from None
        return cls.parse(text, name)

    @classmethod
    def parse(cls, text: str, name: str) -> HandFile:
        """Parse TOML text. Raises `InputError` with line and column."""
        for line, content in enumerate(text.split("\n"), start=1):
            if len(content) > _MOST_COLUMNS:
                raise InputError(Fault(file=name, line=line, message=f"is longer than {_MOST_COLUMNS} characters"))
        try:
            return cls(name, text, tomllib.loads(text))
        except RecursionError:
            fault = Fault(file=name, message="nests its brackets too deeply")
        except ValueError as error:  # a TOMLDecodeError, or an integer of more digits than Python reads
            found = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", str(error))
            at_end = found is not None and found[1] is None
            place = text.count("\n") + 1 if at_end else int(found[1]) if found else None
            column = " at its end" if at_end else f" in column {found[2]}" if found else ""
            reason = str(error)[: found.start() if found else 200]
            fault = Fault(file=name, line=place, message=f"is not TOML{column}: {reason[:1].lower()}{reason[1:]}")
        raise InputError(fault)

    def validated(self, schema: type[Model]) -> Model:
        """Hold the data against a schema. Raises `InputError` with all faults."""
        try:
            return schema.model_validate(self.data)
        except ValidationError as error:
            raise self.error(_complaints(schema, error.errors(include_url=False))) from None

    def error(self, complaints: Iterable[tuple[Keys, str]]) -> InputError:
        """The exception that lists (keys, message) pairs, top of the file first."""
        return InputError(sorted((self.fault(*each) for each in complaints), key=lambda fault: fault.line or 0))

    @cached_property
    def _lines(self) -> dict[Keys, int]:
        return _lines_of_keys(self.text)

    def fault(self, keys: Keys, message: str) -> Fault:
        """A fault at a key, or at the table that should have had it."""
        line = next((self._lines[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in self._lines), None)
        return Fault(file=self.name, line=line, key=key_path(keys), message=message)


# ---------------------------------------------------------------------------------------------------- messages


def _complaints(schema: type[BaseModel], errors: list[ErrorDetails]) -> Iterator[tuple[Keys, str]]:
    """Say each error of pydantic in this file's words. A misspelt key is one fault: not unknown and missing."""
    absent = {error["loc"] for error in errors if error["type"] == "missing"}
    for error in errors:
        if error["type"] != "extra_forbidden":
            continue
        *table, key = error["loc"]
        fields = _fields_of(_at(schema, tuple(table))[0])
        near = difflib.get_close_matches(str(key), fields, n=1)
        absent -= {(*table, name) for name in near}
        hint = f'; did you mean "{near[0]}"?' if near else f"; known here: {', '.join(fields)}"
        yield error["loc"], f"is not a known key{hint}"
    for error in errors:
        keys = error["loc"]
        if error["type"] == "missing" and keys in absent:
            yield keys, f"is missing; expected {_expected(schema, keys)}"
        elif error["type"] not in ("missing", "extra_forbidden"):
            is_name = keys[-1:] == ("[key]",)  # pydantic's word for: the key itself, not its value, is wrong
            keys = keys[:-1] if is_name else keys
            shown = "" if is_name else _shown(error["input"])
            yield keys, shown + _predicate(error, _expected(schema, keys))


def _predicate(error: ErrorDetails, expected: str) -> str:
    context = error.get("ctx", {})
    match error["type"]:
        case "value_error":
            return str(context["error"])
        case "literal_error":
            near = difflib.get_close_matches(str(error["input"]), re.findall(r"'([^']+)'", context["expected"]), n=1)
            return f"is not one of {context['expected']}" + (f'; did you mean "{near[0]}"?' if near else "")
        case "too_short":
            return f"has {len(error['input'])} entries; expected at least {context['min_length']}"
        case "too_long":
            return f"has {len(error['input'])} entries; expected at most {context['max_length']}"
        case "string_type":
            return f"is not text; expected {expected}"
        case "tuple_type":
            return f"is not an array; expected {expected}"
        case "int_type":
            return f"is not a whole number; expected {expected}"
        case "greater_than_equal":
            return f"is below the least, {context['ge']}"
        case "less_than_equal":
            return f"is above the most, {context['le']}"
        case "model_type" | "dict_type":
            return f"is not a table; expected {expected}"
    return error["msg"]


def _shown(value: object) -> str:
    """`= "6.2 N" ` as the file has it, cut short and without control characters; nothing for tables and arrays."""
    if isinstance(value, str):
        text = value if len(value) <= 60 else value[:60] + "..."
        return "= " + (f'"{text}"' if text.isprintable() and not set('"\\') & set(text) else json.dumps(text)) + " "
    if isinstance(value, bool):
        return f"= {str(value).lower()} "
    return f"= {str(value)[:60]} " if not isinstance(value, dict | list) else ""


def _at(schema: type[BaseModel], keys: Keys) -> tuple[Any, list[Any]]:
    """What the schema wants at a path: a type, and the notes (`Measure`, `FieldInfo`) that were annotated to it."""
    wanted: Any = schema
    notes: list[Any] = []
    for key in keys:
        if field := _fields_of(wanted).get(str(key)):
            wanted, notes = field.annotation, [*field.metadata, field]
        elif get_origin(wanted) in (tuple, dict):
            wanted, notes = get_args(wanted)[0 if get_origin(wanted) is tuple else 1], []
        else:
            return None, []
        if get_origin(wanted) is UnionType and get_args(wanted)[1] is NoneType:
            wanted = get_args(wanted)[0]
        if get_origin(wanted) is Annotated:
            wanted, *more = get_args(wanted)
            notes += more
    return wanted, notes


def _fields_of(wanted: Any) -> dict[str, FieldInfo]:
    """The keys that a table may have; none where no table is wanted."""
    is_table = isinstance(wanted, type) and issubclass(wanted, BaseModel)
    return {field.alias or name: field for name, field in wanted.model_fields.items()} if is_table else {}


def _expected(schema: type[BaseModel], keys: Keys) -> str:
    """What belongs at a path, with an example."""
    wanted, notes = _at(schema, keys)
    for note in notes:
        if isinstance(note, Measure):
            return note.expected
        if getattr(note, "examples", None):
            return f"something such as {note.examples[0]}"
    return f"a table [{key_path(keys)}]" if _fields_of(wanted) else "text"


# ---------------------------------------------------------------------------------------------------- lines


def _lines_of_keys(text: str) -> dict[Keys, int]:
    """The line, from 1, of each key, table and array element of a valid TOML text."""
    import tree_sitter_toml
    from tree_sitter import Language, Parser

    lines: dict[Keys, int] = {}
    elements: dict[Keys, int] = {}  # how many [[tables]] of this name there were so far

    def mark(keys: Keys, node: Node) -> None:
        for end in range(
            1, min(len(keys), 12) + 1
        ):  # the schema is 8 deep; a key of 1000 dots must not cost its square
            lines.setdefault(keys[:end], node.start_point.row + 1)

    def value(keys: Keys, node: Node) -> None:
        inside = [child for child in node.named_children if child.type != "comment"]
        if node.type == "array":
            for index, child in enumerate(inside):
                mark((*keys, index), child)
                value((*keys, index), child)
        elif node.type == "inline_table":
            pairs(keys, inside)

    def pairs(table: Keys, nodes: Iterable[Node]) -> None:
        for node in nodes:
            if node.type == "pair":
                name, content = node.named_children[:2]
                keys = (*table, *_parts(name))
                mark(keys, node)
                value(keys, content)

    root = Parser(Language(tree_sitter_toml.language())).parse(text.encode()).root_node
    pairs((), root.named_children)
    for node in root.named_children:
        if node.type not in ("table", "table_array_element"):
            continue
        header, *body = (child for child in node.named_children if child.type != "comment")
        keys: Keys = ()
        *outer, last = _parts(header)
        for part in outer:  # a header names the newest element of the arrays on its way
            keys = (*keys, part)
            keys = (*keys, elements[keys] - 1) if keys in elements else keys
        keys = (*keys, last)
        if node.type == "table_array_element":
            elements[keys] = elements.get(keys, 0) + 1
            keys = (*keys, elements[keys] - 1)
        mark(keys, node)
        pairs(keys, body)
    return lines


def _parts(key: Node) -> list[str]:
    """The parts of a dotted key; TOML's own parser knows best how quotes and escapes read."""
    table = tomllib.loads((key.text or b"").decode() + " = 0")
    parts = []
    while isinstance(table, dict):
        ((part, table),) = table.items()
        parts.append(part)
    return parts
