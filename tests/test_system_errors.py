"""What the system refuses becomes one sentence and an exit code; no process and no half-written file is left."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from tools import LONG

import awiwi_gen
from awiwi_gen import parallel
from awiwi_gen.build import load
from awiwi_gen.emit.exchange import exchange, staging
from awiwi_gen.errors import OutputError
from awiwi_gen.pipeline import Job, cached_tree, generate, state

ONE_FINGER = Path(__file__).with_name("one_finger.toml")
SMALL = ("--hand", str(ONE_FINGER), "--only", "jaw_tendon_lengths")
linux = pytest.mark.skipif(sys.platform != "linux", reason="/proc, mounts and devices are those of Linux")


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "awiwi_gen", *map(str, words)]


def run(*words: object, stdout=subprocess.PIPE, **env: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in (dict(os.environ) | env).items() if value != "unset"}
    return subprocess.run(
        command(*words), stdout=stdout, stderr=subprocess.PIPE, text=True, env=environment, check=False
    )


def sentence(done: subprocess.CompletedProcess[str]) -> str:
    """The one line on standard error, apart from those on progress."""
    assert done.returncode == 2, done.stderr
    lines = [line for line in done.stderr.splitlines() if not line.endswith(" done")]
    assert len(lines) == 1, done.stderr
    return lines[0]


# ------------------------------------------------------------------------------------------------- caches and places


def test_a_cache_that_is_a_file_is_refused_before_the_work(tmp_path):
    (tmp_path / "cache").write_text("")
    said = sentence(run("generate", *SMALL, "-o", tmp_path / "c", AWIWI_GEN_CACHE=str(tmp_path / "cache")))

    assert said.startswith(f"{tmp_path / 'cache'} cannot be written: ")
    assert not (tmp_path / "c").exists()


@linux
def test_without_a_home_there_is_one_sentence(tmp_path):
    done = run("generate", *SMALL, "-o", tmp_path / "c", AWIWI_GEN_CACHE="unset", HOME="/dev/null")

    assert sentence(done).startswith("/dev/null/.cache/awiwi_gen cannot be written: not a directory")


@pytest.mark.parametrize("place", ["/", "n" * 300, "/dev/null", "loop/generated"])
def test_impossible_places_are_refused_in_one_sentence(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("loop")

    assert sentence(run("generate", *SMALL, "-o", place)).startswith(place[:20])


@contextmanager
def mounted(kind: str, place: Path, options: str):
    place.mkdir(exist_ok=True)
    done = subprocess.run(["mount", "-t", kind, "-o", options, kind, str(place)], capture_output=True, check=False)
    if done.returncode:
        pytest.skip("file systems cannot be mounted here")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


@linux
def test_a_full_cache_is_one_sentence_and_nothing_is_replaced(tmp_path):
    with mounted("tmpfs", tmp_path / "disk", "size=16k") as disk:
        said = sentence(run("generate", *SMALL, "-o", tmp_path / "c", AWIWI_GEN_CACHE=str(disk)))

    assert "cannot be written: no space left on device" in said
    assert not (tmp_path / "c").exists()


@linux
def test_a_full_disk_leaves_the_old_directory(tmp_path):
    with mounted("tmpfs", tmp_path / "disk", "size=256k") as disk:
        directory = disk / "generated"
        generate(Job(awiwi_gen.Hand.load(ONE_FINGER), only="jaw_tendon_lengths"), directory)
        before = {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()}
        said = sentence(run("generate", "--hand", ONE_FINGER, "-o", directory))
        assert said == f"{directory} cannot be written: no space left on device; choose another place with -o"
        assert {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()} == before
        assert list(disk.iterdir()) == [directory]


@linux
def test_a_cache_that_no_program_may_run_from_is_enough(tmp_path):
    generate(Job(awiwi_gen.Hand.load(ONE_FINGER), only="jaw_tendon_lengths"), tmp_path / "c")
    with mounted("tmpfs", tmp_path / "disk", "noexec") as disk:
        done = run("build", "-o", tmp_path / "c", AWIWI_GEN_CACHE=str(disk / "cache"))
        assert done.returncode == 0, done.stderr
        said = sentence(run("build", "-o", tmp_path / "c", AWIWI_GEN_CACHE=str(disk / "cache"), TMPDIR=str(disk)))
        assert said.startswith("the compiled library cannot be loaded (")
        assert said.endswith("set TMPDIR to a folder that has space and is not mounted noexec")


@linux
def test_a_directory_in_the_lower_layer_of_a_container_is_replaced(tmp_path):
    lower, layers, merged = (tmp_path / name for name in ("lower", "layers", "merged"))
    old, new = (Job(awiwi_gen.Hand.load(ONE_FINGER), only=only) for only in ("jaw_tendon_lengths", "*"))
    generate(old, lower / "generated")
    with mounted("tmpfs", layers, "rw"):
        for name in ("upper", "work"):
            (layers / name).mkdir()
        with mounted("overlay", merged, f"lowerdir={lower},upperdir={layers / 'upper'},workdir={layers / 'work'}"):
            if exchangeable(merged / "generated"):
                pytest.skip("this kernel swaps directories of lower layers")
            assert generate(new, merged / "generated")
            assert state(new, merged / "generated").fresh
            assert [path.name for path in merged.iterdir()] == ["generated"]
    assert state(old, lower / "generated").fresh


def exchangeable(directory: Path) -> bool:
    with staging(directory) as other:
        return exchange(other, directory) and exchange(other, directory)


# ------------------------------------------------------------------------------------------------- standard output


PRINTING = [("check", *SMALL[:2]), ("generate", *SMALL, "-o", "c"), ("explain", "jaw_energy", *SMALL[:2])]


@linux
@pytest.mark.parametrize("words", PRINTING, ids=lambda words: words[0])
def test_a_full_standard_output_is_one_sentence(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    with open("/dev/full", "w") as full:
        done = run(*words, stdout=full)

    assert sentence(done) == "standard output or a temporary file: no space left on device"


def test_a_closed_standard_output_is_one_sentence():
    script = " ".join(command("list", "--assumed")) + " >&-"
    done = subprocess.run(["sh", "-c", script], stderr=subprocess.PIPE, text=True, check=False)

    assert sentence(done) == "standard output is closed; expected a terminal, a file or a pipe"


def test_a_closed_standard_error_disturbs_nothing(tmp_path):
    script = " ".join(command("generate", *SMALL, "-o", tmp_path / "c")).replace("*", "\\*") + " 2>&-"
    done = subprocess.run(["sh", "-c", script], stdout=subprocess.PIPE, text=True, check=False)

    assert done.stdout == f"{tmp_path / 'c'}: generated\n"


def test_a_closed_pipe_is_silent():
    done = run_into_closed_pipe("list", "--assumed")

    assert done.returncode == 141
    assert done.stderr == ""


def run_into_closed_pipe(*words: object) -> subprocess.CompletedProcess[str]:
    read, write = os.pipe()
    os.close(read)
    try:
        return run(*words, stdout=write)
    finally:
        os.close(write)


# ------------------------------------------------------------------------------------------------- processes


def long_work(seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.01)


PARENT = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # programs in the background ignore it
from awiwi_gen import exits, parallel
sys.path.insert(0, sys.argv[1])
import test_system_errors as test

def work():
    with parallel.running("sleep", test.long_work, [60.0] * 2, parallel.silent) as finish:
        print(*[p.pid for p in __import__("multiprocessing").active_children()], flush=True)
        finish()

exits.run(work)
"""


@pytest.fixture
def parent():
    """A process with two workers, and their numbers."""
    words = [sys.executable, "-c", PARENT, str(Path(__file__).parent)]
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parent)},
    )  # fmt: skip
    workers = [int(word) for word in process.stdout.readline().split()]
    assert len(workers) == 2
    yield process, workers
    process.kill()
    process.communicate()


def gone(workers: list[int]) -> bool:
    """Whether processes end, waited for as long as their work would never take."""
    for _ in range(2000):
        if not any(alive(worker) for worker in workers):
            return True
        time.sleep(0.01)
    return False


def alive(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@linux
def test_workers_end_when_their_parent_is_killed(parent):
    process, workers = parent
    assert all(map(alive, workers))
    process.kill()

    assert gone(workers)


@linux
def test_an_interrupt_ends_all_with_130_and_one_word(parent):
    process, workers = parent
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate()

    assert process.returncode == 130
    assert said == "interrupted\n"
    assert gone(workers)


def suicide(number: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_killed_worker_is_one_sentence():
    with pytest.raises(
        OutputError, match=r"^derive: a worker process was killed, perhaps for lack of memory; run it again$"
    ):
        parallel.run("derive", suicide, [1, 2], parallel.silent)


def failing(number: int) -> None:
    if number:
        raise OutputError("no")
    long_work(3600)


def test_a_failure_does_not_wait_for_the_others():
    with pytest.raises(OutputError, match=r"^no$"):
        parallel.run("derive", failing, [0, 1], parallel.silent)
    assert not multiprocessing.active_children()  # the other one, which would take an hour


def test_a_program_that_loads_a_library_survives_what_is_done_to_the_cache(tmp_path, monkeypatch):
    """A truncated file that is mapped is a bus error: what runs is a copy."""
    monkeypatch.setenv("AWIWI_GEN_CACHE", str(tmp_path / "cache"))
    job = Job(awiwi_gen.Hand.load(ONE_FINGER), only="jaw_tendon_lengths")
    library = load(cached_tree(job), job.store)
    expected = library.jaw_tendon_lengths([0.1, 0.2])
    for path in (tmp_path / "cache" / "libraries").iterdir():
        os.truncate(path, 0)

    assert np.array_equal(library.jaw_tendon_lengths([0.1, 0.2]), expected)


# ------------------------------------------------------------------------------------------------- kills


def test_killed_at_any_moment_generate_leaves_the_old_or_the_new(tmp_path):
    directory, hands = tmp_path / "generated", {}
    for name, radius in (("old", "9 mm"), ("new", "9.5 mm")):
        hands[name] = tmp_path / f"{name}.toml"
        hands[name].write_text(ONE_FINGER.read_text().replace('"9 mm"', f'"{radius}"'))
    jobs = {name: Job(awiwi_gen.Hand.load(path), only="jaw_t*") for name, path in hands.items()}
    for job in (*jobs.values(), jobs["old"]):
        generate(job, directory)
    words = ["generate", "--only", "jaw_t*", "-o", directory, "--hand"]
    start = time.monotonic()
    assert run(*words, hands["new"]).returncode == 0
    once = time.monotonic() - start
    found = []
    for moment in np.random.default_rng(5).uniform(0.3 * once, 1.1 * once, 8 * LONG):
        wanted = "old" if state(jobs["new"], directory).fresh else "new"
        process = subprocess.Popen(command(*words, hands[wanted]), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(moment)
        process.kill()
        process.wait()
        found.append([name for name, job in jobs.items() if state(job, directory).fresh])

    assert all(len(names) == 1 for names in found)
    generate(jobs["old"], directory)
    generate(jobs["new"], directory)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
