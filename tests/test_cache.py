"""The cache: whole entries or none, whatever happens to its files; shared by its permissions."""

from __future__ import annotations

import errno
import os
import pickle
import random
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tools import LONG

import awiwi_gen
from awiwi_gen.build import _MODULES, load
from awiwi_gen.cache import Cache, cache_directory
from awiwi_gen.errors import AwiwiError, InputError, OutputError
from awiwi_gen.pipeline import Job, cached_tree, verify

ONE_FINGER = Path(__file__).with_name("one_finger.toml")
NOBODY = 65534
as_root = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can change users")


@pytest.fixture
def store(tmp_path) -> Cache:
    return Cache(tmp_path / "cache")


def entry(store: Cache, kind: str = "records", digest: str = "d") -> Path:
    return store.directory / kind / digest


# ------------------------------------------------------------------------------------------------- entries


def test_what_was_written_is_read(store):
    store.write("records", "d", b"bytes")
    store.put("records", "e", {"a": [1, 2.5]})

    assert store.read("records", "d") == b"bytes"
    assert store.get("records", "e") == {"a": [1, 2.5]}
    assert store.missing("records", ["d", "e", "f"]) == ["f"]


@pytest.mark.parametrize("length", [0, 1, 31, 32, 36])
def test_a_short_entry_is_absent(store, length):
    store.write("records", "d", b"bytes")
    entry(store).write_bytes(entry(store).read_bytes()[:length])

    assert store.read("records", "d") is None
    assert store.missing("records", ["d"]) == ["d"]


def test_an_entry_with_any_flipped_bit_is_absent(store):
    store.write("records", "d", b"bytes")
    whole = entry(store).read_bytes()
    for bit in range(8 * len(whole)):
        spoilt = bytearray(whole)
        spoilt[bit // 8] ^= 1 << bit % 8
        entry(store).write_bytes(spoilt)
        assert store.read("records", "d") is None


def test_an_entry_under_another_name_or_kind_is_absent(store):
    store.write("records", "d", b"bytes")
    store.write("laws", "x", b"other")
    shutil.copy(entry(store), entry(store, digest="e"))
    shutil.copy(entry(store), entry(store, "laws", "d"))

    assert store.read("records", "e") is None
    assert store.read("laws", "d") is None


@pytest.mark.parametrize("replace", [os.mkfifo, Path.mkdir, lambda path: path.symlink_to(path.name)])
def test_what_is_no_file_is_absent_and_not_waited_for(store, replace):
    store.write("records", "d", b"bytes")
    entry(store).unlink()
    replace(entry(store))

    assert store.read("records", "d") is None


def test_an_object_of_a_class_that_is_no_more_is_absent(store):
    store.write("records", "d", b"cawiwi_gen.cache\nNoMore\n.")

    assert store.get("records", "d") is None
    assert store.memo("records", "d", lambda: 3) == 3
    assert store.get("records", "d") == 3


def test_a_bare_pickle_is_never_loaded(store, tmp_path):
    class Surprise:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "surprise"),)

    entry(store).parent.mkdir(parents=True)
    entry(store).write_bytes(pickle.dumps(Surprise()))

    assert store.get("records", "d") is None
    assert not (tmp_path / "surprise").exists()


# ------------------------------------------------------------------------------------------------- folders


def refused(store: Cache, words: str) -> None:
    for attempt in (lambda: store.write("records", "d", b"x" * 100_000), store.require_writable):
        with pytest.raises(OutputError, match=words) as caught:
            attempt()
        assert "set AWIWI_GEN_CACHE to another folder" in str(caught.value)
        assert len(str(caught.value).splitlines()) == 1


def test_a_cache_that_is_a_file_is_named(tmp_path):
    (tmp_path / "cache").write_text("")

    refused(Cache(tmp_path / "cache"), "cache cannot be written: file exists|not a directory")
    refused(Cache(tmp_path / "cache" / "below"), "not a directory")


def test_a_cache_with_a_name_too_long_is_named(tmp_path):
    refused(Cache(tmp_path / ("n" * 300)), "file name too long")


def test_a_full_disk_is_named_and_leaves_nothing_half_written(store, monkeypatch):
    store.write("records", "d", b"old")

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OutputError, match="cannot be written: no space left on device; it is the cache of awiwi_gen"):
        store.write("records", "d", b"new")
    assert store.read("records", "d") == b"old"
    assert [path.name for path in (store.directory / "records").iterdir()] == ["d"]


def test_without_a_home_there_is_one_sentence(monkeypatch):
    for name in ("AWIWI_GEN_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    with pytest.raises(InputError, match="there is no home directory to cache results in; set AWIWI_GEN_CACHE"):
        cache_directory()
    Cache()  # a command that needs none does not ask for it


def as_nobody(program: str, cache: Path) -> subprocess.CompletedProcess[str]:
    text = f"import os, sys; os.setgid({NOBODY}); os.setuid({NOBODY}); os.umask(0o077)\n{program}"
    words = [sys.executable, "-c", "from awiwi_gen.cache import Cache; from pathlib import Path\n" + text, str(cache)]
    return subprocess.run(words, capture_output=True, text=True, check=False)


@as_root
def test_two_users_share_a_cache_that_is_open_to_both(tmp_path):
    for folder in [*tmp_path.parents, tmp_path]:
        if folder.stat().st_mode & 0o005 != 0o005:
            folder.chmod(folder.stat().st_mode | 0o005)
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    store = Cache(shared)
    store.put("records", "d", "of root")
    program = (
        "cache = Cache(Path(sys.argv[1])); assert cache.get('records', 'd') == 'of root'\n"
        "cache.put('records', 'd', 'of nobody'); cache.put('laws', 'e', 'new')"
    )
    done = as_nobody(program, shared)

    assert done.returncode == 0, done.stderr
    assert store.get("records", "d") == "of nobody"
    assert store.get("laws", "e") == "new"


@as_root
def test_a_private_cache_stays_private_and_a_read_only_one_is_read(tmp_path):
    for folder in [*tmp_path.parents, tmp_path]:
        folder.chmod(folder.stat().st_mode | 0o005)
    private, readable = Cache(tmp_path / "private"), Cache(tmp_path / "readable")
    for store, mode in ((private, 0o700), (readable, 0o755)):
        store.directory.mkdir()
        store.directory.chmod(mode)
        store.put("records", "d", "of root")

    assert stat.S_IMODE(entry(private).stat().st_mode) == 0o600
    program = "print(Cache(Path(sys.argv[1])).get('records', 'd'))\nCache(Path(sys.argv[1])).require_writable()"
    assert as_nobody(program, private.directory).stdout == "None\n"
    done = as_nobody(program, readable.directory)
    assert done.stdout == "of root\n"
    assert "cannot be written: permission denied; it is the cache of awiwi_gen" in done.stderr


# ------------------------------------------------------------------------------------------------- corruption


def corrupt(path: Path, others: list[Path], chance: random.Random) -> None:
    """Do to a file what disks, crashes and people do."""
    data = path.read_bytes()
    kind = chance.randrange(7)
    if kind == 0:
        path.write_bytes(data[: chance.randrange(len(data) + 1)])
    elif kind == 1:
        path.write_bytes(b"")
    elif kind == 2 and data:
        spoilt = bytearray(data)
        for _ in range(chance.choice((1, 1, 8, 1000))):
            spoilt[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        path.write_bytes(spoilt)
    elif kind == 3:
        path.write_bytes(chance.choice(others).read_bytes())
    elif kind == 4:
        path.unlink()
    elif kind == 5:
        path.write_bytes(data + chance.randbytes(chance.randrange(1, 100)))
    else:
        start = chance.randrange(len(data) + 1)
        path.write_bytes(data[:start] + bytes(len(data) - start))


def files(directory: Path) -> list[Path]:
    return sorted(path for path in directory.rglob("*") if path.is_file())


def test_no_corruption_of_the_cache_gives_a_wrong_number_or_a_signal(tmp_path, monkeypatch):
    chance = random.Random(11)  # noqa: S311
    home = tmp_path / "cache"
    monkeypatch.setenv("AWIWI_GEN_CACHE", str(home))
    job = Job(awiwi_gen.Hand.load(ONE_FINGER), only="jaw_[jt]*_lengths")
    q = np.array([0.1, 0.2])
    library = load(cached_tree(job), job.store)
    expected = library.jaw_tendon_lengths(q)
    assert verify(job, cached_tree(job)).passed
    whole = {path: path.read_bytes() for path in files(home)}
    assert {path.relative_to(home).parts[0] for path in whole} >= {"derived", "libraries", "objects", "proofs", "trees"}

    outcomes = {"right": 0}
    for _ in range(6 * LONG):
        for path in chance.sample(sorted(whole), chance.choice((1, 2, 5, len(whole)))):
            corrupt(path, sorted(path for path in whole if path.exists()), chance)
        _MODULES.clear()
        try:
            directory = cached_tree(job)
            assert np.array_equal(load(directory, job.store).jaw_tendon_lengths(q), expected)
            if chance.random() < 0.2:
                assert verify(job, directory).passed
            outcomes["right"] += 1
        except AwiwiError as error:
            outcomes[str(error)] = 1
        for path, data in whole.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)

    assert outcomes == {"right": 6 * LONG}


def test_no_corruption_of_a_generated_directory_is_taken_for_fresh(tmp_path, monkeypatch):
    from awiwi_gen.pipeline import generate, state

    chance = random.Random(12)  # noqa: S311
    monkeypatch.setenv("AWIWI_GEN_CACHE", str(tmp_path / "cache"))
    job, directory = Job(awiwi_gen.Hand.load(ONE_FINGER), only="jaw_[jt]*_lengths"), tmp_path / "generated"
    generate(job, directory)
    whole = {path: path.read_bytes() for path in files(directory)}
    refused = []
    for _ in range(200 * LONG):
        path = chance.choice(sorted(whole))
        corrupt(path, sorted(whole), chance)
        changed = not path.exists() or path.read_bytes() != whole[path]
        try:
            assert state(job, directory).fresh is not changed
        except OutputError:
            refused.append(path.name)
        path.write_bytes(whole[path])

    assert set(refused) == {"manifest.json"}
