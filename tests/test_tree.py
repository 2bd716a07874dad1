"""The generated directory: what is the matter with it is told, nothing of others is touched, no kill leaves a mix."""

from __future__ import annotations

import json
import multiprocessing
import time
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.emit.tree import MANIFEST, State, inspect, install, require_place, sha256, sweep
from awiwi_gen.errors import OutputError
from awiwi_gen.report import state_lines

INPUTS = {"hand": "h1", "generator": "g1", "libraries": "sympy 1"}
MANY = 12  # files: enough for a kill to come between two of them
MEND = "awiwi-gen generate -o generated"


def version(name: str, count: int = 3, inputs: dict[str, str] = INPUTS) -> dict[str, str]:
    """A whole generated directory as texts; every file says which version it is of."""
    files = {f"kernel{i}.c": f"/* {name} */\n" + "x" * 1000 for i in range(count)}
    manifest = {"inputs": inputs, "files": {file: sha256(text) for file, text in files.items()}}
    return {**files, MANIFEST: json.dumps(manifest)}


def contents(directory: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in directory.iterdir()}


def litter(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.parent.iterdir() if path != directory)


def said(directory: Path, inputs: dict[str, str] = INPUTS) -> str:
    return "\n".join(state_lines(inspect(directory, inputs), "generated", MEND))


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    directory = tmp_path / "home" / "generated"
    install(directory, version("old"))
    return directory


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
    install(tree, {**texts, MANIFEST: json.dumps(manifest)})
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


@pytest.mark.parametrize("text", ["", "not json", "[]", '{"files": 3}', "\x00"])
def test_a_directory_with_an_unreadable_manifest_counts_as_not_generated(tree, text):
    (tree / MANIFEST).write_text(text)

    assert inspect(tree, INPUTS).missing
    with pytest.raises(OutputError, match="holds files that were not generated"):
        install(tree, version("new"))


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
    sweep(Path(place))
    assert contents(tmp_path) == {"file": "a file"}


def test_a_disk_that_fills_up_changes_nothing(tree, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OutputError, match="cannot be written: no space left on device"):
        install(tree, version("new"))
    assert contents(tree) == version("old")
    assert litter(tree) == []


# ------------------------------------------------------------------------------------------------- replacing


def test_a_new_version_replaces_all_of_the_old_one(tree):
    install(tree, version("new", count=2))

    assert contents(tree) == version("new", count=2)
    assert tree.stat().st_mode & 0o777 == 0o755
    assert litter(tree) == []


def test_an_empty_directory_is_taken(tmp_path):
    (tmp_path / "generated").mkdir()
    install(tmp_path / "generated", version("new"))

    assert contents(tmp_path / "generated") == version("new")


def test_a_link_to_a_directory_stays_a_link(tree, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(tree)
    install(link, version("new"))

    assert link.is_symlink()
    assert contents(tree) == version("new")


def test_where_directories_cannot_be_swapped_in_one_step_two_renames_do(tree, monkeypatch):
    monkeypatch.setattr("ctypes.CDLL", lambda *_, **__: object())
    install(tree, version("new"))

    assert contents(tree) == version("new")
    assert litter(tree) == []


def test_line_ends_are_the_same_on_every_system(tree):
    install(tree, {"a.c": "one\ntwo\n"} | {MANIFEST: '{"files": {"a.c": ""}}'})

    assert (tree / "a.c").read_bytes() == b"one\ntwo\n"


# ------------------------------------------------------------------------------------------------- killed runs

FORKING = multiprocessing.get_context("forkserver")  # processes that need not import anything again
FORKING.set_forkserver_preload(["pytest", "awiwi_gen.emit.tree", "awiwi_gen.report"])


def loop(tree: Path, ready: Event) -> None:
    """Replace a directory again and again, until killed."""
    old, new = version("old", MANY), version("new", MANY)
    ready.set()
    while True:
        install(tree, new)
        install(tree, old)


def looping(tree: Path) -> BaseProcess:
    ready = FORKING.Event()
    process = FORKING.Process(target=loop, args=(tree, ready), daemon=True)
    process.start()
    assert ready.wait(30)
    return process


def kill(process: BaseProcess) -> None:
    process.kill()  # SIGKILL: nothing can be tidied up
    process.join()


def test_killed_at_any_moment_the_directory_is_the_old_one_or_the_new_one(tree):
    start = time.perf_counter()
    install(tree, version("old", MANY))
    once = time.perf_counter() - start
    found, left = set(), 0
    for moment in np.random.default_rng(7).uniform(0, 4 * once, 50):
        process = looping(tree)
        time.sleep(moment)
        kill(process)
        now = contents(tree)
        assert now in (version("old", MANY), version("new", MANY))
        found.add(now["kernel0.c"][3:6])
        left += len(litter(tree))
    sweep(tree)

    assert found == {"old", "new"}
    assert left > 0, "no kill was ever in the middle of a run: the test tests nothing"
    assert litter(tree) == []


def test_the_next_run_clears_what_a_killed_one_left(tree):
    for name in (".generated-unfinished-abc12_xy", ".generated-unfinished-abcdefgh-old"):
        (tree.parent / name).mkdir()
        (tree.parent / name / "kernel0.c").write_text("half a ker")
    install(tree, version("new"))

    assert litter(tree) == []


def test_a_living_run_is_not_disturbed(tree):
    processes = [looping(tree), looping(tree)]
    try:
        end = time.monotonic() + 2
        while time.monotonic() < end:
            sweep(tree)
        assert [process.is_alive() for process in processes] == [True, True]
    finally:
        for process in processes:
            kill(process)
    sweep(tree)

    assert contents(tree) in (version("old", MANY), version("new", MANY))
    assert litter(tree) == []


@pytest.mark.parametrize(
    "name", [".generated-backup", ".generated-original", "generated-unfinished-abcdefgh", ".other-unfinished-abcdefgh"]
)
def test_directories_that_only_look_like_litter_stay(tree, name):
    (tree.parent / name).mkdir()
    sweep(tree)

    assert litter(tree) == [name]
