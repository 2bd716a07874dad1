"""What the command line says about a hand file: kernels, warnings, advice, and errors for people and for programs."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest
from commands import ONE_FINGER, answer, complaint, process, small, told

__all__ = ["small"]


def test_the_list_of_a_hand_file_needs_nothing_generated(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    entries = {entry["name"]: entry for entry in answer("list", "--hand", ONE_FINGER)}

    assert entries["jaw_joint_torque"]["inputs"][1]["shape"] == [3]
    assert entries["jaw_joint_torque"]["cost"] is None
    assert not any(name.startswith("index_") for name in entries)
    assert "index_mass_matrix" in told("list")


def test_the_list_needs_nothing_generated_and_tells_costs_where_they_are_known(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known, unknown = told("list"), told("list", "--hand", ONE_FINGER)

    assert re.search(r"^index_joint_torque\(q, f\) -> tau\n    \d+ operations; eq\. 5\.8$", known, re.MULTILINE)
    assert re.search(r"^jaw_joint_torque\(q, f\) -> tau\n    eq\. 5\.8$", unknown, re.MULTILINE)
    assert "operations" not in unknown


def test_the_list_of_a_hand_file_has_the_costs_of_what_was_generated_from_it(small, tmp_path):
    entries = {entry["name"]: entry for entry in answer("list", "--hand", ONE_FINGER, "-o", small)}
    other = tmp_path / "other.toml"
    other.write_text(Path(ONE_FINGER).read_text().replace('"9 mm"', '"9.5 mm"'))

    assert entries["jaw_joint_torque"]["cost"]["operations"] > 0
    assert entries["jaw_mass_matrix"]["cost"] is None  # a kernel of the hand that was not generated
    assert not any(entry["cost"] for entry in answer("list", "--hand", other, "-o", small))


def test_no_name_is_cut_on_a_narrow_terminal():
    reader, terminal = pty.openpty()
    command = [sys.executable, "-m", "awiwi_gen", "list", "--assumed", "--hand", ONE_FINGER]
    with os.fdopen(reader, "rb", buffering=0) as screen:
        done = subprocess.run(command, stdout=terminal, env={**os.environ, "COLUMNS": "20"}, check=False)
        os.close(terminal)
        shown = screen.read(4096).decode()

    assert done.returncode == 0
    assert "fingers.jaw.links[0].four_bar.reference" in shown


ONE_SIDED = Path(ONE_FINGER).read_text().replace('"-root"', '"+root"')


def test_kernels_that_the_tendons_make_impossible_are_named_with_the_reason(tmp_path):
    hand = tmp_path / "one sided.toml"
    hand.write_text(ONE_SIDED)
    reason = "tendons only pull, and none pulls towards +root"
    line = f"left out: jaw_tendon_distribution: {reason}"

    assert line in told("check", "--hand", hand, "-o", tmp_path / "out").splitlines()
    assert line in told("list", "--hand", hand).splitlines()
    assert {"name": "jaw_tendon_distribution", "reason": reason} in answer(
        "check", "--hand", hand, "-o", tmp_path / "out")["left_out"]  # fmt: skip
    last = answer("list", "--hand", hand)[-1]
    assert (last["name"], last["left_out"]) == ("jaw_tendon_distribution", reason)
    for command in ("explain jaw_tendon_distribution", "generate --only jaw_tendon_d*"):
        assert f"jaw_tendon_distribution is left out: {reason}" in complaint(*command.split(), "--hand", hand)


def test_warnings_are_printed_and_are_in_the_json(tmp_path):
    hand = tmp_path / "heavy.toml"
    hand.write_text(Path(ONE_FINGER).read_text().replace('mass = "5 g"', 'mass = "5 kg"'))
    lines = told("check", "--hand", hand, "-o", tmp_path / "out").splitlines()
    (warning,) = answer("check", "--hand", hand, "-o", tmp_path / "out")["warnings"]

    assert lines[0] == f"{hand}: 1 finger, no faults, 1 warning"
    assert lines[1] == f"warning: {hand}:{warning['line']} {warning['key']} {warning['message']}"
    assert (warning["line"], warning["key"]) == (35, "fingers.jaw.links[0].inertia")
    assert warning["ratio"] == pytest.approx(0.0098, abs=1e-4)  # gyration over length: 5 kg weigh a thousand times 5 g


def test_a_good_file_without_generated_c_is_no_error(tmp_path):
    place = tmp_path / "out"
    lines = told("check", "--hand", ONE_FINGER, "-o", place).splitlines()

    assert lines[1:] == [
        f"{place}: nothing generated here yet", f"to fix it: awiwi-gen generate --hand {ONE_FINGER} -o {place}"
    ]  # fmt: skip
    assert answer("check", "--hand", ONE_FINGER, "-o", place)["missing"] is True


def test_advice_keeps_the_hand(tmp_path):
    place = tmp_path / "out"
    expected = f"{place}: nothing generated here; run awiwi-gen generate --hand {ONE_FINGER} -o {place}"

    assert complaint("verify", "--hand", ONE_FINGER, "-o", place) == expected
    assert complaint("explain", "zzz", "--hand", ONE_FINGER).endswith(f"see awiwi-gen list --hand {ONE_FINGER}")


@pytest.mark.parametrize("arguments", [["lst"], ["check", "--hnd", "x"], ["generate", "--scalar", "f16"]])
def test_a_command_line_that_makes_no_sense_is_told_in_json_too(arguments):
    done = process(*arguments, "--json")

    assert done.returncode == 2
    assert json.loads(done.stdout)["error"] == "UsageError"


def test_a_stale_directory_is_told_in_json_too(small):
    found = answer("verify", "--hand", ONE_FINGER, "-o", small, code=1)

    assert (found["error"], found["stale"]) == ("stale", ["options"])


def test_a_full_standard_output_is_one_sentence():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "awiwi_gen", "list", "--assumed"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip

    assert (done.returncode, done.stderr) == (2, "standard output or a temporary file: no space left on device\n")


def test_text_of_a_hand_file_reaches_no_terminal_raw(tmp_path):
    hand = tmp_path / "odd\x1b[2J.toml"
    hand.write_text('gains = "a\\u001b[31m[/b].toml"\n' + Path(ONE_FINGER).read_text())
    message = complaint("check", "--hand", hand)

    assert "\\x1b[2J" in message
    assert message.isprintable()
    marked = tmp_path / "marked.toml"
    marked.write_text(Path(ONE_FINGER).read_text().replace("One finger", "One [/b] finger"))
    told("generate", "--verify", "--hand", marked, "-o", tmp_path / "out", "--only", "jaw_tendon_lengths")
