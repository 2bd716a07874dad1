"""Calibration without a compiler: numbers in a flat file, read by C that was compiled before."""

from __future__ import annotations

import json
import re
import struct
import zlib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from actuators import AWIWI
from commands import ONE_FINGER
from samples import ONE_FINGER as TEXT
from samples import points

import awiwi_gen
from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.emit.params_file import pack
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.errors import InputError
from awiwi_gen.ir.exact import exact_values
from awiwi_gen.parameters import numbers_file
from awiwi_gen.pipeline import Job, cached_tree, derive, verify
from awiwi_gen.records import load_graphs, prepare, values_of

RUNTIME = Options(params="runtime")
STATUS = (
    "ok", "too short", "bad magic", "bad version", "bad size", "bad crc", "wrong scalar", "wrong model", "wrong count",
    "not finite", "out of range", "unusable",
)  # fmt: skip
HEADER = 64


def calibrated(*changes: tuple[str, str]):
    """The finger with other numbers."""
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return awiwi_gen.Hand.parse(text)


@pytest.fixture(scope="module", params=["f64", "f32"])
def tree(request) -> Path:
    return cached_tree(Job(awiwi_gen.Hand.load(ONE_FINGER), Options(request.param, "runtime"), "jaw_*"))


@pytest.fixture
def finger(tree):
    return load(tree)


def file_of(tree, hand=None) -> bytes:
    return numbers_file(hand or awiwi_gen.Hand.load(ONE_FINGER), read_manifest(tree), str(tree)).data


def loaded(finger, data: bytes, size: int | None = None):
    """The status of loading a file at an odd address, and the struct afterwards."""
    out = finger.ffi.new("claw_params *")
    finger.ffi.buffer(out)[:] = b"\x55" * finger.ffi.sizeof("claw_params")
    place = finger.ffi.new("unsigned char[]", b"\0" + data)
    status = finger.c.claw_params_load(place + 1, len(data) if size is None else size, out)
    return STATUS[status], out


def sealed(data: bytes) -> bytes:
    """The file with the CRC that its bytes have."""
    crc = zlib.crc32(data[:60] + data[HEADER:])
    return data[:60] + struct.pack("<I", crc) + data[HEADER:]


def replaced(data: bytes, place: int, new: bytes) -> bytes:
    return data[:place] + new + data[place + len(new) :]


def test_c_reads_the_numbers_that_python_wrote(tree, finger):
    hand = calibrated(('"9 mm"', '"9.1 mm"'), ('mass = "5 g"', 'mass = "5.2 g"'))

    status, out = loaded(finger, file_of(tree, hand))

    assert status == "ok"
    assert out.numbers.fingers_jaw_pulleys_0_radius == finger.dtype.type(0.0091)
    found = np.frombuffer(finger.ffi.buffer(finger.ffi.addressof(out, "numbers")), finger.dtype)
    wanted = [float(hand.quantities()[e["path"]].value) for e in finger.manifest["params"]["numbers"]]
    assert np.array_equal(found, np.array(wanted, finger.dtype))


@pytest.mark.parametrize(
    ("place", "status"),
    [(0, "bad magic"), (7, "bad magic"), (8, "bad version"), (12, "bad crc"), (16, "bad crc"), (20, "bad size"),
     (24, "bad crc"), (55, "bad crc"), (56, "bad crc"), (60, "bad crc"), (64, "bad crc"), (-1, "bad crc")],
)  # fmt: skip
def test_a_damaged_byte_is_refused_and_nothing_is_written(tree, finger, place, status):
    data = file_of(tree)
    place %= len(data)
    for bit in range(8):
        found, out = loaded(finger, replaced(data, place, bytes([data[place] ^ 1 << bit])))

        assert found == status
        assert set(bytes(finger.ffi.buffer(out))) == {0x55}


@pytest.mark.parametrize(
    ("place", "new", "status"),
    [(12, b"\x02", "wrong scalar"), (24, b"other", "wrong model"), (16, b"\x01", "wrong count"),
     (HEADER, "nan", "not finite"), (HEADER, "inf", "not finite"), (HEADER, "1e30", "out of range"),
     (HEADER, "-1", "out of range")],
)  # fmt: skip
def test_an_undamaged_file_of_something_else_is_refused(tree, finger, place, new, status):
    if isinstance(new, str):
        new = finger.dtype.type(new).tobytes()

    found, out = loaded(finger, sealed(replaced(file_of(tree), place, new)))

    assert found == status
    assert set(bytes(finger.ffi.buffer(out))) == {0x55}


def test_a_file_that_was_cut_off_is_refused(tree, finger):
    data = file_of(tree)

    assert loaded(finger, data, 0)[0] == loaded(finger, data, HEADER - 1)[0] == "too short"
    assert loaded(finger, data, HEADER)[0] == loaded(finger, data, len(data) - 1)[0] == "bad size"
    assert STATUS[finger.c.claw_params_load(finger.ffi.NULL, len(data), finger.ffi.NULL)] == "too short"


def test_numbers_that_do_not_fit_each_other_are_refused(tree, finger):
    layout = read_manifest(tree)["params"]
    given = awiwi_gen.Hand.load(ONE_FINGER).quantities()
    values = [given[e["path"]].value for e in layout["numbers"]]
    place = [e["path"] for e in layout["numbers"]].index("fingers.jaw.links[0].four_bar.ground")
    values[place] = Fraction(9, 10)  # far from the crank: the loop cannot close

    found, out = loaded(finger, pack(values, layout["digest"], Options(tree_scalar(finger), "runtime")))

    assert found == "unusable"
    assert set(bytes(finger.ffi.buffer(out))) == {0x55}


def tree_scalar(finger) -> str:
    return "f64" if finger.dtype == np.float64 else "f32"


def test_a_calibrated_kernel_computes_what_regenerated_constants_compute():
    hand = calibrated(('"9 mm"', '"9.3 mm"'), ('mass = "4 g"', 'mass = "4.1 g"'))
    baked = load(cached_tree(Job(hand, Options(), "jaw_*")))
    runtime = load(cached_tree(Job(awiwi_gen.Hand.load(ONE_FINGER), RUNTIME, "jaw_*")))
    numbers = [float(hand.quantities()[e["path"]].value) for e in runtime.manifest["params"]["numbers"]]
    other = runtime.with_numbers(numbers)
    differs = []
    for name, kernel in baked.items():
        arguments = points(kernel, 50)
        results = [lib[name](*arguments) for lib in (baked, other, runtime)]
        wanted, found, before = (r if isinstance(r, tuple) else (r,) for r in results)
        for a, b, c in zip(wanted, found, before, strict=True):
            if np.isfinite(a).all():
                np.testing.assert_allclose(b, a, rtol=1e-9, atol=1e-12 * np.abs(a).max())
            differs += [name] * (not np.allclose(c, a, rtol=1e-6, equal_nan=True))

    assert {"jaw_coupling", "jaw_joint_torque", "jaw_tendon_lengths"} <= set(differs)


def test_joint_limits_are_numbers_too():
    """The thumb's estimate stays within its limits, also within those of another file."""
    hand = awiwi_gen.Hand.load()
    thumb = load(cached_tree(Job(hand, RUNTIME, "thumb_joint_estimate")))
    paths = [entry["path"] for entry in thumb.manifest["params"]["numbers"]]
    values = [float(hand.quantities()[path].value) for path in paths]
    first = paths.index("fingers.thumb.links[0].high")
    lengths = thumb.thumb_tendon_lengths([values[first], 0.1, 0.1, 0.1])
    values[first] /= 2

    found = thumb.with_numbers(values).thumb_joint_estimate(lengths, np.full(4, 0.1)).q

    assert thumb.thumb_joint_estimate(lengths, np.full(4, 0.1)).q[0] > 1.5 * values[first]
    assert found[0] == values[first]


@pytest.mark.parametrize(("file", "only"), [(ONE_FINGER, "*"), (None, "index_*")])
def test_kernels_and_derived_numbers_are_proved_with_the_hands_numbers_and_with_others(file, only):
    job = Job(awiwi_gen.Hand.load(file), RUNTIME, only)

    proof = verify(job, cached_tree(job))

    assert [verdict.name for verdict in proof.verdicts][-1] == "params_derive"
    assert not [(verdict.name, verdict.reasons) for verdict in proof.verdicts if not verdict.passed]
    assert all(record.varied for record in job.records.values() if record.graph and record.graph.params)


def test_runtime_kernels_cost_hardly_more_than_baked_ones():
    hand = awiwi_gen.Hand.load()
    costs = [
        {e["name"]: e["cost"] for e in read_manifest(cached_tree(Job(hand, options, "index_*")))["kernels"]}
        for options in (Options(), RUNTIME)
    ]
    ratios = {
        name: costs[1][name]["operations"] / cost["operations"]
        for name, cost in costs[0].items()
        if cost["operations"] > 50
    }

    assert len(ratios) > 8
    assert max(ratios.values()) <= 1.1
    assert all(costs[1][name]["sincos"] == cost["sincos"] for name, cost in costs[0].items())


def test_runtime_kernels_cost_what_baked_ones_cost_where_no_numbers_are_equal():
    chance = np.random.default_rng(3)

    def moved(length: re.Match) -> str:  # zero is structure
        return f'"{float(length[1]) + chance.uniform(-0.3, 0.3):.3f} mm"' if float(length[1]) else length[0]

    lines = AWIWI.splitlines()
    lines = [re.sub(r'"(-?[\d.]+) mm"', moved, x) if "forearm =" in x or "span =" in x else x for x in lines]
    hand = awiwi_gen.Hand.parse("\n".join(lines))
    for name in ("wrist_tendon_lengths", "thumb_joint_torque"):
        baked, runtime = (
            Job(hand, options, name).records[name].function.cost.operations for options in (Options(), RUNTIME)
        )
        assert runtime <= 1.02 * baked


@pytest.mark.parametrize("at", ["4 mm", "0 mm"])
def test_what_is_zero_whatever_the_numbers_are_is_no_number_to_divide_by(at):
    """The frame beyond a four-bar has coefficients such as 2 a b/(2 b) - a, from a straight line that ends there."""
    ends = f'{{ link = "palm", at = ["5 mm", "6 mm", "0 mm"] }}, {{ link = "end", at = ["3 mm", "4 mm", "{at}"] }}'
    rolled = '{ rest = "0 mm", over = ["-mid"], source = "assumed" }'
    hand = calibrated((rolled, f'{rolled}, {{ rest = "0 mm", path = [{ends}], source = "assumed" }}'))
    job = Job(hand, RUNTIME, "jaw_coupling_derivative")
    derive(job)
    (kernel,) = job.kernels
    for route, graph in load_graphs(kernel, job.store).items():
        derivation = prepare({route: graph}, values_of(kernel), RUNTIME).derivation
        assert derivation is not None

        derived = exact_values(derivation, values_of(kernel))

        assert len(derived) > 10
        assert [path for path, value in derived.items() if abs(value) < 1e-30] == []


def test_the_struct_has_only_numbers_that_are_read(tree):
    texts = "".join(path.read_text() for path in tree.glob("*.c"))
    for entry in read_manifest(tree)["params"]["numbers"]:
        field = entry["path"].replace("[", "_").replace("]", "").replace(".", "_")
        assert f"numbers->{field}" in texts or f"numbers.{field}" in texts, field


def test_a_zero_is_structure_and_its_change_is_refused_with_its_name(tree):
    hand = calibrated(('"30 mm", "0 mm"', '"30 mm", "1 mm"'))

    with pytest.raises(
        InputError, match=r"fingers\.jaw\.links\[0\]\.offset\[1\] = 1 mm is zero in the hand .* constant"
    ):
        file_of(tree, hand)


def test_another_structure_is_refused(tree):
    hand = calibrated(('over = ["-mid"]', 'over = ["-mid", "+root"]'))

    with pytest.raises(InputError, match="was made from a hand with another structure"):
        file_of(tree, hand)


def test_constants_need_no_file():
    baked = cached_tree(Job(awiwi_gen.Hand.load(ONE_FINGER), Options(), "jaw_*"))

    with pytest.raises(InputError, match=r"read no numbers at run time; expected .* --params runtime"):
        file_of(baked)
    assert not (baked / "params.c").exists()


def test_the_command_writes_the_file_and_lists_the_numbers(tree, tmp_path, capsys):
    from typer.testing import CliRunner

    from awiwi_gen.__main__ import app

    target = tmp_path / "finger.bin"
    words = ["params", "--hand", ONE_FINGER, "--generated", str(tree)]
    done = CliRunner().invoke(app, [*words, "-o", str(target), "--json"])
    listed = CliRunner().invoke(app, words)

    assert done.exit_code == listed.exit_code == 0
    assert target.read_bytes() == file_of(tree)
    numbers = {row["path"]: row for row in json.loads(done.stdout)["numbers"]}
    radius = numbers["fingers.jaw.pulleys[0].radius"]
    assert (radius["value"], radius["unit"], radius["low"], radius["high"]) == (0.009, "m", 1e-05, 1.0)
    assert "fingers.jaw.pulleys[0].radius" in listed.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["finger.bin"]
