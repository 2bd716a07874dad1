"""Directories are replaced as a whole: no kill leaves a mix, and no other run is disturbed."""

from __future__ import annotations

import ctypes
import errno
import json
import multiprocessing
import os
import time
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np
import pytest
from trees import MANY, contents, litter, version

from awiwi_gen.emit import exchange
from awiwi_gen.emit.exchange import MANIFEST, clear
from awiwi_gen.emit.tree import install, read_manifest, sealed
from awiwi_gen.errors import OutputError

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


NOT_SWAPPED = [errno.EXDEV, errno.EBUSY, errno.EINVAL, errno.ENOSYS]


@pytest.fixture(params=NOT_SWAPPED, ids=errno.errorcode.get)
def unswappable(request, monkeypatch):
    """A place where the kernel refuses to rename and to swap directories that are there already."""
    refuse_swaps(request.param, monkeypatch.setattr)


def refuse_swaps(code: int, setattr_=setattr) -> None:
    rename = Path.rename

    class Refusing:
        @staticmethod
        def renameat2(*_):
            ctypes.set_errno(code)
            return -1

    def renamed(path, target):
        if Path(target).name == "generated":
            raise OSError(code, "refused")
        return rename(path, target)

    setattr_(ctypes, "CDLL", lambda *_, **__: Refusing)
    setattr_(Path, "rename", renamed)


@pytest.mark.usefixtures("unswappable")
def test_where_directories_cannot_be_swapped_files_are_moved_one_by_one(tree):
    install(tree, version("new", count=2))

    assert contents(tree) == version("new", count=2)
    assert litter(tree) == []


@pytest.mark.usefixtures("unswappable")
def test_a_mount_point_takes_files_of_another_file_system(tree, monkeypatch):
    move = os.replace

    def across(source, target):
        if Path(source).parent != Path(target).parent:
            raise OSError(errno.EXDEV, "Invalid cross-device link")
        move(source, target)

    monkeypatch.setattr(os, "replace", across)
    install(tree, version("new"))

    assert contents(tree) == version("new")
    assert litter(tree) == []


@pytest.mark.usefixtures("unswappable")
@pytest.mark.parametrize("moved", range(MANY + 3))
def test_the_next_reader_finishes_an_interrupted_move(tree, monkeypatch, moved):
    move, count = exchange._move_file, iter(range(1000))

    def interrupted(source, target):
        if next(count) == moved:
            raise KeyboardInterrupt
        move(source, target)

    monkeypatch.setattr(exchange, "_move_file", interrupted)
    new = version("new", MANY)
    if moved <= MANY:
        with pytest.raises(KeyboardInterrupt):
            install(tree, new)
    else:
        install(tree, new)
    monkeypatch.setattr(exchange, "_move_file", move)

    assert read_manifest(tree) == json.loads(new[MANIFEST])
    assert contents(tree) == new
    assert litter(tree) == []


def test_a_foreign_directory_with_the_name_of_ours_is_left_alone(tree):
    foreign = tree.parent / ".generated-complete"
    foreign.mkdir()
    (foreign / "thesis.tex").write_text("years of work")
    (foreign / MANIFEST).write_text('{"files": {}}')

    with pytest.raises(OutputError, match=r"\.generated-complete/manifest\.json is damaged or not a manifest"):
        read_manifest(tree)
    assert (foreign / "thesis.tex").read_text() == "years of work"


def test_line_ends_are_the_same_on_every_system(tree):
    install(tree, {"a.c": "one\ntwo\n", MANIFEST: sealed({"files": {"a.c": ""}})})

    assert (tree / "a.c").read_bytes() == b"one\ntwo\n"


# ------------------------------------------------------------------------------------------------- killed runs

FORKING = multiprocessing.get_context("forkserver")  # processes that need not import anything again
FORKING.set_forkserver_preload(["pytest", "awiwi_gen.emit.tree", "awiwi_gen.report"])


def loop(tree: Path, ready: Event, swappable: bool) -> None:
    """Replace a directory again and again, until killed."""
    if not swappable:
        refuse_swaps(errno.EXDEV)
    old, new = version("old", MANY), version("new", MANY)
    ready.set()
    while True:
        install(tree, new)
        install(tree, old)


def looping(tree: Path, swappable: bool = True) -> BaseProcess:
    ready = FORKING.Event()
    process = FORKING.Process(target=loop, args=(tree, ready, swappable), daemon=True)
    process.start()
    assert ready.wait(30)
    return process


def kill(process: BaseProcess) -> None:
    process.kill()  # SIGKILL: nothing can be tidied up
    process.join()


@pytest.mark.parametrize("swappable", [True, False])
def test_killed_at_any_moment_the_directory_is_the_old_one_or_the_new_one(tree, swappable):
    start = time.perf_counter()
    install(tree, version("old", MANY))
    once = time.perf_counter() - start
    found, left = set(), 0
    for number, moment in enumerate(np.random.default_rng(7).uniform(0, (4 if swappable else 16) * once, 400)):
        if number >= (50 if swappable else 25) and left and len(found) == 2:
            break  # a busy machine needs more kills to meet all moments
        process = looping(tree, swappable)
        time.sleep(moment)
        kill(process)
        read_manifest(tree)  # as every reader does first
        now = contents(tree)
        assert now in (version("old", MANY), version("new", MANY))
        found.add(now["kernel0.c"][3:6])
        left += len(litter(tree))
    clear(tree)

    assert found == {"old", "new"}
    assert left > 0, "no kill was ever in the middle of a run: the test tests nothing"
    assert litter(tree) == []


def test_the_next_run_clears_what_a_killed_one_left(tree):
    for name in (".generated-unfinished-abc12_xy", ".generated-unfinished-0123abcd"):
        (tree.parent / name).mkdir()
        (tree.parent / name / "kernel0.c").write_text("half a ker")
    install(tree, version("new"))

    assert litter(tree) == []


def test_a_living_run_is_not_disturbed(tree):
    processes = [looping(tree), looping(tree)]
    try:
        end = time.monotonic() + 2
        while time.monotonic() < end:
            clear(tree)
        assert [process.is_alive() for process in processes] == [True, True]
    finally:
        for process in processes:
            kill(process)
    clear(tree)

    assert contents(tree) in (version("old", MANY), version("new", MANY))
    assert litter(tree) == []


@pytest.mark.parametrize(
    "name", [".generated-backup", ".generated-original", "generated-unfinished-abcdefgh", ".other-unfinished-abcdefgh"]
)
def test_directories_that_only_look_like_litter_stay(tree, name):
    (tree.parent / name).mkdir()
    clear(tree)

    assert litter(tree) == [name]
