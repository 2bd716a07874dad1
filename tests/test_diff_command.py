"""The command `diff`: files and revisions, bad input, and what is printed and drawn."""

from __future__ import annotations

import itertools
import math
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
from actuators import AWIWI
from commands import answer, complaint, run, told
from edited_hands import RADIUS, TEXT, edited

from awiwi_gen.diff import hands


@pytest.fixture
def files(tmp_path) -> tuple[Path, Path]:
    old, new = tmp_path / "old.toml", tmp_path / "new.toml"
    old.write_text(TEXT, encoding="utf-8")
    new.write_text(edited(TEXT, RADIUS, "9.09 mm"), encoding="utf-8")
    return old, new


def test_equal_files_differ_in_nothing(files):
    found = answer("diff", files[0], files[0])

    assert [found[key] for key in ("values", "figures", "kernels", "effects", "fingers")] == [[]] * 5
    assert found["appear"] == found["vanish"] == found["only"] == {}
    assert "nothing changes" in told("diff", files[0], files[0])


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
    old, new = tmp_path / "old.toml", tmp_path / "new.toml"
    old.write_text(AWIWI, encoding="utf-8")
    text = edited(AWIWI, "fingers.fifth.links[0].four_bar.crank", "10.1 mm")
    new.write_text(edited(text, "fingers.thumb.pulleys[0].radius", "8.1 mm"), encoding="utf-8")
    lines = told("diff", old, new, "--finger", "fifth").splitlines()
    tables = [
        line for line in told("diff", old, new, "--finger", "fifth", "--markdown").splitlines() if line.startswith("|")
    ]

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
