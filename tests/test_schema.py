"""The JSON Schema of hand files says what the reader does: the same keys, the same names, the same kinds of values."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import pytest
from actuators import AWIWI
from commands import told
from jsonschema import Draft202012Validator
from pydantic import BaseModel

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.schema import json_schema

ROOT = Path(__file__).resolve().parent.parent
SCHEMA = json_schema()
EDITOR = Draft202012Validator(SCHEMA)
HANDS = [ROOT / "awiwi_gen/hand.toml", ROOT / "awiwi_gen/starter.toml", *(ROOT / "tests").glob("*.toml")]
HANDS += [path for path in (ROOT / "examples").glob("*.toml") if not path.name.endswith(".gains.toml")]
ONE = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")


def models(annotation: Any) -> list[type[BaseModel]]:
    """The tables below an annotation, as the reader sees them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) in (Union, UnionType, tuple, dict):
        return [model for each in get_args(annotation) for model in models(each)]
    return [] if not hasattr(annotation, "__metadata__") else models(get_args(annotation)[0])


def read_keys(model: type[BaseModel], seen: dict[type, set[str]]) -> dict[type, set[str]]:
    """Keys that the reader accepts, of a table and all tables below it."""
    if model not in seen:
        seen[model] = {field.alias or name for name, field in model.model_fields.items()}
        for field in model.model_fields.values():
            for below in models(field.annotation):
                read_keys(below, seen)
    return seen


def accepted(text: str) -> bool:
    try:
        Hand.parse(text)
    except InputError:
        return False
    return True


def test_the_schema_is_one():
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", HANDS, ids=lambda path: path.name)
def test_every_hand_of_the_project_follows_the_schema(path):
    assert [error.message for error in EDITOR.iter_errors(tomllib.loads(path.read_text(encoding="utf-8")))] == []


def test_every_key_that_the_reader_accepts_is_in_the_schema_and_the_reverse():
    tables = [
        (name.rpartition("__")[2], each["properties"]) for name, each in SCHEMA["$defs"].items() if name != "Source"
    ]
    tables.append(("Hand", SCHEMA["properties"]))
    read = [(model.__name__, sorted(keys)) for model, keys in read_keys(Hand, {}).items()]

    assert sorted(read) == sorted((name, sorted(keys)) for name, keys in tables)
    assert all(each["additionalProperties"] is False for each in SCHEMA["$defs"].values() if "properties" in each)


def test_the_examples_follow_the_schema_themselves():
    def walk(node: Any) -> None:
        if isinstance(node, dict):
            here = Draft202012Validator({**node, "$defs": SCHEMA["$defs"]})
            for example in node.get("examples", ()) if "type" in node else ():
                here.validate(example)
        for each in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
            walk(each)

    walk({key: value for key, value in SCHEMA.items() if key != "examples"})


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('radius = "9 mm"', 'raduis = "9 mm"'),
        ('name = "One finger"', 'nmae = "One finger"'),
        ('radius = "9 mm"', "radius = 9"),
        ('radius = "9 mm"', 'radius = "mm 9"'),
        ('joint = "root"', 'joint = "Root"'),
        ('joint = "root"', 'joint = "a__b"'),
        ("[fingers.jaw", "[fingers.Jaw"),
        ("[fingers.jaw", "[fingers.wrist"),
        ("[fingers.jaw", "[fingers.j_w"),
        ('over = ["-mid"]', 'over = ["mid"]'),
        ('turn = "none"', 'turn = "x+91"'),
        ('prefix = "claw"\n', ""),
        ('source = "drawing 7"', "source = 7"),
        ('offset = ["30 mm", "0 mm", "0 mm"]', 'offset = ["30 mm", "0 mm"]'),
        ('prefix = "claw"', 'prefix = "9claw"'),
    ],
)
def test_what_the_reader_refuses_by_its_form_an_editor_underlines(old, new):
    spoilt = ONE.replace(old, new)
    assert spoilt != ONE

    assert not accepted(spoilt)
    assert not EDITOR.is_valid(tomllib.loads(spoilt))


def test_gains_may_be_a_file_or_tables():
    for gains in ("gains.toml", []):
        assert EDITOR.is_valid(tomllib.loads(ONE) | {"gains": gains})
    assert not EDITOR.is_valid(tomllib.loads(AWIWI) | {"gains": 3})


def test_sources_of_single_keys_may_be_tables_in_tables():
    text = ONE.replace(
        '{ offset = "drawing 7", default = "assumed" }', '{ inertia.xx = "drawing 7", default = "assumed" }'
    )

    assert accepted(text)
    assert EDITOR.is_valid(tomllib.loads(text))


def test_the_published_schema_is_that_of_the_reader(tmp_path):
    file = tmp_path / "hand.schema.json"
    said = told("schema", "-o", file)

    assert file.read_text(encoding="utf-8") == (ROOT / "docs/hand.schema.json").read_text(encoding="utf-8")
    assert "#:schema hand.schema.json" in said
    assert json.loads(told("schema")) == SCHEMA
