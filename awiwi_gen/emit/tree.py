"""The generated directory as a whole: is it ours, is it fresh, and how it is replaced in one step.

A directory is ours if its manifest carries a digest over itself; the files it lists are ours, everything else in the
directory belongs to somebody else and is never touched.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from awiwi_gen.emit.exchange import MANIFEST, clear, finish_replacement, replace, staging
from awiwi_gen.errors import Fault, OutputError

OWN_DIGEST = "manifest_digest"
SHOWN = 5  # names of foreign files in a message
ELSEWHERE = "choose another place with -o"


def sha256(text: str | bytes) -> str:
    """Hexadecimal SHA-256 of a text; CRLF counts as LF, for a checkout may have converted it."""
    data = text.encode() if isinstance(text, str) else text
    return hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()


def sealed(manifest: Mapping[str, Any]) -> str:
    """The text of a manifest with a digest over itself, which proves that it is ours."""
    return json.dumps({**manifest, OWN_DIGEST: _own_digest(manifest)}, indent=1, ensure_ascii=False) + "\n"


def _own_digest(manifest: Mapping[str, Any]) -> str:
    others = {name: value for name, value in manifest.items() if name != OWN_DIGEST}
    return sha256("awiwi_gen " + json.dumps(others, sort_keys=True))


def read_manifest(directory: Path) -> dict[str, Any] | None:
    """The manifest of a generated directory; None if there is none.

    Completes a replacement that was interrupted. Raises OutputError if the manifest is damaged or not ours.
    """
    with _worded(directory):
        finish_replacement(directory, _listed)
        return _manifest(directory)


def _manifest(directory: Path) -> dict[str, Any] | None:
    path = directory / MANIFEST
    if not os.path.lexists(path):
        return None
    try:
        if not path.is_file():
            raise ValueError("not a regular file")
        manifest = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(manifest, dict) or manifest.get(OWN_DIGEST) != _own_digest(manifest):
            raise ValueError("its own digest does not match")
    except (ValueError, RecursionError) as error:
        message = (
            f"is damaged or not a manifest of awiwi-gen ({str(error) or 'too deeply nested'}); "
            f"if everything in {directory} is generated, delete it and generate again, else {ELSEWHERE}"
        )
        raise OutputError(Fault(file=str(path), message=message)) from None
    return manifest


def _listed(directory: Path) -> Mapping[str, Any]:
    """The files that the manifest of a directory lists."""
    return (_manifest(directory) or {"files": {}})["files"]  # type: ignore[no-any-return]


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
    with _worded(directory):
        if not directory.is_dir():
            return State(missing=True)
        manifest = read_manifest(directory)
        if manifest is None:
            return State(missing=True, foreign=tuple(_foreign(directory, ())))
        files = manifest["files"]
        lost = [name for name in files if not os.path.lexists(directory / name)]
        edited = [name for name in files if name not in lost and _digest(directory / name) != files[name]]
        recorded = manifest.get("inputs", {})
        return State(
            edited=tuple(sorted(edited)),
            lost=tuple(sorted(lost)),
            foreign=tuple(_foreign(directory, files)),
            stale=tuple(sorted(key for key in inputs if recorded.get(key) != inputs[key])),
        )


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()) if path.is_file() else ""


def install(directory: Path, files: Mapping[str, str]) -> None:
    """Replace ``directory`` by one that holds exactly ``files``, in one step.

    Killed at any moment, the directory is the old one or the new one. Raises OutputError when it cannot be
    written, or when it holds files that are not ours.
    """
    with _worded(directory):
        directory = directory.resolve()
        _require_ours(directory)
        clear(directory)
        with staging(directory) as new:
            for name, text in files.items():
                (new / name).parent.mkdir(exist_ok=True)
                (new / name).write_text(text, encoding="utf-8", newline="\n")
            new.chmod(0o755)
            replace(new, directory, _listed, _require_ours)


def require_place(directory: Path) -> None:
    """Raise OutputError where `install` would: before the work, not after it."""
    with _worded(directory):
        directory = directory.resolve()
        _require_ours(directory)
        with staging(directory):
            pass


def remove(directory: Path) -> None:
    """Remove a directory of the cache with all that is in it."""
    with _worded(directory):
        if directory.is_dir() and not directory.is_symlink():
            shutil.rmtree(directory)
        else:
            directory.unlink(missing_ok=True)


def _require_ours(directory: Path) -> None:
    """Raise OutputError if a directory holds something that this program did not write."""
    if directory == Path(directory.anchor):
        raise OutputError(Fault(file=str(directory), message=f"is the root of the file system; {ELSEWHERE}"))
    if directory.exists() and not directory.is_dir():
        raise OutputError(Fault(file=str(directory), message="is a file; expected a directory"))
    if not directory.exists():
        return
    manifest = read_manifest(directory)
    foreign = _foreign(directory, manifest["files"] if manifest else ())
    if foreign:
        names = ", ".join(foreign[:SHOWN]) + ", ..." * (len(foreign) > SHOWN)
        message = f"holds files that were not generated ({names}); move them away, or {ELSEWHERE}"
        raise OutputError(Fault(file=str(directory), message=message))


def _foreign(directory: Path, ours: Collection[str]) -> list[str]:
    """Files that are not ours, and folders in which nothing is ours, by their paths in the directory."""
    known = {*ours, MANIFEST} if ours else set()
    folders = {parent.as_posix() for name in known for parent in Path(name).parents}

    def walk(folder: Path, prefix: str) -> Iterator[str]:
        with os.scandir(folder) as entries:
            for entry in entries:
                name = prefix + entry.name
                if name in folders and entry.is_dir(follow_symlinks=False):
                    yield from walk(Path(entry.path), f"{name}/")
                elif name not in known or entry.is_dir(follow_symlinks=False):
                    yield name

    return sorted(walk(directory, ""))


@contextmanager
def _worded(directory: Path) -> Iterator[None]:
    """Errors of the operating system as one sentence."""
    try:
        yield
    except (OSError, RuntimeError) as error:  # Path.resolve raises RuntimeError for a loop of links
        if isinstance(error, OutputError):
            raise
        reason = (getattr(error, "strerror", None) or str(error).partition(" from ")[0]).lower()
        message = f"cannot be written: {reason}; {ELSEWHERE}"
        raise OutputError(Fault(file=str(directory), message=message)) from error
