"""Results kept between runs, by the digest of everything they depend on.

Every entry begins with a checksum over its kind, its name and its content, and is read through `Cache.read` alone.
What cannot be read, is too short, was changed or belongs under another name counts as absent and is made again.

Trust: the checksum finds damage, not malice. Entries are unpickled and libraries are run, so whoever may write to the
folder may run code as you; its permissions decide who that is. New entries take the permissions of the folder: a
folder with mode 2770 is shared by its group, one with mode 700 is private.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from typing import TypeVar

from awiwi_gen.errors import Fault, InputError, OutputError
from awiwi_gen.resources import SOURCES

T = TypeVar("T")
VARIABLE = "AWIWI_GEN_CACHE"


def cache_directory() -> Path:
    """``$AWIWI_GEN_CACHE``, or the user's cache directory. Raises InputError where there is neither."""
    if os.environ.get(VARIABLE):
        return Path(os.environ[VARIABLE])
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "awiwi_gen"
    except RuntimeError:  # neither $HOME nor an entry in the password database
        raise InputError(f"there is no home directory to cache results in; set {VARIABLE} to a folder") from None


def key(*parts: object) -> str:
    """One digest of several texts."""
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()


@cache
def code_digest(*rooms: str) -> str:
    """Digest of the package's own source text: of some rooms (files or folders), or of all that decides bytes.

    Line endings do not matter: a checkout may have converted them. Raises ValueError for a room without a file.
    """
    total, empty = hashlib.sha256(), set(rooms)
    for root in SOURCES:
        for path in sorted(root.rglob("*")):
            relative = path.relative_to(root.parent).as_posix()
            inside = {room for room in rooms if _inside(relative, room)}
            if path.suffix in (".py", ".j2", ".c", ".h") and (inside or not rooms):
                empty -= inside
                total.update(relative.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    if empty:
        raise ValueError(f"no source text in {', '.join(sorted(empty))}")
    return total.hexdigest()


def _inside(path: str, room: str) -> bool:
    return path == room or path.startswith(room.rstrip("/") + "/")


@cache
def libraries() -> str:
    """What decides the derived graphs and the text of the C besides our own code: versions, and ``python -OO``.

    ``-OO`` drops the docstrings, from which the comments of the C are made.
    """
    from importlib.metadata import version  # which parses e-mail: slow

    names = [f"{name} {version(name)}" for name in ("sympy", "casadi", "python-flint")]
    return ", ".join(names + ["without docstrings"] * (sys.flags.optimize > 1))


class Cache:
    """A folder of results, each a file named by kind and digest. Anything but a whole entry counts as absent."""

    def __init__(self, directory: Path | None = None) -> None:
        self._given = directory

    @cached_property
    def directory(self) -> Path:
        """The folder; created when something is written."""
        return self._given or cache_directory()

    def read(self, kind: str, digest: str) -> bytes | None:
        """The bytes written under this digest, or None."""
        try:
            handle = os.open(self.directory / kind / digest, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
            with open(handle, "rb") as file:
                if not stat.S_ISREG(os.fstat(handle).st_mode):
                    return None
                found = file.read()
        except OSError:
            return None
        checksum, data = found[:32], found[32:]
        return data if checksum == _checksum(kind, digest, data) else None

    def write(self, kind: str, digest: str, data: bytes) -> None:
        """Keep bytes; a reader sees all of them or nothing. Raises OutputError where that is impossible."""
        try:
            folder = self._folder(kind)
            handle, temporary = tempfile.mkstemp(dir=folder)
            try:
                with open(handle, "wb") as file:
                    file.write(_checksum(kind, digest, data) + data)
                os.chmod(temporary, folder.stat().st_mode & 0o666)
                os.replace(temporary, folder / digest)
            except BaseException:
                with suppress(OSError):
                    os.unlink(temporary)
                raise
        except OSError as error:
            raise self._unwritable(error) from None

    def get(self, kind: str, digest: str) -> object | None:
        """The object put under this digest, or None."""
        data = self.read(kind, digest)
        try:
            return None if data is None else pickle.loads(data)  # noqa: S301 see the trust model above
        except Exception:  # of a class that is no more: pickle may raise anything
            return None

    def put(self, kind: str, digest: str, value: object) -> None:
        """Keep an object. Raises OutputError where that is impossible."""
        self.write(kind, digest, pickle.dumps(value, protocol=5))

    def memo(self, kind: str, digest: str, compute: Callable[[], T]) -> T:
        """The cached object, or the computed one, which is then cached."""
        found = self.get(kind, digest)
        if found is None:
            found = compute()
            self.put(kind, digest, found)
        return found  # type: ignore[return-value]

    def missing(self, kind: str, digests: Iterable[str]) -> list[str]:
        """The digests under which there is no whole entry."""
        return [digest for digest in digests if self.read(kind, digest) is None]

    def require_writable(self) -> None:
        """Raise OutputError where nothing can be written: before the work, not after it."""
        try:
            with tempfile.TemporaryFile(dir=self._folder("records")):
                pass
        except OSError as error:
            raise self._unwritable(error) from None

    def _folder(self, kind: str) -> Path:
        """The folder of a kind, with the permissions of the whole."""
        folder = self.directory / kind
        if not folder.is_dir():
            self.directory.mkdir(parents=True, exist_ok=True)
            folder.mkdir(exist_ok=True)
            with suppress(PermissionError):  # another user was faster, and has done it
                folder.chmod(stat.S_IMODE(self.directory.stat().st_mode))
        return folder

    def _unwritable(self, error: OSError) -> OutputError:
        reason = (error.strerror or str(error)).lower()
        message = f"cannot be written: {reason}; it is the cache of awiwi_gen: set {VARIABLE} to another folder"
        return OutputError(Fault(file=str(self.directory), message=message))


def _checksum(kind: str, digest: str, data: bytes) -> bytes:
    total = hashlib.sha256(f"awiwi_gen {kind}/{digest}\0".encode())
    total.update(data)
    return total.digest()
