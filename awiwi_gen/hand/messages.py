"""The errors of the schema library in the words of a hand file: what was found, what is expected, and a fix."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Callable, Sequence
from functools import partial
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from awiwi_gen.errors import MOST_FAULTS
from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.parts import Keys

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

__all__ = ["key_path", "schema_faults"]


def key_path(keys: Keys) -> str:
    """A path as messages write it: `fingers.index.links[1].mass`. Keys that need quotes get them, in plain ASCII."""
    text = ""
    for key in keys:
        if isinstance(key, int):
            text += f"[{key}]"
        else:
            plain = re.fullmatch(r"[A-Za-z0-9_-]{1,60}", key)
            text += ("." if text else "") + (key if plain else json.dumps(key if len(key) <= 60 else key[:60] + "..."))
    return text


def schema_faults(schema: type[BaseModel], errors: list[ErrorDetails]) -> list[tuple[Keys, Callable[[], str]]]:
    """The key path of each error, and a function that words its message: only those that are shown are worded.

    A misspelt key is one fault: not one unknown and one missing key.
    """
    absent = {error["loc"] for error in errors if error["type"] == "missing"}
    unknown = [error["loc"] for error in errors if error["type"] == "extra_forbidden"]
    for *table, key in unknown[:MOST_FAULTS]:
        absent -= {(*table, name) for name in _similar(schema, table, key)[0]}
    found: list[tuple[Keys, Callable[[], str]]] = [(keys, partial(_unknown, schema, keys)) for keys in unknown]
    for error in errors:
        keys = error["loc"]
        if error["type"] == "missing" and keys in absent:
            found.append((keys, partial(_missing, schema, keys)))
        elif error["type"] not in ("missing", "extra_forbidden") and not _of_its_entries(error):
            is_name = keys[-1:] == ("[key]",)  # pydantic's mark: the key itself is wrong, not its value
            found.append((keys[:-1] if is_name else keys, partial(_wrong, schema, error, is_name)))
    return found


def _similar(schema: type[BaseModel], table: Sequence[str | int], key: str | int) -> tuple[list[str], list[str]]:
    """The known keys of a table that look like `key`, and all known keys."""
    fields = [*_fields_of(_at(schema, tuple(table))[0])]
    return difflib.get_close_matches(str(key)[:80], fields, n=1), fields


def _unknown(schema: type[BaseModel], keys: Keys) -> str:
    near, fields = _similar(schema, keys[:-1], keys[-1])
    return "is not a known key" + (f'; did you mean "{near[0]}"?' if near else f"; known here: {', '.join(fields)}")


def _missing(schema: type[BaseModel], keys: Keys) -> str:
    return f"is missing; expected {_expected(schema, keys)}"


def _wrong(schema: type[BaseModel], error: ErrorDetails, is_name: bool) -> str:
    keys = error["loc"][:-1] if is_name else error["loc"]
    return ("" if is_name else _shown(error["input"])) + _predicate(error, _expected(schema, keys))


def _of_its_entries(error: ErrorDetails) -> bool:
    """Whether an array is too short only because its entries have faults of their own."""
    return error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]


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
            return f"is too small; expected at least {context['ge']}"
        case "less_than_equal":
            return f"is too large; expected at most {context['le']}"
        case "model_type" | "dict_type":
            return f"is not a table; expected {expected}"
    return error["msg"]


def _shown(value: object) -> str:
    """`= "6.2 N" ` as in the file, shortened and without control characters; nothing for tables and arrays."""
    if isinstance(value, str):
        text = value if len(value) <= 60 else value[:60] + "..."
        return "= " + (f'"{text}"' if text.isprintable() and not set('"\\') & set(text) else json.dumps(text)) + " "
    if isinstance(value, bool):
        return f"= {str(value).lower()} "
    return f"= {str(value)[:60]} " if not isinstance(value, dict | list) else ""


def _at(schema: type[BaseModel], keys: Keys) -> tuple[Any, list[Any]]:
    """The type that the schema has at a path, and its annotations (`Measure`, `FieldInfo`)."""
    wanted: Any = schema
    notes: list[Any] = []
    for key in keys:
        if field := _fields_of(wanted).get(str(key)):
            wanted, notes = field.annotation, [*field.metadata, field]
        elif get_origin(wanted) in (tuple, dict):
            wanted, notes = get_args(wanted)[0 if get_origin(wanted) is tuple else 1], []
        else:
            return None, []
        if get_origin(wanted) in (Union, UnionType) and get_args(wanted)[1] is NoneType:
            wanted = get_args(wanted)[0]
        if get_origin(wanted) is Annotated:
            wanted, *more = get_args(wanted)
            notes += more
    return wanted, notes


def _fields_of(wanted: Any) -> dict[str, FieldInfo]:
    """The keys that a table may have; none for a type that is no table."""
    is_table = isinstance(wanted, type) and issubclass(wanted, BaseModel)
    return {field.alias or name: field for name, field in wanted.model_fields.items()} if is_table else {}


def _expected(schema: type[BaseModel], keys: Keys) -> str:
    """What is expected at a path, with an example."""
    wanted, notes = _at(schema, keys)
    for note in notes:
        if isinstance(note, Measure):
            return note.expected
        if getattr(note, "examples", None):
            return f"something such as {note.examples[0]}"
    return f"a table [{key_path(keys)}]" if _fields_of(wanted) else "text"
