"""Verdicts, laws and self-tests are kept by all that they depend on: what changed is judged again, and nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

import awiwi_gen
from awiwi_gen import golden, judge
from awiwi_gen.cache import Cache
from awiwi_gen.judge import PartLaws, verdict_key
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, generate, verify
from awiwi_gen.records import values_of
from awiwi_gen.verify import physics

ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")
PATTERN = "jaw_[cmft]*"  # that of test_verify.py, so that its records are in the cache
JAW = "fingers.jaw"
ABOUT_TENDONS = {
    "the_coupling_is_the_derivative_of_the_tendon_lengths",
    "the_coupling_derivative_is_the_rate_of_the_coupling",
}


class OwnVerdicts(Cache):
    """The cache of all tests, but for what this file is about."""

    KINDS = ("verdicts", "laws", "proofs", "golden")

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.own = Cache(folder)

    def read(self, kind, digest):
        return self.own.read(kind, digest) if kind in self.KINDS else super().read(kind, digest)

    def write(self, kind, digest, data):
        return self.own.write(kind, digest, data) if kind in self.KINDS else super().write(kind, digest, data)


def job_of(text: str, store: Cache | None = None) -> Job:
    return Job(awiwi_gen.Hand.parse(text), only=PATTERN, store=store or Cache())


@pytest.fixture(scope="module")
def job():
    return job_of(ONE_FINGER)


@pytest.fixture(scope="module")
def part(job):
    return part_of(job)


def part_of(job: Job, **changes) -> PartLaws:
    """The laws of the finger."""
    ports = {name: port for kernel in job.catalog if kernel.path == JAW for name, port in kernel.inputs.items()}
    members = [(kernel, job.records[kernel.name]) for kernel in job.kernels if kernel.path == JAW]
    return PartLaws(members, ports | changes, job.options)


@pytest.fixture
def examined(monkeypatch):
    """Names of the kernels, laws and self-tests that are worked on."""
    found: list[str] = []
    for module, name, named in (
        (judge, "judge_record", lambda kernel, *_: [kernel.name]),
        (PartLaws, "check", lambda _, names: names),
        (golden, "_test", lambda kernel, *_: [f"test of {kernel.name}"]),
    ):
        original = getattr(module, name)

        def noted(*words, original=original, named=named, **more):
            found.extend(named(*words))
            return original(*words, **more)

        monkeypatch.setattr(module, name, noted)
    return found


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    assert before.keys() == after.keys()
    return {name for name in before if before[name] != after[name]}


# -- a run after a change -----------------------------------------------------------------------------------


def test_a_changed_number_and_an_edited_file_judge_what_depends_on_them_and_nothing_else(tmp_path, examined):
    store, directory = OwnVerdicts(tmp_path / "cache"), tmp_path / "c"
    first = job_of(ONE_FINGER, store)
    generate(first, directory)
    assert verify(first, directory).passed
    kernels = {kernel.name for kernel in first.kernels}
    assert set(examined) == kernels | set(part_of(first).keys) | {f"test of {name}" for name in kernels}

    examined.clear()
    second = job_of(ONE_FINGER.replace('radius = "9 mm"', 'radius = "8.5 mm"'), store)
    generate(second, directory)
    assert verify(second, directory).passed
    new = {name for name in kernels if first.records[name].digest != second.records[name].digest}
    assert {"jaw_coupling", "jaw_tendon_lengths", "jaw_tendon_distribution"} <= new < kernels
    assert not {"jaw_mass_matrix", "jaw_coriolis_matrix", "jaw_forward_dynamics"} & new
    assert set(examined) == new | {f"test of {name}" for name in new} | ABOUT_TENDONS

    examined.clear()
    file = directory / "jaw_tendon_stiffness.c"
    file.write_text(file.read_text() + "\n")
    assert verify(second, directory).passed
    assert set(examined) == {"jaw_tendon_stiffness", "jaw_tendon_distribution", "jaw_tendon_distribution_update"}


# -- verdicts -----------------------------------------------------------------------------------------------


def test_a_verdict_depends_on_its_record_its_objects_and_the_numbers_they_read(job, monkeypatch):
    record = job.records["jaw_coupling"]
    key = verdict_key(record, ["object"], "")

    assert key == verdict_key(record, ["object"], "")
    assert key != verdict_key(replace(record, digest="another"), ["object"], "")
    assert key != verdict_key(record, ["another"], "")
    assert key != verdict_key(record, ["object", "another"], "")
    assert key != verdict_key(record, ["object"], "numbers")
    monkeypatch.setattr(judge, "machine", lambda: "another")
    assert key != verdict_key(record, ["object"], "")


def test_what_the_c_of_a_kernel_calls_is_among_the_kernels_that_it_needs(hand, root):
    known, callers = {kernel.name: kernel for kernel in catalog(hand)}, 0
    for kernel in known.values():
        text = re.sub(r"/\*.*?\*/", "", (root / "generated" / f"{kernel.name}.c").read_text(), flags=re.DOTALL)
        called = {name for name in re.findall(rf"\b{hand.prefix}_(\w+)", text) if name in known} - {kernel.name}
        callers += bool(called)
        assert called <= set(kernel.needs.values())
        assert not any(known[name].needs for name in called)

    assert callers > 5


# -- laws ---------------------------------------------------------------------------------------------------


def test_a_law_depends_on_the_records_of_the_kernels_that_it_names_and_on_no_others(part):
    members = [
        (kernel, replace(record, digest="another") if kernel.family == "coupling_derivative" else record)
        for kernel, record in part.members
    ]
    found = changed(part.keys, replace(part, members=members).keys)

    assert found == {"the_coupling_derivative_is_the_rate_of_the_coupling"}


def test_a_law_depends_on_the_ranges_of_the_inputs_that_it_reads_and_on_no_others(job, part):
    q, h = (next(each.inputs[name] for each in job.catalog if name in each.inputs) for name in "qh")

    assert changed(part.keys, part_of(job, q=replace(q, high=0.1)).keys) == part.keys.keys()
    assert changed(part.keys, part_of(job, h=replace(h, high=0.1)).keys) == set()


def test_a_law_about_the_numbers_themselves_depends_on_them(hand, monkeypatch):
    job = Job(hand, only="wrist_points")
    ports = dict(job.kernels[0].inputs)
    before, after = (
        PartLaws([(each, job.records[each.name]) for each in job.kernels], ports, job.options) for _ in "12"
    )
    assert before.keys.keys() == {"the_bars_of_the_wrist_keep_their_lengths"}
    other = {path: value * 2 for path, value in values_of(job.kernels[0]).items()}
    before_keys = dict(before.keys)
    monkeypatch.setattr(judge, "values_of", lambda kernel: other)

    assert changed(before_keys, after.keys) == before_keys.keys()


def test_a_law_sees_no_kernel_and_no_input_but_those_that_are_in_its_key(part, monkeypatch):
    def it_reads_another_kernel(x, mass_matrix):
        return x.rate("coupling", "P", q=x.inputs["qd"]), physics.ONE

    def it_reads_another_input(x, mass_matrix):
        return x.inputs["f_min"], physics.ONE

    for law, missing in ((it_reads_another_kernel, "coupling"), (it_reads_another_input, "f_min")):
        monkeypatch.setattr(physics, "LAWS", {law.__name__: law})
        with pytest.raises(KeyError, match=missing):
            replace(part).check([law.__name__])


def test_a_mass_matrix_that_is_hardly_positive_breaks_its_law(part, monkeypatch):
    law, matrix = "the_mass_matrix_is_positive_definite", physics.Motion.at
    assert part.check([law])[law].passed
    for change in (lambda M: M - M, lambda M: -M, lambda M: M * float("nan")):
        monkeypatch.setattr(
            physics.Motion, "at", lambda x, family, change=change: {"M": change(matrix(x, family)["M"])}
        )
        assert not part.check([law])[law].passed


# -- the catalogue ------------------------------------------------------------------------------------------


def test_hands_that_differ_in_a_number_have_kernels_with_their_own_numbers():
    hands = [awiwi_gen.Hand.parse(text) for text in (ONE_FINGER, ONE_FINGER.replace('mass = "5 g"', 'mass = "6 g"'))]
    masses = [values_of(catalog(hand)[1])["links[0].mass"] for hand in hands]

    assert [float(mass) for mass in masses] == [0.005, 0.006]
