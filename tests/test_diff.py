"""`awiwi-gen diff`: what an edit does to figures and kernels, and which numbers matter, each against an independent way."""

from __future__ import annotations

import itertools
import json
import math
import re
import subprocess
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from commands import ONE_FINGER, answer, complaint, run, small, told  # noqa: F401 a fixture

import awiwi_gen
from awiwi_gen.diff import hands
from awiwi_gen.diff.difference import Difference, difference
from awiwi_gen.diff.figures import figures
from awiwi_gen.diff.kernels import operations
from awiwi_gen.diff.slopes import DERIVATIVES, Sloped, outputs
from awiwi_gen.diff.text import sections
from awiwi_gen.editing import changed
from awiwi_gen.hand import Hand
from awiwi_gen.hand.file import HandFile
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Output
from awiwi_gen.pipeline import Job, derive
from awiwi_gen.resources import DEFAULT_HAND

TEXT = Path(ONE_FINGER).read_text(encoding="utf-8")
RADIUS = "fingers.jaw.pulleys[0].radius"


def edited(text: str, key: str, value: str) -> str:
    return changed(HandFile.parse(text, "hand.toml"), key, value)[0]


def compared(old: str, new: str, wanted: list[str] | None = None) -> Difference:
    return difference(Job(Hand.parse(old)), Job(Hand.parse(new)), ("old", "new"), wanted)


@pytest.fixture(scope="module")
def wider() -> Difference:
    return compared(TEXT, edited(TEXT, RADIUS, "9.09 mm"), ["jaw"])


@pytest.fixture
def files(tmp_path) -> tuple[Path, Path]:
    old, new = tmp_path / "old.toml", tmp_path / "new.toml"
    old.write_text(TEXT, encoding="utf-8")
    new.write_text(edited(TEXT, RADIUS, "9.09 mm"), encoding="utf-8")
    return old, new


# -- numbers of the file -----------------------------------------------------------------------------------


def test_equal_files_differ_in_nothing(files):
    found = answer("diff", files[0], files[0])

    assert [found[key] for key in ("values", "figures", "kernels", "effects", "fingers")] == [[]] * 5
    assert found["appear"] == found["vanish"] == found["only"] == {}
    assert "nothing changes" in told("diff", files[0], files[0])


def test_another_way_to_write_a_number_is_no_change():
    found = compared(TEXT, TEXT.replace('"9 mm"', '"0.9 cm"'))

    assert (found.values, found.figures, found.kernels) == ([], [], [])


def test_numbers_and_other_values_that_change_are_told_with_key_and_guess():
    new = edited(edited(TEXT, "fingers.jaw.links[0].mass", "6 g"), "fingers.jaw.tendons[1].over", '["-root"]')
    found = {each.key: each for each in compared(TEXT, new).values}

    assert set(found) == {"fingers.jaw.links[0].mass", "fingers.jaw.tendons[1].over"}
    mass, over = found.values()
    assert (mass.old, mass.new, mass.relative, mass.assumed) == ("5 g", "6 g", pytest.approx(0.2), True)
    assert (over.old, over.new, over.relative) == ("-root, +mid", "-root", None)


def test_guesses_are_those_of_the_new_file(wider):
    measured = TEXT.replace('source = "assumed"', 'source = "measured"', 1)  # the seven limits
    found = compared(TEXT, measured)

    assert list(Hand.parse(TEXT).assumed()) == wider.assumed == found.assumed_before
    assert len(found.assumed) == len(wider.assumed) - 7
    assert found.values == []
    assert "48 of 61 numbers of new are guesses, 55 of old were" in next(sections(found, everything=False)).notes


# -- figures -----------------------------------------------------------------------------------------------


def test_a_pulley_that_grows_by_one_percent_moves_what_it_should(wider):
    moved = {each.name: each.new / each.old - 1 for each in wider.figures if not each.same}

    one, two = pytest.approx(0.01), pytest.approx(0.0201)
    assert moved == {
        "P[0, root]": one, "P[1, root]": one, "torque +root": one, "torque -root": one,
        "stiffness root, least": two, "stiffness root, most": two,
    }  # fmt: skip


def test_figures_are_what_the_file_says():
    found = {each.name: each for each in compared(TEXT, TEXT, ["jaw"]).figures}

    assert found["P[0, root]"].new == pytest.approx(9)
    assert found["torque +root"].new == pytest.approx(0.9)  # one tendon shortens the root: 100 N on 9 mm
    assert found["torque +mid"].new == pytest.approx(0.6)
    assert found["torque -mid"].new == pytest.approx(-1.2)
    assert found["stiffness root, least"].new == pytest.approx(2 * 0.009**2 * 1000)
    assert found["stiffness mid, most"].new == pytest.approx(3 * 0.006**2 * 50000)
    assert found["mass"].new == pytest.approx(11)
    assert "travel root" not in found  # the hand has no motor


def test_travel_is_the_pulley_of_the_motor_over_the_arm(hand):
    job = Job(hand)
    found = {each.name: each.value for each in figures(job, "index")}

    assert found["travel pip"] == pytest.approx(360 * 4 / 6)


def test_workspace_and_gravity_are_those_of_the_compiled_kernels(hand, lib):
    found = {each.name: each.value for each in figures(Job(hand), "index")}
    grid = [np.linspace(float(link.low), float(link.high), 9) for link in hand.fingers["index"].links]
    poses = np.array(list(itertools.product(*grid)))
    tips = 1e3 * lib.index_fingertip_pose(poses)[:, :3, 3]
    load = np.linalg.norm([lib.index_gravity(poses, axis)[:, 1] for axis in np.eye(3)], axis=0)

    for axis, name in enumerate("xyz"):
        assert 0.9 * np.ptp(tips[:, axis]) < found[f"workspace {name}"] < 1.01 * np.ptp(tips[:, axis])
    assert found["reach"] == pytest.approx(np.linalg.norm(tips, axis=1).max(), rel=0.02)
    assert found["gravity flexion"] == pytest.approx(9.81 * load.max(), rel=0.02)


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        *((RADIUS, "mm"), ("fingers.jaw.links[0].four_bar.crank", "mm"), ("fingers.jaw.links[1].offset[2]", "mm")),
        *(("fingers.jaw.links[0].high", "deg"), ("fingers.jaw.links[0].low", "deg"), ("limits.gravity", "m/s^2")),
        *(("limits.tendon_force", "N"), ("limits.tendon_stiffness_low", "N/m"), ("fingers.jaw.links[1].mass", "g")),
        *(("fingers.jaw.links[2].com[2]", "mm"),),
    ],
)
def test_derivatives_are_those_of_edited_files(path, unit):
    hand = Hand.parse(TEXT)
    size = float(hand.quantities()[path].text.split()[0])
    step = 1e-6 * size
    job = Job(hand)
    derive(job)
    texts = [edited(TEXT, path, f"{size + end * step:.12g} {unit}") for end in (-1, 1)]
    low, high = ({each.name: each.value for each in figures(Job(Hand.parse(text)), "jaw")} for text in texts)
    per_unit = float(Hand.parse(texts[1]).quantities()[path]) - float(Hand.parse(texts[0]).quantities()[path])

    moved = 0
    for each in figures(job, "jaw"):
        expected = (high[each.name] - low[each.name]) / per_unit
        assert each.slopes.get(path, 0.0) == pytest.approx(
            expected, rel=1e-4, abs=1e-5 * abs(each.value / per_unit * 1e-6)
        )
        moved += path in each.slopes
    assert moved > 0


@pytest.mark.parametrize(
    ("finger", "key", "size", "names"),
    [
        ("thumb", "tendons[0].span.to[1]", 3, ["P[0, flexion]", "torque +flexion", "stiffness abduction, most"]),
        ("fifth", "pulleys[4].radius", 6.5, ["workspace x", "workspace z", "gravity pip"]),
    ],
)
def test_derivatives_of_spans_and_followers_are_those_of_edited_files(hand, finger, key, size, names):
    path, text = f"fingers.{finger}.{key}", DEFAULT_HAND.read_text(encoding="utf-8")
    low, high = (
        {each.name: each.value for each in figures(Job(Hand.parse(edited(text, path, f"{size + step} mm"))), finger)}
        for step in (-1e-4, 1e-4)
    )
    found = {each.name: each.slopes.get(path, 0.0) for each in figures(Job(hand), finger)}

    for name in names:
        assert found[name] == pytest.approx((high[name] - low[name]) / 2e-7, rel=1e-4)
        assert found[name] != 0


@pytest.mark.parametrize("operation", [*DERIVATIVES, "atan2", "inv"])
def test_every_function_of_a_graph_has_its_derivative(operation):
    builder = Builder()
    x = builder.input("x", 0)
    y = builder.call("atan2", x, builder.input("x", 1)) if operation == "atan2" else builder.make(operation, (x,))
    graph = builder.graph([Output("y", (1,), (y,))])
    at, step = np.array([[0.3, -0.7], [0.6, 0.4]]), 1e-6
    direction = np.array([1.0, 0.5])

    found = outputs(graph, {"x": Sloped(at, np.broadcast_to(direction, (1, 2, 2)))}, {}, 2, 1)["y"]
    ends = [outputs(graph, {"x": Sloped(at + sign * step * direction)}, {}, 2)["y"].value for sign in (-1, 1)]
    assert found.slope[0] == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-7)


# -- what matters ------------------------------------------------------------------------------------------


def test_effects_are_percent_of_the_figure_and_ten_micrometres(wider):
    (effect,) = (e for e in wider.effects if (e.figure, e.number) == ("torque -root", RADIUS))

    assert effect.part == pytest.approx(1)
    assert effect.step == pytest.approx(-100 * 1e-5)  # 100 N times 10 um, away from zero
    assert effect.step_part == pytest.approx(100 * 1e-5 / 9.09e-3)
    assert not effect.assumed
    assert next(e for e in wider.effects if e.number == "limits.tendon_force").step is None


def test_the_list_for_the_workshop_has_the_worst_length_first(wider):
    *_, last = sections(wider, everything=True)
    percents = [abs(float(row[2].rstrip(" %"))) for row in last.rows]

    assert last.title.startswith("for the workshop")
    assert percents == sorted(percents, reverse=True)
    assert last.rows[0][0] == "fingers.jaw.pulleys[1].radius"


# -- kernels -----------------------------------------------------------------------------------------------


def test_only_kernels_that_use_the_number_change(wider):
    names = {each.name for each in wider.kernels}

    assert {"jaw_coupling", "hand_coupling", "jaw_joint_torque", "jaw_tendon_distribution"} <= names
    assert not {name for name in names if re.search("pose|mass|gravity|dynamics|energy", name)}


def test_the_worst_change_is_that_of_the_compiled_kernels(wider):
    libraries = [
        awiwi_gen.build(Hand.parse(text), only="jaw_joint_torque") for text in (TEXT, edited(TEXT, RADIUS, "9.09 mm"))
    ]
    (change,) = (each for each in wider.kernels if each.name == "jaw_joint_torque")
    (output,) = change.outputs
    old, new = (library.jaw_joint_torque(**output.inputs) for library in libraries)
    element = int(re.search(r"\d+", output.output)[0])

    assert [output.old, output.new] == pytest.approx([old[element], new[element]])
    assert abs(output.new - output.old) == pytest.approx(np.abs(new - old).max())


def test_operations_are_those_of_the_c(small):  # noqa: F811
    job = Job(Hand.parse(TEXT))
    counted = {
        each["name"]: each["cost"]["operations"]
        for each in json.loads((small / "manifest.json").read_text())["kernels"]
    }
    kernels = [kernel for kernel in job.catalog if kernel.name in counted and kernel.solver is None]
    job.store.get = without_records(job.store.get)

    assert len(kernels) > 5
    assert {kernel.name: operations(kernel, job) for kernel in kernels} == {
        kernel.name: counted[kernel.name] for kernel in kernels
    }


def without_records(get):
    """A cache that has no records, so that operations are counted anew."""
    return lambda kind, digest: None if kind in ("records", "operations") else get(kind, digest)


def test_kernels_that_vanish_and_appear_have_their_reason():
    less = TEXT.replace('    { rest = "0 mm", over = ["-mid"], source = "assumed" },\n', "")
    gone, back = compared(TEXT, less), compared(less, TEXT)

    assert "none pulls towards +mid" in gone.vanish["jaw_tendon_distribution"]
    assert gone.vanish == back.appear
    assert gone.appear == back.vanish == {}
    assert any(each.note == "its inputs or outputs have other shapes" for each in gone.kernels)


def test_a_motor_that_is_new_brings_its_kernels():
    motor = re.search(r"^\[motor\]\n.*?\n(?=\[\[|# -)", DEFAULT_HAND.read_text(), re.MULTILINE | re.DOTALL)[0]
    found = compared(TEXT, f"{TEXT}\n{motor}")

    assert {found.appear[name] for name in found.appear if name.startswith("motor_")} == {"the hand has no [motor]"}
    assert [each.name for each in found.figures if not each.same] == ["travel root", "travel mid"]


def test_other_limits_change_figures_and_ranges():
    found = compared(TEXT, edited(TEXT, "limits.tendon_force", "110 N"))

    assert {each.name for each in found.figures if not each.same} >= {"torque +root", "torque -mid"}
    assert {each.note for each in found.kernels if "torque" in each.name} == {"the inputs have other ranges"}


def test_samples_that_leave_the_domain_are_counted():
    """At a crank angle of 120 deg the four-bar is open; it closes up to 114 deg."""
    turned = TEXT.replace('reference = "60 deg"', 'reference = "80 deg"').replace('high = "40 deg"', 'high = "30 deg"')
    notes = {each.name: each.note for each in compared(TEXT, turned).kernels}

    assert re.fullmatch(r"\d+ of 320 samples are no longer in its domain", notes["jaw_fingertip_pose"])
    assert notes["jaw_tendon_lengths"] == "the inputs have other ranges"


def test_fingers_of_one_hand_only_are_named():
    found = compared(TEXT, TEXT.replace("fingers.jaw", "fingers.beak"))
    text = "\n".join(each.title for each in sections(found, everything=False))

    assert found.only == {"beak": "new", "jaw": "old"}
    assert found.fingers == []
    assert "finger beak: only in new" in text
    assert found.vanish["jaw_coupling"] == "the hand has no finger jaw"


# -- revisions ---------------------------------------------------------------------------------------------


@pytest.fixture
def repository(tmp_path):
    """Three commits of sub/hand.toml: as it is, with a fault, and a wider pulley."""
    folder = tmp_path / "sub"
    folder.mkdir()

    def git(*words: str) -> None:
        identity = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", *identity, *words], cwd=tmp_path, check=True, capture_output=True)

    git("init", "-q")
    for message, text in (
        ("one", TEXT), ("two", TEXT.replace('"9 mm"', '"9 N"', 1)), ("three", edited(TEXT, RADIUS, "9.09 mm")),
    ):  # fmt: skip
        (folder / "hand.toml").write_text(text, encoding="utf-8")
        git("add", ".")
        git("commit", "-qm", message)
    return folder / "hand.toml"


def test_revisions_are_compared_with_each_other_and_with_the_file(repository):
    both = answer("diff", "HEAD~2", "HEAD", "--hand", repository)
    repository.write_text(edited(TEXT, RADIUS, "9.9 mm"), encoding="utf-8")
    file = answer("diff", "--hand", repository)

    assert (both["old"], both["new"]) == ("HEAD~2:hand.toml", "HEAD:hand.toml")
    assert [(each["old"], each["new"]) for each in both["values"]] == [("9 mm", "9.09 mm")]
    assert [(each["old"], each["new"]) for each in file["values"]] == [("9.09 mm", "9.9 mm")]


def test_a_revision_with_faults_is_named(repository):
    said = complaint("diff", "HEAD~1", "--hand", repository)

    assert said.startswith(f'HEAD~1:hand.toml:16 {RADIUS} = "9 N" is a force')


def test_gains_are_those_of_the_revision(repository):
    assert hands._included(b'gains = "below/gains.toml"') == "below/gains.toml"
    assert (
        hands._included(b'gains = "../gains.toml"')
        == hands._included(b"gains = [")
        == hands._included(TEXT.encode())
        == ""
    )
    text = edited(TEXT, "name", "with gains").replace("\n\n", '\ngains = "gains.toml"\n\n', 1)
    repository.write_text(text, encoding="utf-8")
    repository.with_name("gains.toml").write_text("gains = 3\n", encoding="utf-8")
    subprocess.run(["git", "add", "."], cwd=repository.parent, check=True)
    subprocess.run(
        ["git", "-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "four"], cwd=repository.parent, check=True
    )
    repository.with_name("gains.toml").unlink()

    assert complaint("diff", "HEAD", "--hand", repository).startswith("HEAD:gains.toml:1 gains")


def test_bad_input_is_one_sentence(repository, tmp_path, monkeypatch):
    outside = tmp_path.parent / f"{tmp_path.name}.toml"
    outside.write_text(TEXT, encoding="utf-8")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))

    assert (
        complaint("diff", "v9", "--hand", repository) == f"v9: the git repository of {repository} has no such revision"
    )
    assert complaint("diff", outside, "--hand", repository).endswith("; to compare two files, leave out --hand")
    assert complaint("diff", "HEAD", "--hand", outside) == f"HEAD: {outside} is in no git repository"
    missing = repository.with_name("other.toml")
    assert complaint("diff", "HEAD", "--hand", missing) == f"HEAD has no file {missing}"
    assert complaint("diff", "HEAD", "--hand", tmp_path / "no" / "x.toml") == f"{tmp_path / 'no'} is no folder"
    assert "name the hand file with --hand" in complaint("diff", "HEAD~1", "HEAD")
    assert "compares two hand files" in complaint("diff", repository)
    assert "did you mean jaw" in complaint("diff", repository, repository, "--finger", "jaws")
    assert "leave one of them out" in run("diff", repository, repository, "--json", "--markdown").stdout
    monkeypatch.setattr(hands.shutil, "which", lambda _: None)
    assert complaint("diff", "HEAD", "--hand", repository).startswith("git is not installed")


# -- what is printed ---------------------------------------------------------------------------------------


def test_tables_fit_a_terminal_and_markdown_is_regular(tmp_path):
    old, new = DEFAULT_HAND, tmp_path / "new.toml"
    text = edited(DEFAULT_HAND.read_text(encoding="utf-8"), "fingers.fifth.links[0].four_bar.crank", "10.1 mm")
    new.write_text(edited(text, "fingers.thumb.pulleys[0].radius", "8.1 mm"), encoding="utf-8")
    lines = told("diff", old, new, "--finger", "fifth").splitlines()
    tables = [line for line in told("diff", old, new, "--markdown").splitlines() if line.startswith("|")]

    assert len(lines) > 60
    assert [line for line in lines[1:] if len(line) > 80] == []
    assert len(tables) > 20
    for line, after in itertools.pairwise(tables):
        if set(after) <= set("|- "):
            assert line.count("|") == after.count("|")


def test_the_drawing_has_both_hands(files, tmp_path):
    told("diff", *files, "-o", tmp_path / "both.svg")
    root = ElementTree.parse(tmp_path / "both.svg")  # noqa: S314 our own text
    kinds = [line.attrib["class"] for line in root.iter("{http://www.w3.org/2000/svg}polyline")]

    assert (
        kinds.count("before") == len(kinds) - kinds.count("before") - 1
    )  # as many lines, without the bar of the scale
    assert math.isclose(kinds.index("before"), 1)


def test_a_constant_number_has_no_derivative():
    builder = Builder()
    graph = builder.graph([Output("y", (1,), (builder.const(Fraction(2)),))])
    found = outputs(graph, {}, {}, 3, 2)["y"]

    assert found.value.tolist() == [[2.0]] * 3
    assert not found.slope.any()
