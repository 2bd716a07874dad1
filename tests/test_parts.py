"""A part of the kernels: in a folder of its own, or in one of all kernels that stays one of all kernels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.errors import OutputError
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, generate, state, verify

ONE_FINGER = Path(__file__).with_name("one_finger.toml")
PART = "jaw_tendon_lengths"


@pytest.fixture(scope="module")
def job() -> Job:
    return Job(Hand.load(ONE_FINGER))


@pytest.fixture
def part(job) -> Job:
    return replace(job, only=PART)


@pytest.fixture
def whole(job, tmp_path) -> Path:
    generate(job, tmp_path / "generated")
    return tmp_path / "generated"


def files(directory: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def test_a_part_of_a_fresh_directory_is_fresh_and_nothing_is_deleted(whole, part):
    before = files(whole)

    assert state(part, whole).fresh
    assert generate(part, whole) is False
    assert files(whole) == before


@pytest.mark.parametrize("damage", [lambda path: path.write_text("/* faster */"), Path.unlink])
def test_a_part_is_written_again_where_the_rest_is_fresh(whole, job, part, damage):
    before = files(whole)
    damage(whole / f"{PART}.c")

    assert generate(part, whole) is True
    assert files(whole) == before
    assert state(job, whole).fresh


def test_a_part_is_refused_where_the_rest_is_edited(whole, part):
    (whole / "jaw_mass_matrix.c").write_text("/* faster */")
    before = files(whole)

    with pytest.raises(OutputError) as caught:
        generate(part, whole)
    assert str(caught.value) == (
        f"{whole} holds all kernels and more of it is out of date (jaw_mass_matrix.c); "
        f"leave out --only {PART}, or choose another place with -o"
    )
    assert files(whole) == before


def test_a_part_is_refused_where_the_rest_is_of_another_hand(whole, part, tmp_path):
    other = tmp_path / "other.toml"
    other.write_text(ONE_FINGER.read_text().replace('"9 mm"', '"9.5 mm"'))
    before = files(whole)

    with pytest.raises(OutputError, match=r"holds all kernels and more of it is out of date \(hand\)"):
        generate(replace(part, source=Hand.load(other)), whole)
    assert files(whole) == before


def test_another_part_is_refused_and_all_kernels_are_not(job, part, tmp_path):
    directory = tmp_path / "generated"
    generate(part, directory)
    with pytest.raises(
        OutputError, match=f"holds the kernels of --only {PART}; leave out --only jaw_energy, or choose"
    ):
        generate(replace(job, only="jaw_energy"), directory)
    assert state(part, directory).fresh

    assert generate(job, directory) is True
    assert len(read_manifest(directory)["kernels"]) == len(job.kernels) > 1


def test_a_part_of_all_kernels_is_verified(whole, part):
    assert [verdict.name for verdict in verify(part, whole).verdicts] == [PART]
