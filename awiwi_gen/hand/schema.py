"""The hand file's JSON Schema, for editors: what its readers declare, so that no key or range is listed twice.

Keys, names and kinds of values are checked; units and ranges are described, for only a reader can check them.
"""

from __future__ import annotations

import re
import tomllib
from functools import partial
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from awiwi_gen.hand import Hand
from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.names import _identifier, _one_line, _over, _source

DIALECT = "https://json-schema.org/draft/2020-12/schema"
QUANTITY = r"^\s*[+-]?\.?[0-9]"
NAME = {True: "^[a-z](_?[a-z0-9])*$", False: "^[a-z][a-z0-9]*$"}  # with single underscores, or without
OVER = "^[+-][a-z][a-z0-9_]*$"
MARK = "a source"  # stands for its definition, which refers to itself
LINE: dict[str, Any] = {"minLength": 1, "maxLength": 80}
SOURCE = {
    "description": 'Where numbers come from, such as "table 5.1"; "assumed" marks a guess. One text, or one for each key.',
    "anyOf": [
        {"type": "string", **LINE},
        {"type": "object", "minProperties": 1, "additionalProperties": {"$ref": "#/$defs/Source"}},
    ],
}
GAINS_FILE = {"type": "string", "description": "A file of gains, in or below the folder of the hand file."}


def json_schema() -> dict[str, Any]:
    """The schema of a hand file, ready for JSON."""
    schema = _for_toml(Hand.model_json_schema(by_alias=True, schema_generator=_Generator))
    schema["$defs"]["Source"] = SOURCE
    schema["properties"]["gains"] = {"anyOf": [schema["properties"]["gains"], GAINS_FILE]}
    return {"$schema": DIALECT, **schema, "title": "Hand file of awiwi_gen"}


class _Generator(GenerateJsonSchema):
    """Knows what the readers of numbers, names and sources accept."""

    def function_plain_schema(self, schema: core_schema.PlainValidatorFunctionSchema) -> JsonSchemaValue:
        read = schema["function"]["function"]
        if read is _source:
            return {"$comment": MARK}
        measure = getattr(read, "__self__", None)
        if not isinstance(measure, Measure):
            return super().function_plain_schema(schema)
        kinds = {
            each.example: f"{each.expected}, from {each.low} to {each.high}" for each in (measure, *measure.others)
        }
        told = {"description": _sentence("; or ".join(kinds.values())), "examples": list(kinds)}
        return {"type": "string", "pattern": QUANTITY, **told}

    def function_after_schema(self, schema: core_schema.AfterValidatorFunctionSchema) -> JsonSchemaValue:
        found = super().function_after_schema(schema)
        read: Any = schema["function"]["function"]
        if isinstance(read, partial) and read.func is _identifier:
            given: dict[str, Any] = {"underscores": True, "taken": (), **read.keywords}
            found |= {"pattern": NAME[given["underscores"]], "maxLength": given["longest"]}
            found |= {"not": {"enum": sorted(given["taken"])}} if given["taken"] else {}
        by_reader: dict[Any, dict[str, Any]] = {_one_line: LINE, _over: {"pattern": OVER}}
        return found | by_reader.get(read, {})


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _for_toml(node: Any) -> Any:
    """Without null, which TOML does not have, without titles, and with examples as values instead of TOML."""
    if isinstance(node, list):
        return [_for_toml(each) for each in node]
    if not isinstance(node, dict):
        return node
    if node.get("$comment") == MARK:
        return {"$ref": "#/$defs/Source"}
    found = {key: _for_toml(value) for key, value in node.items() if not _is_title(key, value)}
    if "anyOf" in found:
        others = [each for each in found.pop("anyOf") if each != {"type": "null"}]
        found = {**others[0], **found} if len(others) == 1 else {"anyOf": others, **found}
    if found.get("default", 0) is None:
        del found["default"]
    if "patternProperties" in found:
        found["additionalProperties"] = False
    if examples := [value for each in found.pop("examples", ()) for value in _value(each, found)]:
        found["examples"] = examples
    if isinstance(node.get("description"), str):
        found["description"] = re.sub(r"\s*\n\s*", " ", node["description"])
    return found


def _is_title(key: str, value: Any) -> bool:
    return key == "title" and isinstance(value, str)


def _value(example: Any, schema: dict[str, Any]) -> list[Any]:
    """An example as a value: itself if it is a quantity, or what it means in TOML; none where it is a line of a table."""
    if not isinstance(example, str) or schema.get("pattern") == QUANTITY:
        return [example]
    try:
        return [tomllib.loads(f"value = {example}")["value"]]
    except ValueError:
        return []
