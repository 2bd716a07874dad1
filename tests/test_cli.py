"""The command line: what each command prints, in words and in JSON, and what its exit code means."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from commands import ONE_FINGER, answer, complaint, run, small, told

import awiwi_gen
from awiwi_gen.resources import CSRC

__all__ = ["small"]


def snapshot(directory: Path) -> dict[str, tuple[int, bytes]]:
    return {str(path): (path.stat().st_mtime_ns, path.read_bytes()) for path in directory.rglob("*") if path.is_file()}


SMALL = ("--hand", ONE_FINGER, "--only", "jaw_[fjt]*")

# ------------------------------------------------------------------------------------------------- help and errors


def test_without_a_command_help_is_shown():
    assert "Usage:" in run().output


@pytest.mark.parametrize("command", ["generate", "check", "build", "verify", "list", "call", "explain"])
def test_every_command_has_help_and_json(command):
    assert "--json" in told(command, "--help")


@pytest.mark.parametrize("arguments", ["generat", "generate --hnd x", "generate --scalar f16", "call"])
def test_a_command_line_that_makes_no_sense_is_refused(arguments):
    assert run(*arguments.split()).exit_code == 2


@pytest.mark.parametrize("command", ["generate", "check", "verify", "list --assumed", "call x", "explain x"])
def test_a_bad_hand_file_is_told_with_its_line_and_changes_nothing(command, small, tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text(Path(ONE_FINGER).read_text().replace('radius = "9 mm"', 'radius = "9 N"'))
    before = snapshot(small)
    place = ("-o", small) if command in ("generate", "check", "verify") else ()
    message = f'{bad}:16 fingers.jaw.pulleys[0].radius = "9 N" is a force; expected a length such as "6.2 mm"'

    assert complaint(*command.split(), "--hand", bad, *place) == message
    found = answer(*command.split(), "--hand", bad, *place, code=2)
    assert (found["error"], found["message"]) == ("InputError", message)
    assert [(fault["line"], fault["key"]) for fault in found["faults"]] == [(16, "fingers.jaw.pulleys[0].radius")]
    assert snapshot(small) == before


def test_a_hand_file_that_is_not_there_is_named():
    assert complaint("check", "--hand", "nowhere.toml") == "nowhere.toml cannot be read: no such file or directory"


# ------------------------------------------------------------------------------------------------- generate and check


def test_generating_again_changes_nothing(small):
    before, inode = snapshot(small), small.stat().st_ino

    assert told("generate", *SMALL, "-o", small) == f"{small}: already up to date\n"
    assert answer("generate", *SMALL, "-o", small)["changed"] is False
    assert (snapshot(small), small.stat().st_ino) == (before, inode)


def test_what_was_generated_is_told_in_json(tmp_path):
    place, hand = tmp_path / "out", awiwi_gen.Hand.load(ONE_FINGER)
    only = ("--hand", ONE_FINGER, "-o", place, "--only", "jaw_tendon_lengths")

    assert answer("generate", *only) == {"directory": str(place), "changed": True, "digest": hand.digest()}
    assert {path.name for path in place.glob("*_*.c")} == {"jaw_tendon_lengths.c", "self_test.c"}
    assert {"kernels.h", "manifest.json", "model.c", "real.h"} <= {path.name for path in place.iterdir()}


def test_a_pattern_that_matches_nothing_is_refused(tmp_path):
    place = tmp_path / "out"

    assert complaint("generate", "--hand", ONE_FINGER, "-o", place, "--only", "elbow_*") == (
        f"--only elbow_*: no kernel has such a name; see awiwi-gen list --hand {ONE_FINGER}"
    )
    assert not place.exists()


def test_a_kernel_that_iterates_brings_the_kernels_it_calls(tmp_path):
    told("generate", "-o", tmp_path / "out", "--only", "thumb_joint_estimate")

    assert {path.stem for path in (tmp_path / "out").glob("thumb*.c")} == {
        "thumb_joint_estimate", "thumb_tendon_lengths", "thumb_coupling"
    }  # fmt: skip


def test_commas_separate_patterns(tmp_path):
    told("generate", "--hand", ONE_FINGER, "-o", tmp_path / "out", "--only", "jaw_tendon_l*, jaw_gravity")

    assert {path.stem for path in (tmp_path / "out").glob("jaw*.c")} == {"jaw_tendon_lengths", "jaw_gravity"}


def test_a_fresh_directory_is_called_fresh(small):
    assert told("check", *SMALL, "-o", small) == f"{ONE_FINGER}: 1 finger, no faults\n{small}: fresh\n"
    assert answer("check", *SMALL, "-o", small) == {
        "hand": "One finger", "fresh": True, "missing": False, "edited": [], "lost": [], "foreign": [], "stale": [],
        "warnings": [], "left_out": [], "tick": {}, "estimates": {},
    }  # fmt: skip


def test_a_changed_number_makes_the_directory_stale(small, tmp_path):
    thicker = tmp_path / "thicker.toml"
    thicker.write_text(Path(ONE_FINGER).read_text().replace('"9 mm"', '"9.5 mm"'))
    other = ("--hand", thicker, "--only", "jaw_[fjt]*", "-o", small)

    assert f"{small}: stale, another hand file than it was made from" in told("check", *other, code=1)
    assert answer("check", *other, code=1)["stale"] == ["hand"]


def test_other_options_make_the_directory_stale(small):
    assert answer("check", *SMALL, "--scalar", "f32", "-o", small, code=1)["stale"] == ["options"]


def test_the_mend_that_is_told_mends(tmp_path):
    place = tmp_path / "out"
    options = ("--hand", ONE_FINGER, "--only", "jaw_t*", "--scalar", "f32", "-o", place)
    told("generate", *options)
    (place / "jaw_tendon_lengths.c").write_text("/* better */")
    lines = told("check", *options, code=1).splitlines()
    fix = lines[-1].removeprefix("to fix it: awiwi-gen ")
    refusal = run("verify", "--hand", ONE_FINGER, "-o", place).stderr

    assert f"{place}/jaw_tendon_lengths.c: edited by hand; changes belong in the hand file" in lines
    assert refusal.splitlines()[-1] == f"to fix it: awiwi-gen generate --hand {ONE_FINGER} -o {place}"
    told(*shlex.split(fix))
    assert told("check", *options).endswith(": fresh\n")


@pytest.mark.parametrize("command", ["build", "verify", "list"])
def test_where_nothing_was_generated_the_error_says_how(command, tmp_path):
    place = tmp_path / "nowhere"

    assert complaint(command, "-o", place) == f"{place}: nothing generated here; run awiwi-gen generate -o {place}"


# ------------------------------------------------------------------------------------------------- build and verify


def test_building_compiles_and_loads(small):
    digest = awiwi_gen.Hand.load(ONE_FINGER).digest()

    assert re.fullmatch(rf"{small}: \d+ kernels compiled and loaded, model {digest[:12]}\n", told("build", "-o", small))
    summary = answer("build", "-o", small)
    assert (summary["digest"], summary["scalar"]) == (digest, "double")


def test_verification_prints_a_row_for_each_kernel_and_a_sentence(small):
    lines = told("verify", *SMALL, "-o", small).splitlines()
    rows = [line for line in lines if line.startswith("jaw_")]

    assert lines[0].startswith("One finger: ")
    assert len(rows) == len(json.loads((small / "manifest.json").read_text())["kernels"])
    assert all(row.endswith("proved") for row in rows)
    assert lines[-1] == f"{len(rows)} of {len(rows)} kernels proved at 320 samples each (seed 20120301)"


def test_verdicts_are_told_in_json(small):
    verdicts = answer("verify", *SMALL, "-o", small)

    assert {"name", "passed", "worst_ulp", "worst_scaled_error", "samples"} <= verdicts[0].keys()
    assert all(verdict["passed"] and verdict["samples"] >= 300 for verdict in verdicts)


def test_a_stale_directory_is_not_verified_but_told(small):
    done = run("verify", "--hand", ONE_FINGER, "-o", small)

    assert done.exit_code == 1
    assert "stale" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize("scalar", ["f64", "f32"])
@pytest.mark.parametrize("params", ["baked", "runtime"])
def test_every_kind_of_c_is_verified(scalar, params, tmp_path):
    kind = ("--scalar", scalar, "--params", params)
    options = ("--hand", ONE_FINGER, "-o", tmp_path / "out", "--only", "jaw_[me]*", *kind)
    told("generate", *options)
    header = (tmp_path / "out" / "kernels.h").read_text()

    assert answer("build", "-o", tmp_path / "out")["scalar"] == {"f64": "double", "f32": "float"}[scalar]
    assert ("claw_default_numbers" in header) == (params == "runtime")
    assert ("double" in header) == (scalar == "f64")
    assert all(verdict["passed"] for verdict in answer("verify", *options))


def test_generating_and_verifying_is_one_command(tmp_path):
    options = ("--hand", ONE_FINGER, "-o", tmp_path / "out", "--only", "jaw_tendon_lengths")

    assert told("generate", "--verify", *options) == told("verify", *options)


# ------------------------------------------------------------------------------------------------- list


def test_the_list_names_kernels_ports_costs_and_sources(small):
    told_of = told("list", "-o", small)
    names = [entry["name"] for entry in json.loads((small / "manifest.json").read_text())["kernels"]]

    assert re.findall(r"^(\w+)\(", told_of, re.MULTILINE) == names
    assert re.search(r"^jaw_joint_torque\(q, f\) -> tau\n    \d+ operations; eq\. 5\.8$", told_of, re.MULTILINE)


def test_the_list_fits_80_columns_and_shortens_nothing():
    lines = told("list").splitlines()

    assert max(map(len, lines)) <= 80
    text = " ".join(" ".join(lines).split())
    for entry in answer("list"):
        ports = (", ".join(port["name"] for port in entry[side]) for side in ("inputs", "outputs"))
        assert "{}({}) -> {} ".format(entry["name"], *ports) in text
        assert entry["source"] in text


def test_the_list_in_json_has_shapes_units_ranges_and_costs(small):
    (kernel,) = [kernel for kernel in answer("list", "-o", small) if kernel["name"] == "jaw_joint_torque"]

    assert kernel["inputs"][1] == {"name": "f", "shape": [3], "unit": "N", "low": [0.0] * 3, "high": [100.0] * 3}
    assert kernel["outputs"] == [{"name": "tau", "shape": [2], "unit": "N m"}]
    assert kernel["source"] == "eq. 5.8"
    assert {"add", "mul", "div", "sqrt", "sincos"} <= kernel["cost"].keys()


def test_numbers_without_a_source_are_listed():
    assert re.search(r"fingers\.jaw\.links\[1\]\.mass +4 g\n", told("list", "--assumed", "--hand", ONE_FINGER))
    guesses = {entry["path"]: entry["value"] for entry in answer("list", "--assumed", "--hand", ONE_FINGER)}
    assert guesses["limits.tendon_force"] == "100 N"
    assert "fingers.jaw.pulleys[0].radius" not in guesses


# ------------------------------------------------------------------------------------------------- call


def test_a_kernel_is_called_with_numbers_on_the_command_line(lib):
    text = told("call", "index_mass_matrix", "q=0.1,0.2,0.3,0.4")
    expected = lib.index_mass_matrix([0.1, 0.2, 0.3, 0.4])

    assert text.startswith("M [kg m^2]\n[[")
    numbers = [float(number) for number in re.findall(r"[-+\d.]+e[-+]\d+", text)]
    assert numbers == pytest.approx(expected.ravel(), rel=1e-8)


def test_a_kernel_is_called_with_json_and_answers_in_json(lib):
    given = {"q": [0.1, 0.2, 0.3, 0.4], "qd": [[1, 2, 3, 4], [0, 0, 0, 0]], "g": [0, 0, -9.81]}
    found = answer("call", "index_dynamics", stdin=json.dumps(given))
    expected = lib.index_dynamics(**given)

    assert found == {name: array.tolist() for name, array in expected._asdict().items()}


def test_scalars_and_statuses_are_called_too(lib):
    found = answer("call", "wrist_points", "q71=0.62", "q73=-0.5")

    assert found["status"] == 1
    assert "nan" in told("call", "wrist_points", "q71=0.62", "q73=-0.5")


def test_a_misspelt_kernel_is_told_its_likely_name():
    expected = "no kernel 'index_mas_matrix'; did you mean index_mass_matrix"

    assert complaint("call", "index_mas_matrix", "q=0,0,0,0").startswith(expected)
    assert complaint("explain", "index_mas_matrix").startswith(expected)
    assert complaint("call", "zzz").endswith("see awiwi-gen list")
    assert complaint("explain", "zzz").endswith("see awiwi-gen list")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["q=0.1,0.2"], "index_mass_matrix: q has shape (2,), expected (..., 4)"),
        (["q"], "'q' is not an input; expected name=number,number,... such as q=0.1,0.2,0.3,0.4"),
        (["q=a,b"], "'q=a,b' is not an input; expected"),
        (["x=1"], "index_mass_matrix takes q; missing ['q'], unknown ['x']"),
        (["q=nan,0,0"], "index_mass_matrix: q has shape (3,), expected (..., 4)"),
        ([], "index_mass_matrix takes q; missing ['q'], unknown []"),
    ],
)
def test_inputs_that_do_not_fit_are_told(arguments, message):
    assert complaint("call", "index_mass_matrix", *arguments).startswith(message)


@pytest.mark.parametrize(
    ("stdin", "message"),
    [
        ("", "standard input is not JSON"),
        ("{q: 1}", "standard input is not JSON"),
        ("[1, 2]", "standard input must be one JSON object"),
        ('{"q": "x"}', "is not an array of real numbers"),
        ('{"Q": [1, 2, 3, 4]}', "unknown ['Q']"),
    ],
)
def test_json_that_does_not_fit_is_told(stdin, message):
    error = answer("call", "index_mass_matrix", stdin=stdin, code=2)

    assert error["error"] == "InputError"
    assert message in error["message"]


def test_what_is_not_a_number_is_null_in_json():
    found = answer("call", "wrist_points", "q71=0.62", "q73=-0.5")

    assert None in found["A"] + found["B"] + found["C"]
    assert answer("call", "index_tendon_lengths", stdin='{"q": [null, 0, 0, 0]}')["h"][0] is None


# ------------------------------------------------------------------------------------------------- explain


def test_a_kernel_is_explained_down_to_the_numbers():
    lines = told("explain", "jaw_tendon_lengths", "--hand", ONE_FINGER).splitlines()

    assert lines[0] == "jaw_tendon_lengths"
    assert any(line.split() == ["source", "eq.", "5.5,", "5.18,", "5.22"] for line in lines)
    assert "    t0 = q[0]*pulleys[0].radius" in lines
    assert "    h₂ = -q₁⋅radius₁ + rest₂" in lines
    assert "    pulleys[0].radius = 9 mm (radius₀)" in lines


def test_an_explanation_in_json_has_all_its_parts():
    found = answer("explain", "index_mass_matrix")

    assert found["inputs"]["q"]["shape"] == [4]
    assert found["numbers"]["links[1].mass"] == "10 g"
    assert found["mathematics"]


def test_a_kernel_that_iterates_is_explained_by_its_problem():
    assert "least squares, by iteration" in told("explain", "thumb_joint_estimate")


def test_the_versions_of_generator_and_c_interface_are_told():
    header = (CSRC / "awiwi_version.h").read_text()
    c = ".".join(re.search(rf"AWIWI_API_{part} (\d+)", header)[1] for part in ("MAJOR", "MINOR", "PATCH"))
    result = run("--version")
    assert result.exit_code == 0
    assert result.output == f"awiwi-gen {metadata.version('awiwi_gen')}, C interface {c}\n"


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("awiwi-gen se", {"set"}),
        ("awiwi-gen explain index_mass", {"index_mass_matrix"}),
        ("awiwi-gen generate --sc", {"--scalar"}),
    ],
)
def test_a_shell_completes_commands_options_and_kernels(words, offered):
    root = Path(__file__).resolve().parent.parent
    asked = {"_AWIWI_GEN_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    command = Path(sys.executable).with_name("awiwi-gen")
    done = subprocess.run([command], cwd=root, env=os.environ | asked, capture_output=True, text=True, check=False)

    assert set(done.stdout.split()) == offered
