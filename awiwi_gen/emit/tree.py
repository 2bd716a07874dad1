"""The generated directory as a whole: is it ours, is it fresh, and how it is replaced in one step."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import hashlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from awiwi_gen.errors import Fault, OutputError

MANIFEST = "manifest.json"
UNFINISHED = "-unfinished-"  # what a killed run leaves beside `generated` is called .generated-unfinished-...


def sha256(text: str | bytes) -> str:
    """Hexadecimal SHA-256 of a text."""
    return hashlib.sha256(text.encode() if isinstance(text, str) else text).hexdigest()


def read_manifest(directory: Path) -> dict[str, Any] | None:
    """The manifest of a generated directory; None if there is none that can be read."""
    try:
        manifest = json.loads((directory / MANIFEST).read_text(encoding="utf-8"))
        return manifest if isinstance(manifest, dict) and isinstance(manifest.get("files"), dict) else None
    except (OSError, ValueError):
        return None


def contents(directory: Path) -> list[str]:
    """What a directory holds: files in it and below it, and empty directories, by their places."""
    found = [path for path in directory.rglob("*") if not path.is_dir() or path.is_symlink() or not any(path.iterdir())]
    return sorted(path.relative_to(directory).as_posix() for path in found)


@dataclass(frozen=True)
class State:
    """How a generated directory compares with its manifest and with what it should be made from."""

    missing: bool = False
    edited: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    foreign: tuple[str, ...] = ()
    stale: tuple[str, ...] = ()

    @property
    def fresh(self) -> bool:
        """Nothing to do."""
        return self == State()


def inspect(directory: Path, inputs: Mapping[str, Any]) -> State:
    """Compare a directory with its manifest, and the manifest's inputs with the present ones."""
    if not directory.is_dir():
        return State(missing=True)
    manifest = read_manifest(directory)
    present = {*contents(directory)} - {MANIFEST}
    if manifest is None:
        return State(missing=True, foreign=tuple(sorted(present)))
    files = manifest["files"]
    edited = tuple(sorted(n for n in present & files.keys() if sha256((directory / n).read_bytes()) != files[n]))
    recorded = manifest.get("inputs", {})
    return State(
        edited=edited,
        lost=tuple(sorted(files.keys() - present)),
        foreign=tuple(sorted(present - files.keys())),
        stale=tuple(sorted(key for key in inputs if recorded.get(key) != inputs[key])),
    )


def install(directory: Path, files: Mapping[str, str]) -> None:
    """Replace ``directory`` by one that holds exactly ``files``, in one step.

    Killed at any moment, the directory is the old one or the new one. Raises OutputError when it cannot be
    written, or when it holds files that are not ours.
    """
    directory = directory.resolve()
    _require_ours(directory)
    sweep(directory)
    with _staging(directory) as staging:
        for name, text in files.items():
            (staging / name).parent.mkdir(exist_ok=True)
            (staging / name).write_text(text, encoding="utf-8", newline="\n")
        staging.chmod(0o755)
        try:
            staging.rename(directory)
        except OSError:  # there is one already
            exchange(staging, directory)


def require_place(directory: Path) -> None:
    """Raise OutputError where `install` would: before the work, not after it."""
    _require_ours(directory.resolve())
    with _staging(directory.resolve()):
        pass


def _require_ours(directory: Path) -> None:
    if directory.exists() and not directory.is_dir():
        raise OutputError(Fault(file=str(directory), message="is a file; expected a directory"))
    ours = (read_manifest(directory) or {"files": {}})["files"].keys() | {MANIFEST}
    foreign = [name for name in contents(directory) if name not in ours]
    if foreign:
        names = ", ".join(sorted(foreign)[:5])
        mend = "move them away, or choose another place with -o"
        raise OutputError(Fault(file=str(directory), message=f"holds files that were not generated ({names}); {mend}"))


@contextmanager
def _staging(directory: Path) -> Iterator[Path]:
    """A new directory beside the given one, locked as long as this process lives, and removed in the end."""
    handle: int | None = None
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        while handle is None:  # until it is locked before another run sweeps it
            staging = Path(tempfile.mkdtemp(prefix=f".{directory.name}{UNFINISHED}", dir=directory.parent))
            handle = _locked(staging, or_unlockable=True)
        try:
            yield staging
        finally:
            shutil.rmtree(staging, ignore_errors=True)
            os.close(handle)
    except OSError as error:
        message = f"cannot be written: {(error.strerror or str(error)).lower()}; choose another place with -o"
        raise OutputError(Fault(file=str(directory), message=message)) from error


def sweep(directory: Path) -> None:
    """Remove what killed runs left beside a directory; what a living run works on is locked, and stays."""
    directory = directory.resolve()
    ours = re.compile(re.escape(f".{directory.name}{UNFINISHED}") + r"\w{8}(-old)?")
    with suppress(OSError):
        for path in [path for path in directory.parent.iterdir() if ours.fullmatch(path.name)]:
            handle = _locked(path)
            if handle is not None:
                shutil.rmtree(path, ignore_errors=True)
                os.close(handle)


def _locked(path: Path, or_unlockable: bool = False) -> int | None:
    """An open handle that holds the lock of a directory and loses it with its process; None if it is not to be had.

    Where the file system has no locks nothing is ever swept, and ``or_unlockable`` gives a handle without one.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if path.exists():
            return handle
    except BlockingIOError:
        pass
    except OSError:
        if or_unlockable:
            return handle
    os.close(handle)
    return None


def exchange(a: Path, b: Path) -> None:
    """Swap two directories atomically (Linux); elsewhere by two renames, the nearest there is."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    at_fdcwd, rename_exchange = -100, 2
    if renameat2 is not None:
        if renameat2(at_fdcwd, os.fsencode(a), at_fdcwd, os.fsencode(b), rename_exchange) == 0:
            return
        code = ctypes.get_errno()
        if code not in (errno.ENOSYS, errno.EINVAL):
            raise OSError(code, os.strerror(code), str(b))
    spare = a.with_name(a.name + "-old")
    b.rename(spare)
    a.rename(b)
    spare.rename(a)
