"""The generated directory: its state is described, files of others are never touched."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from trees import INPUTS, contents, litter, version

from awiwi_gen.emit import exchange
from awiwi_gen.emit.exchange import MANIFEST, clear
from awiwi_gen.emit.tree import State, inspect, install, require_place, sealed, sha256
from awiwi_gen.errors import OutputError
from awiwi_gen.report import state_lines

MEND = "awiwi-gen generate -o generated"


def said(directory: Path, inputs: dict[str, str] = INPUTS) -> str:
    return "\n".join(state_lines(inspect(directory, inputs), "generated", MEND))


# ------------------------------------------------------------------------------------------------- freshness


def test_what_was_just_installed_is_fresh(tree):
    assert inspect(tree, INPUTS) == State()
    assert said(tree) == "generated: fresh"


def test_a_directory_that_is_not_there_is_told_how_to_make(tmp_path):
    assert said(tmp_path / "nowhere") == f"generated: nothing generated here yet\nto fix it: {MEND}"


def test_an_edited_file_is_named(tree):
    (tree / "kernel1.c").write_text("/* faster! */")

    assert inspect(tree, INPUTS) == State(edited=("kernel1.c",))
    assert said(tree) == (
        f"generated/kernel1.c: edited by hand; changes belong in the hand file\nto fix it: {MEND}"
    )  # fmt: skip


def test_a_lost_file_is_named(tree):
    (tree / "kernel2.c").unlink()

    assert inspect(tree, INPUTS) == State(lost=("kernel2.c",))
    assert said(tree) == f"generated/kernel2.c: missing\nto fix it: {MEND}"


@pytest.mark.parametrize("is_directory", [False, True])
def test_a_foreign_file_is_named_and_its_owner_told_to_move_it(tree, is_directory):
    (tree / "notes.txt").mkdir() if is_directory else (tree / "notes.txt").write_text("mine")

    assert inspect(tree, INPUTS) == State(foreign=("notes.txt",))
    assert said(tree) == (
        f"generated/notes.txt: not generated; it does not belong here\nto fix it: move that away, then {MEND}"
    )  # fmt: skip


def test_files_below_a_directory_are_known_by_their_places(tmp_path):
    tree = tmp_path / "generated"
    texts = {"a.c": "a", "batches/a.c": "aa", "batches/b.c": "bb", "batches/c.c": "cc"}
    manifest = {"inputs": INPUTS, "files": {name: sha256(text) for name, text in texts.items()}}
    install(tree, {**texts, MANIFEST: sealed(manifest)})
    assert inspect(tree, INPUTS) == State()

    (tree / "batches" / "a.c").write_text("faster")
    (tree / "batches" / "b.c").unlink()
    (tree / "batches" / "mine.c").write_text("mine")
    (tree / "mine").mkdir()
    assert inspect(tree, INPUTS) == State(
        edited=("batches/a.c",), lost=("batches/b.c",), foreign=("batches/mine.c", "mine")
    )
    with pytest.raises(OutputError, match=r"\(batches/mine.c, mine\)"):
        install(tree, version("new"))
    (tree / "batches" / "mine.c").unlink()
    (tree / "mine").rmdir()
    install(tree, version("new"))
    assert contents(tree) == version("new")


@pytest.mark.parametrize(
    ("changed", "reason"),
    [("hand", "hand file"), ("generator", "version of awiwi_gen"), ("libraries", "set of libraries")],
)
def test_a_stale_directory_says_what_has_changed(tree, changed, reason):
    assert said(tree, {**INPUTS, changed: "another"}) == (
        f"generated: stale, another {reason} than it was made from\nto fix it: {MEND}"
    )


def test_all_that_is_wrong_is_told_at_once(tree):
    (tree / "kernel0.c").write_text("edited")
    (tree / "kernel1.c").unlink()
    (tree / "mine.c").write_text("mine")

    assert inspect(tree, {**INPUTS, "hand": "h2"}) == State(
        edited=("kernel0.c",), lost=("kernel1.c",), foreign=("mine.c",), stale=("hand",)
    )


@pytest.mark.parametrize(
    "text", ["", "not json", "[]", '{"files": 3}', "\x00", "[" * 100_000, '{"files": {"thesis.tex": "00"}}', "\ud800"]
)
def test_a_manifest_that_is_damaged_or_not_ours_is_refused_and_named(tree, text):
    (tree / MANIFEST).write_text(text, errors="surrogatepass")

    for attempt in (lambda: inspect(tree, INPUTS), lambda: install(tree, version("new")), lambda: require_place(tree)):
        with pytest.raises(OutputError, match=r"manifest.json is damaged or not a manifest of awiwi-gen \("):
            attempt()
    assert (tree / "kernel0.c").exists()


def test_a_manifest_with_one_changed_character_is_refused(tree):
    path = tree / MANIFEST
    path.write_text(path.read_text().replace('"h1"', '"h2"'))

    with pytest.raises(OutputError, match="its own digest does not match"):
        inspect(tree, INPUTS)


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo, lambda path: path.symlink_to(path.name)])
def test_what_is_no_file_is_no_manifest_and_is_not_waited_for(tree, make):
    (tree / MANIFEST).unlink()
    make(tree / MANIFEST)

    with pytest.raises(OutputError, match=r"damaged or not a manifest of awiwi-gen \(not a regular file\)"):
        inspect(tree, INPUTS)


def test_a_manifest_of_somebody_else_gives_no_right_to_the_files_it_lists(tmp_path):
    place = tmp_path / "work"
    place.mkdir()
    (place / "thesis.tex").write_text("years of work")
    listed = {"files": {"thesis.tex": sha256("years of work")}, "inputs": {}, "kernels": []}
    (place / MANIFEST).write_text(json.dumps(listed))
    before = contents(place)

    with pytest.raises(OutputError, match="is damaged or not a manifest of awiwi-gen"):
        install(place, version("new"))
    assert contents(place) == before


def test_a_checkout_with_other_line_ends_is_fresh(tree):
    for path in tree.iterdir():
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))

    assert inspect(tree, INPUTS) == State()
    (tree / "kernel1.c").write_text("/* faster! */\r\n")
    assert inspect(tree, INPUTS) == State(edited=("kernel1.c",))


# ------------------------------------------------------------------------------------------------- what is refused


def test_files_of_others_are_never_deleted(tree):
    (tree / "notes.txt").write_text("mine")
    before = contents(tree)

    with pytest.raises(OutputError) as caught:
        install(tree, version("new"))
    assert str(caught.value) == (
        f"{tree} holds files that were not generated (notes.txt); move them away, or choose another place with -o"
    )
    assert contents(tree) == before


def test_a_directory_full_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")

    with pytest.raises(OutputError, match=r"holds files that were not generated \(thesis.tex\)"):
        install(tmp_path, version("new"))
    assert contents(tmp_path) == {"thesis.tex": "years of work"}


def test_a_file_in_the_place_of_the_directory_is_left_alone(tmp_path):
    place = tmp_path / "generated"
    place.write_text("a file")

    for attempt in (lambda: install(place, version("new")), lambda: require_place(place)):
        with pytest.raises(OutputError, match="is a file; expected a directory"):
            attempt()
    assert inspect(place, INPUTS).missing
    assert place.read_text() == "a file"


@pytest.mark.parametrize("place", ["file/generated", "/proc/generated"])
def test_a_place_that_cannot_be_written_is_named(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("a file")

    for attempt in (lambda: install(Path(place), version("new")), lambda: require_place(Path(place))):
        with pytest.raises(OutputError, match=r"generated cannot be written: .*; choose another place with -o"):
            attempt()
    clear(Path(place))
    assert contents(tmp_path) == {"file": "a file"}


def loop_of_links(place: Path) -> Path:
    (place / "a").symlink_to("b")
    (place / "b").symlink_to("a")
    return place / "a" / "generated"


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (lambda _: Path("/"), "is the root of the file system"),
        (lambda tmp: tmp / ("n" * 300), "cannot be written: file name too long"),
        (lambda tmp: tmp / ("n" * 300) / "generated", "cannot be written: file name too long"),
        (loop_of_links, "cannot be written: symlink loop|cannot be written: too many levels of symbolic links"),
        (lambda _: Path("/dev/null"), "is a file; expected a directory"),
    ],
)
def test_a_place_that_cannot_be_is_refused_in_one_sentence(tmp_path, place, words):
    directory = place(tmp_path)

    for attempt in (lambda: install(directory, version("new")), lambda: require_place(directory)):
        with pytest.raises(OutputError, match=words) as caught:
            attempt()
        assert len(str(caught.value).splitlines()) == 1


def test_the_whole_file_system_is_not_searched_for_foreign_files(tmp_path):
    for number in range(50):
        (tmp_path / f"folder{number}" / "below").mkdir(parents=True)

    assert inspect(tmp_path, INPUTS).foreign == tuple(sorted(f"folder{number}" for number in range(50)))


def test_what_is_written_into_the_old_directory_during_the_exchange_is_not_lost(tree, monkeypatch):
    swap = exchange.exchange

    def slow(a, b):
        (b / "notes.txt").write_text("mine")
        monkeypatch.setattr(exchange, "exchange", swap)
        return swap(a, b)

    monkeypatch.setattr(exchange, "exchange", slow)
    with pytest.raises(OutputError, match=r"holds files that were not generated \(notes.txt\)"):
        install(tree, version("new"))
    assert contents(tree) == version("old") | {"notes.txt": "mine"}
    assert litter(tree) == []


def test_a_disk_that_fills_up_changes_nothing(tree, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OutputError, match="cannot be written: no space left on device"):
        install(tree, version("new"))
    assert contents(tree) == version("old")
    assert litter(tree) == []
