"""hand.h: its numbers are those of the hand file, its names are in the order of the kernels' arrays."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest
from samples import ONE_FINGER

import awiwi_gen
from awiwi_gen.build import WARNINGS, compiler
from awiwi_gen.emit.names import csrc_names
from awiwi_gen.emit.options import Options
from awiwi_gen.hand_header import base_pose, enumerators
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC

FEW = "index_gravity,ring_gravity,spring_force"
BASE = """
[fingers.jaw.base]
position = ["10 mm", "-2 mm", "3 mm"]
rpy = ["90 deg", "0 deg", "30 deg"]
source = "assumed"
"""


def tree(text: str | None = None, options: Options | None = None, only: str = FEW):
    hand = awiwi_gen.Hand.load() if text is None else awiwi_gen.Hand.parse(text)
    return cached_tree(Job(hand, options or Options(), only))


def run(directory, body: str, scratch, *files: str, language: str = "-std=c99", include=None):
    """What a program prints that has hand.h and is linked with the files."""
    main, program = scratch / "main.c", scratch / "program"
    headers = ("<stdio.h>", '"awiwi.h"', '"hand.h"', '"self_test.h"')
    includes = "".join(f"#include {header}\n" for header in headers)
    main.write_text(f"{includes}int main(void)\n{{\n{body}\n}}\n")
    flags = (language, *WARNINGS, f"-I{include or directory}", f"-I{directory}", f"-I{CSRC}", "-c")
    compiler().run(*flags, str(main), "-o", str(scratch / "main.o"))
    sources = [str(directory / name) for name in files]
    own = ("-std=c99", "-ffp-contract=off", f"-I{directory}", f"-I{CSRC}")
    compiler().run(*own, str(scratch / "main.o"), *sources, *map(str, CSRC.glob("*.c")), "-lm", "-o", str(program))
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.parametrize("options", [Options(), Options(scalar="f32")], ids=["double", "single"])
def test_the_numbers_are_those_of_the_hand(options, tmp_path):
    hand, places = awiwi_gen.Hand.load(), range(19)
    body = "".join(
        f'for (int i = 0; i < {count}; i++) printf("%.17g ", (double)awiwi_{name}[i]);\n'
        for name, count in (("joint_low", "AWIWI_JOINTS"), ("joint_high", "AWIWI_JOINTS"), ("pulley_radius", "AWIWI_JOINTS"),
                            ("sensor_slack", "AWIWI_TENDONS"))
    )  # fmt: skip
    printed = run(tree(options=options), body + "return 0;", tmp_path, "hand.c")
    found = np.array(printed, options.dtype)

    links = [(f, k) for f in hand.fingers.values() for k in f.links if k.joint in f.joints]
    expected = [[k.low for _, k in links], [k.high for _, k in links], [f.radii.get(k.joint, 0) for f, k in links]]
    assert np.array_equal(found[: 3 * len(places)], np.array(expected, float).ravel().astype(options.dtype))
    assert np.array_equal(found[3 * len(places) :], [float(hand.spring.sensor.slack)] * 38)


def test_names_lead_to_the_places_of_whole_hand_arrays(tmp_path):
    hand = awiwi_gen.Hand.load()
    rows, columns = hand.blocks["ring"]
    numbers = (
        "FIRST_JOINT_OF_RING", "JOINTS_OF_RING", "FIRST_TENDON_OF_RING", "TENDONS_OF_RING", "JOINT_RING_PIP",
        "TENDON_RING_5", "FINGER_RING",
    )  # fmt: skip
    prints = [f'printf("%d ", (int)AWIWI_{name});' for name in numbers]
    body = "\n".join([*prints, 'printf("%s %s", AWIWI_SCALAR, AWIWI_PARAMS);', "return 0;"])

    found = run(tree(), body, tmp_path, "hand.c")

    assert [int(x) for x in found[:4]] == [columns.start, 3, rows.start, 6]
    assert [int(x) for x in found[4:7]] == [columns.start + 2, rows.stop - 1, 3]
    assert found[7:] == ["f64", "baked"]


def test_the_header_is_cpp(tmp_path):
    (tmp_path / "main.cpp").write_text(
        '#include "awiwi.h"\n#include "hand.h"\n#include "self_test.h"\nint main() { return awiwi_self_test(0); }\n'
    )
    flags = ("-x", "c++", "-std=c++98", "-Wall", "-Wextra", "-Werror", f"-I{tree()}", f"-I{CSRC}", "-c")
    compiler().run(*flags, str(tmp_path / "main.cpp"), "-o", str(tmp_path / "main.o"))


def test_headers_of_another_build_are_found_by_the_self_test(tmp_path):
    single = tree(options=Options(scalar="f32"))
    files = ("hand.c", "model.c", "self_test.c", "index_gravity.c", "ring_gravity.c", "spring_force.c")
    body = 'const char *f = ""; int n = awiwi_self_test(&f); printf("%d %s", n, f ? f : "none"); return 0;'

    assert run(tree(), body, tmp_path, *files) == ["0", "none"]
    assert run(tree(), body, tmp_path, *files, include=single) == ["-2", "headers"]


def test_every_option_and_number_has_a_build_of_its_own():
    texts = [ONE_FINGER, ONE_FINGER.replace('"6 mm"', '"6.5 mm"')]
    builds = [tree(text, options, "jaw_j*") for text in texts for options in (Options(), Options(scalar="f32"))]
    builds.append(tree(ONE_FINGER, Options(math="libm"), "jaw_j*"))
    builds.append(tree(ONE_FINGER, Options(params="runtime"), "jaw_j*"))
    builds.append(tree(ONE_FINGER, Options(), "jaw_gravity"))

    digests = [re.search(r'BUILD_DIGEST "(\w+)"', (build / "hand.h").read_text())[1] for build in builds]
    assert len({*digests}) == len(builds)


def test_a_base_is_a_pose_with_exact_quarter_turns():
    finger = awiwi_gen.Hand.parse(ONE_FINGER + BASE).fingers["jaw"]
    pose, half, root = np.reshape(base_pose(finger), (4, 4)), 0.5, np.sqrt(0.75)

    expected = [[root, 0, half, 0.01], [half, 0, -root, -0.002], [0, 1, 0, 0.003], [0, 0, 0, 1]]
    np.testing.assert_allclose(pose, expected, rtol=0, atol=2e-16)
    assert pose[0, 1] == pose[1, 1] == pose[2, 0] == 0
    assert np.array_equal(np.reshape(base_pose(awiwi_gen.Hand.parse(ONE_FINGER).fingers["jaw"]), (4, 4)), np.eye(4))


def test_what_a_tick_needs_is_there(tmp_path):
    text = (
        ONE_FINGER.replace("[limits]", '[clock]\nperiod = "250 us"\nsource = "assumed"\n\n[limits]')
        .replace('joint = "mid"\nturn', 'joint = "mid"\neffort = "0.25 N m"\nturn')
    )  # fmt: skip
    body = 'printf("%g %g %g", CLAW_PERIOD, claw_joint_effort[0], claw_joint_effort[CLAW_JOINT_JAW_MID]); return 0;'

    directory = tree(text, only="jaw_gravity")
    assert run(directory, body, tmp_path, "hand.c") == ["0.00025", "1", "0.25"]
    plain = tree(ONE_FINGER, only="jaw_gravity")
    differ = {p.name for p in directory.glob("*.[ch]") if p.read_bytes() != (plain / p.name).read_bytes()}
    assert differ == {"hand.h", "hand.c"}
    assert Job(awiwi_gen.Hand.parse(text)).inputs["tick"] != Job(awiwi_gen.Hand.parse(ONE_FINGER)).inputs["tick"]


def test_equal_names_are_told_apart_by_their_places():
    pairs = [("a_b", "c"), ("a", "b_c"), ("a", "b")]

    assert enumerators(pairs) == ["A_B_C_0", "A_B_C_1", "A_B"]


def test_a_hand_without_motors_and_tendons_has_no_such_numbers(tmp_path):
    header = (
        tree(re.sub(r"tendons = \[.*?\n\]\n", "", ONE_FINGER, flags=re.DOTALL), only="jaw_*") / "hand.h"
    ).read_text()

    assert "CLAW_TENDONS 0" in header
    assert not re.findall(r"tendon_low|MOTOR|TENDON_JAW", header)


def test_its_names_are_none_of_the_solvers():
    header = (tree() / "hand.h").read_text()
    names = {*re.findall(r"\bawiwi_\w+|\bAWIWI_\w+", re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL))}

    assert len(names) > 100
    assert not names & {*csrc_names()}
    assert not [
        name for name in csrc_names() if re.match(r"AWIWI_(FINGER|JOINT|FIRST|MOTOR|BUILD|TENDON\w*_\d+$)", name)
    ]
