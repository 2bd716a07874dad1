"""Results kept between runs, by the digest of everything they depend on."""

from __future__ import annotations

import hashlib
import os
import pickle
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

from awiwi_gen.resources import SOURCES

T = TypeVar("T")


def cache_directory() -> Path:
    """``$AWIWI_GEN_CACHE``, or the user's cache directory."""
    given = os.environ.get("AWIWI_GEN_CACHE")
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "awiwi_gen"


def key(*parts: object) -> str:
    """One digest of several texts."""
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()


@cache
def code_digest(*rooms: str) -> str:
    """Digest of the package's own source text: of some rooms (files or folders), or of all that decides bytes."""
    wanted = rooms or ("",)
    total = hashlib.sha256()
    for root in SOURCES:
        for path in sorted(root.rglob("*")):
            relative = path.relative_to(root.parent).as_posix()
            if path.suffix in (".py", ".j2", ".c", ".h") and any(_inside(relative, room) for room in wanted):
                total.update(relative.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def _inside(path: str, room: str) -> bool:
    return not room or path == room or path.startswith(room.rstrip("/") + "/")


@cache
def libraries() -> str:
    """The libraries whose versions decide what is derived."""
    return ", ".join(f"{name} {version(name)}" for name in ("sympy", "casadi", "python-flint"))


class Cache:
    """A folder of pickled results. Anything unreadable counts as absent."""

    def __init__(self, directory: Path | None = None) -> None:
        self.directory = directory or cache_directory()

    def get(self, kind: str, digest: str) -> object | None:
        """What was put under this digest, or None."""
        try:
            with (self.directory / kind / digest).open("rb") as file:
                found: object = pickle.load(file)  # noqa: S301 our own files
                return found
        except (OSError, pickle.PickleError, EOFError, AttributeError, ImportError, IndexError):
            return None

    def put(self, kind: str, digest: str, value: object) -> None:
        """Keep a result; a reader sees all of it or nothing."""
        self.put_bytes(kind, digest, pickle.dumps(value, protocol=5))

    def put_bytes(self, kind: str, digest: str, data: bytes) -> Path:
        """Keep a file; returns its path."""
        folder = self.directory / kind
        folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(temporary).replace(folder / digest)
        return folder / digest

    def memo(self, kind: str, digest: str, compute: Callable[[], T]) -> T:
        """The kept result, or the computed one, which is then kept."""
        found = self.get(kind, digest)
        if found is None:
            found = compute()
            self.put(kind, digest, found)
        return found  # type: ignore[return-value]

    def missing(self, kind: str, digests: Iterable[str]) -> list[str]:
        """Which of these digests are not there yet."""
        return [digest for digest in digests if not (self.directory / kind / digest).exists()]
