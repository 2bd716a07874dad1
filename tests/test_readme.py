"""Every line and number that README prints: from the proof, the generated C, the hand, the installed libraries."""

from __future__ import annotations

import re
import shlex
import sys
from importlib import metadata
from pathlib import Path

import pytest
from commands import run, told
from packaging.requirements import Requirement

from awiwi_gen.budget import SLACK
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.kernels import catalog
from awiwi_gen.library import Library
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.simulate import PERIOD

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDES = [ROOT / "docs" / f"{name}.md" for name in ("quick_start", "designer", "firmware_engineer", "learner")]
ENVIRONMENT = 32  # MB of a virtual environment with nothing but pip and setuptools
COLUMN = re.compile(r"^\| `pip install '?awiwi_gen(\[\w+\])?'?` \| (\d+) \|", re.MULTILINE)


def blocks(after: str) -> list[str]:
    """The lines of the first block of code after a text."""
    return re.search(r"```\w*\n(.*?)```", README[README.index(after) :], re.DOTALL)[1].splitlines()


def test_the_proof_sheet_has_the_rows_that_are_printed():
    said = told("verify", "-o", ROOT / "generated").splitlines()

    assert [line for line in blocks("A few rows of what `make` prints") if line not in (*said, "...")] == []
    assert max(map(len, said)) <= 80


def test_the_lines_of_c_are_those_of_the_generated_file():
    file = (ROOT / "generated/index_joint_torque.c").read_text(encoding="utf-8").splitlines()
    shown = [line.removeprefix("/*").removeprefix(" *").strip() for line in blocks("and a few lines of the C")]

    assert [line for line in shown if line not in ("...", "/") and not any(line in each for each in file)] == []


def test_the_counts_are_those_of_the_hand(hand):
    assert sum(len(finger.joints) for finger in hand.fingers.values()) == 19
    assert "has 19 joints pulled by 38 antagonistic tendons" in README
    assert hand.tendons == 38
    assert "at 3 kHz in firmware" in README
    assert round(1 / PERIOD) == 3000
    assert "runs nine laws on a joint" in README
    assert len(LAWS) == 9
    assert f"{len(catalog(hand))} kernels of the Awiwi hand" in (ROOT / "docs/quick_start.md").read_text()


def test_the_number_of_processors_is_that_of_the_targets():
    from tests.targets.toolchains import TARGETS

    processors = {re.sub(r" .*", "", target.name) for target in TARGETS}
    compilers = {target.compiler.rpartition("-")[2] for target in TARGETS}
    assert "seven\nprocessors and two compilers" in README
    assert (len(processors), len(compilers)) == (7, 2)


def test_the_budget_allows_what_is_written():
    assert f"dearer by more than {SLACK:.0%}".replace("%", " %") in README


def test_the_error_that_is_printed_is_that_of_the_reader(tmp_path):
    file = tmp_path / "my_hand.toml"
    text = (ROOT / "awiwi_gen/hand.toml").read_text(encoding="utf-8")
    head, finger = text.split("[fingers.index]")
    file.write_text(head + "[fingers.index]" + finger.replace('"9 mm"', '"6.2 N"', 1), encoding="utf-8")
    done = run("check", "--hand", file)

    assert done.stderr.replace(f"{tmp_path}/", "").splitlines()[0] in README


def distributions() -> dict[str, metadata.Distribution]:
    """What is installed here."""
    return {each.metadata["Name"].lower().replace("_", "-"): each for each in metadata.distributions()}


def needed(requirement: str, extra: str, known: dict[str, metadata.Distribution], seen: set[str]) -> set[str]:
    """All libraries that an installation brings."""
    wanted = Requirement(requirement)
    if wanted.marker and not wanted.marker.evaluate({"extra": extra}):
        return seen
    name = wanted.name.lower().replace("_", "-")
    for each in wanted.extras or {""}:
        if f"{name}[{each}]" not in seen:
            seen.add(f"{name}[{each}]")
            for below in (known[name].requires or []) if name in known else ():
                needed(below, each, known, seen)
    return seen


@pytest.mark.parametrize(("extra", "megabytes"), COLUMN.findall(README))
def test_an_installation_has_the_size_that_is_written(extra, megabytes):
    known = distributions()
    names = {each.partition("[")[0] for each in needed(f"awiwi_gen{extra}", "", known, set())} - {"awiwi-gen"}
    assert names <= known.keys()
    files = {file.locate() for name in names for file in known[name].files or ()}
    size = sum(Path(file).stat().st_size for file in files if Path(file).exists()) / 1e6

    assert size + ENVIRONMENT == pytest.approx(float(megabytes), rel=0.06)


def test_the_table_of_installations_is_read():
    assert len(COLUMN.findall(README)) == 6  # of two, libraries are missing in the environment of make


@pytest.mark.skipif(Path(sys.prefix) != ROOT / ".venv", reason="runs in another environment than that of make")
def test_the_environment_of_make_needs_the_disk_that_is_written():
    size = sum(path.lstat().st_size for path in Path(sys.prefix).rglob("*") if path.is_file() and not path.is_symlink())

    assert float(re.search(r"([\d.]+) GB of disk for `.venv/`", README)[1]) == pytest.approx(size / 1e9, abs=0.08)


@pytest.mark.parametrize("document", [ROOT / "README.md", *GUIDES], ids=lambda path: path.name)
def test_every_command_within_a_sentence_has_its_options(document):
    commands = re.findall(r"`awiwi-gen ([a-z].*?)`", document.read_text(encoding="utf-8"), re.DOTALL)
    for line in commands:
        command, *words = shlex.split(line.replace("\n", " "))
        known = run(command, "--help").output
        assert [w for w in words if w.startswith("--") and not re.search(rf"{w}\b", known)] == [], line


def test_lines_of_c_that_are_named_are_statements():
    for document in (ROOT / "README.md", *GUIDES):
        for file, number in re.findall(r"--line generated/(\w+\.c):(\d+)", document.read_text(encoding="utf-8")):
            line = (ROOT / "generated" / file).read_text(encoding="utf-8").splitlines()[int(number) - 1]
            assert line.startswith("    ")
            assert line.endswith(";")


def test_every_kernel_that_is_named_exists():
    names = {entry["name"] for entry in read_manifest(ROOT / "generated")["kernels"]}
    for document in (ROOT / "README.md", *GUIDES):
        text = document.read_text(encoding="utf-8")
        called = re.findall(r"awiwi-gen (?:explain|call) ([a-z]\w+)\b|lib(?:\.|\[\")(\w+)", text)
        unknown = {name for pair in called for name in pair if name} - names
        assert [name for name in unknown if not hasattr(Library, name)] == []
