"""`awiwi-gen init` writes a sound hand file, and `set` changes one value of one and no other byte."""

from __future__ import annotations

import json
import re

import pytest
from commands import complaint, told
from tools import LONG

from awiwi_gen.editing import changed, written
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.lines import values_of_keys
from awiwi_gen.pipeline import Job, generate, verify
from awiwi_gen.resources import DEFAULT_HAND, STARTER_HAND

SWITCH = re.compile(r"^#(?=\S)", re.MULTILINE)


@pytest.fixture
def started(tmp_path):
    told("init", tmp_path / "new hand.toml")
    return tmp_path / "new hand.toml"


def test_the_file_has_neither_faults_nor_warnings(started):
    said = told("check", "--hand", started, "-o", started.parent / "c")

    assert said.splitlines()[0] == f"{started}: 1 finger, no faults"
    assert left_out_names(Hand.load(started)) == {}


def test_a_file_that_is_there_stays(started):
    started.write_text("mine", encoding="utf-8")

    assert complaint("init", started) == f"{started} is there already; choose another name, or remove it"
    assert started.read_text(encoding="utf-8") == "mine"


def test_what_to_do_next_can_be_pasted_into_a_shell(tmp_path):
    file = tmp_path / "a hand.toml"

    assert told("init", file).rstrip().endswith(f"awiwi-gen check --hand '{file}'")
    assert json.loads(told("init", "--json", tmp_path / "other.toml")) == {"file": str(tmp_path / "other.toml")}


def test_all_that_can_be_switched_on_is_right():
    text = STARTER_HAND.read_text(encoding="utf-8")
    hand = Hand.parse(SWITCH.sub("", text))

    assert len(SWITCH.findall(text)) > 15
    assert None not in (hand.motor, hand.tendon, hand.fingers["index"].base, hand.fingers["index"].links[0].friction)


def test_its_kernels_are_proved(tmp_path):
    job = Job(Hand.load(STARTER_HAND), only="index_mass_matrix, index_inverse_dynamics, index_tendon_distribution")
    generate(job, tmp_path / "c")

    assert verify(job, tmp_path / "c").passed


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("fingers.index.pulleys[0].radius", "6.3 mm", '{ joint = "mcp", radius = "6.3 mm", source = "assumed" },'),
        ("fingers.index.links[1].com", '["14 mm", "0 mm", "1 mm"]', 'com = ["14 mm", "0 mm", "1 mm"]'),
        ("fingers.index.links[0].com[2]", "-1 mm", 'com = ["22 mm", "0 mm", "-1 mm"]'),
        ("prefix", "his", 'prefix = "his"  # every symbol of the C begins with it'),
        ("name", 'The "µ" hand #2', 'name = "The \\"µ\\" hand #2"'),
    ],
)
def test_one_value_changes_and_all_other_text_stays(started, key, value, line):
    before = started.read_text(encoding="utf-8").splitlines()
    said = told("set", key, value, "--hand", started)
    after = started.read_text(encoding="utf-8").splitlines()

    (place,) = (index for index, both in enumerate(zip(before, after, strict=True)) if both[0] != both[1])
    assert after[place].strip() == line
    assert said.startswith(f"{started}:{place + 1} {key}: ")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("fingers.index.pulleys[0].radius", "6 N", 'radius = "6 N" is a force; expected a length such as'),
        ("fingers.index.pulley[0].radius", "6 mm", "no key 'fingers.index.pulley[0].radius'; did you mean"),
        ("fingers.index.links[0]", "6 mm", "fingers.index.links[0] is a table; name one of its keys"),
        ("limits.gravity", "9.81", "limits.gravity = 9.81 has no unit"),
        ("limits.gravity", '"9.81 m/s^2"\nname = "x"', "limits.gravity"),
        ("", "1", "no key ''"),
    ],
)
def test_what_cannot_be_set_leaves_the_file_as_it_is(started, key, value, message):
    before = started.read_bytes()

    assert message in complaint("set", key, value, "--hand", started)
    assert started.read_bytes() == before


@pytest.mark.parametrize(
    ("path", "every"), [(DEFAULT_HAND, 1 if LONG > 1 else 7), (STARTER_HAND, 1)], ids=["hand", "starter"]
)
def test_values_can_be_set_to_what_they_are(path, every):
    file = HandFile.read(path)
    raw, places = file.text.encode(), values_of_keys(file.text)

    assert len(places) > 50
    for keys, place in [*places.items()][::every]:
        if b"\n" not in raw[place] and b"{" not in raw[place]:
            assert changed(file, written(keys), raw[place].decode())[0] == file.text
