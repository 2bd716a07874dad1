"""The generated directory as a whole: is it ours, is it fresh, and how it is replaced in one step."""

from __future__ import annotations

import ctypes
import ctypes.util
import errno
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from awiwi_gen.errors import Fault, OutputError

MANIFEST = "manifest.json"


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
    if not directory.exists():
        return State(missing=True)
    manifest = read_manifest(directory)
    present = {path.name for path in directory.iterdir()} - {MANIFEST}
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
    directory = directory.absolute()
    foreign = _foreign(directory)
    if foreign:
        names = ", ".join(foreign[:5])
        raise OutputError(
            Fault(file=str(directory), message=f"holds files that were not generated ({names}); choose another place")
        )
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{directory.name}-", dir=directory.parent))
    except OSError as error:
        raise OutputError(
            Fault(file=str(directory), message=f"cannot be written: {error.strerror}; choose another place with -o")
        ) from error
    try:
        for name, text in files.items():
            (staging / name).write_text(text, encoding="utf-8", newline="\n")
        staging.chmod(0o755)
        if directory.exists():
            exchange(staging, directory)
        else:
            staging.rename(directory)
    except OSError as error:
        raise OutputError(Fault(file=str(directory), message=f"cannot be written: {error.strerror}")) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _foreign(directory: Path) -> list[str]:
    if not directory.exists():
        return []
    if not directory.is_dir():
        raise OutputError(Fault(file=str(directory), message="is a file; expected a directory"))
    ours = (read_manifest(directory) or {"files": {}})["files"].keys() | {MANIFEST}
    return sorted(path.name for path in directory.iterdir() if path.name not in ours)


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
