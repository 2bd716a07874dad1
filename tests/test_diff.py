"""`awiwi-gen diff`: what an edit does to figures and kernels, and which numbers matter, each against an independent way."""

from __future__ import annotations

import itertools
import json
import re
from fractions import Fraction

import numpy as np
import pytest
from actuators import AWIWI
from commands import ONE_FINGER, answer, complaint, run, small, told  # noqa: F401 a fixture
from edited_hands import RADIUS, TEXT, edited

import awiwi_gen
from awiwi_gen.diff.difference import Difference, difference
from awiwi_gen.diff.figures import figures
from awiwi_gen.diff.kernels import operations
from awiwi_gen.diff.slopes import DERIVATIVES, Sloped, outputs
from awiwi_gen.diff.text import sections
from awiwi_gen.hand import Hand
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Output
from awiwi_gen.pipeline import Job, derive


def compared(old: str, new: str, wanted: list[str] | None = None) -> Difference:
    return difference(Job(Hand.parse(old)), Job(Hand.parse(new)), ("old", "new"), wanted)


@pytest.fixture(scope="module")
def wider() -> Difference:
    return compared(TEXT, edited(TEXT, RADIUS, "9.09 mm"), ["jaw"])


# -- numbers of the file -----------------------------------------------------------------------------------


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
    path, text = f"fingers.{finger}.{key}", AWIWI
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
    motor = re.search(r"^\[motor\]\n.*?\n(?=\[\[|# -)", AWIWI, re.MULTILINE | re.DOTALL)[0]
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


def test_a_constant_number_has_no_derivative():
    builder = Builder()
    graph = builder.graph([Output("y", (1,), (builder.const(Fraction(2)),))])
    found = outputs(graph, {}, {}, 3, 2)["y"]

    assert found.value.tolist() == [[2.0]] * 3
    assert not found.slope.any()
