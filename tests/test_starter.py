"""The hand file that `awiwi-gen init` writes is sound as it is, and with all of its settings switched on."""

from __future__ import annotations

import json
import re

import pytest
from commands import complaint, told

from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.pipeline import Job, generate, verify
from awiwi_gen.resources import STARTER_HAND

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
