"""Replace a directory so that, killed at any moment, it is the old one or the new one.

On Linux one system call swaps two directories. Where that is refused (other systems, mount points, the lower layer of
a container's overlay), the new directory gets a name that says it is complete, and its files are moved one by one;
whoever reads the directory next through `finish_replacement` moves the rest.
"""

from __future__ import annotations

import ctypes
import errno
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # a system without it: nothing is locked, and nothing that looks abandoned is removed
    fcntl = None  # type: ignore[assignment]

UNFINISHED = "-unfinished-"  # a killed run leaves .generated-unfinished-... beside `generated`
MANIFEST = "manifest.json"
COMPLETE = "-complete"  # the new files on their way into `generated`
Listed = Callable[[Path], Mapping[str, Any]]  # the files of a directory by its manifest; raises if it is not ours
REFUSED = (errno.ENOSYS, errno.EINVAL, errno.EXDEV, errno.EBUSY, errno.ENOTSUP, errno.EPERM)


@contextmanager
def staging(directory: Path) -> Iterator[Path]:
    """A new directory beside the given one, locked as long as this process lives, and removed in the end."""
    handle: int | None = None
    directory.parent.mkdir(parents=True, exist_ok=True)
    while handle is None:  # until it is locked before another run clears it away
        new = Path(tempfile.mkdtemp(prefix=f".{directory.name}{UNFINISHED}", dir=directory.parent))
        handle = _locked(new, or_unlockable=True)
    try:
        yield new
    finally:
        shutil.rmtree(new, ignore_errors=True)
        os.close(handle)


def clear(directory: Path) -> None:
    """Remove what killed runs left beside a directory; what a living run works on is locked, and stays."""
    directory = Path(os.path.abspath(directory))
    ours = re.compile(re.escape(f".{directory.name}{UNFINISHED}") + r"\w{8}")
    with suppress(OSError):
        for path in [path for path in directory.parent.iterdir() if ours.fullmatch(path.name)]:
            handle = _locked(path)
            if handle is not None:
                shutil.rmtree(path, ignore_errors=True)
                os.close(handle)


def replace(new: Path, directory: Path, listed: Listed, check: Callable[[Path], None]) -> None:
    """Put a complete directory in the place of another; ``check`` raises if the old one must not be removed."""
    with suppress(OSError):  # there is one already
        new.rename(directory)
        return
    old = _locked(directory, wait=True)  # so that no other run clears the old one away while it is checked
    try:
        if exchange(new, directory):
            if old is None or _is_same(old, new):  # else another run came first: its directory holds nothing else
                try:
                    check(new)
                except BaseException:  # somebody wrote into the old one in the meantime
                    exchange(new, directory)
                    raise
            return
    finally:
        if old is not None:
            os.close(old)
    complete = _complete(directory)
    while True:
        try:
            new.rename(complete)
            break
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            finish_replacement(directory, listed)  # of another run
    _move(complete, directory, listed)


def _is_same(handle: int, path: Path) -> bool:
    """Whether a path still leads to an open directory."""
    with suppress(OSError):
        return os.path.samestat(os.fstat(handle), os.stat(path))
    return False


def exchange(a: Path, b: Path) -> bool:
    """Swap two directories atomically; False where the system or the file system cannot."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    at_fdcwd, rename_exchange = -100, 2
    if renameat2 is None:
        return False
    if renameat2(at_fdcwd, os.fsencode(a), at_fdcwd, os.fsencode(b), rename_exchange) == 0:
        return True
    code = ctypes.get_errno()
    if code in REFUSED:
        return False
    raise OSError(code, os.strerror(code), str(b))


def finish_replacement(directory: Path, listed: Listed) -> None:
    """Move the rest of the new files where a run was killed while it moved them; wait for a run that still does."""
    complete = _complete(directory)
    if not os.path.lexists(complete):
        return
    handle = _locked(complete, wait=True)
    try:
        if complete.exists():
            _move(complete, directory.resolve(), listed)
    finally:
        if handle is not None:
            os.close(handle)


def _complete(directory: Path) -> Path:
    directory = directory.resolve()
    return directory.with_name(f".{directory.name}{COMPLETE}") if directory.name else directory / COMPLETE


def _move(complete: Path, directory: Path, listed: Listed) -> None:
    """Move all files of a complete directory into another. The manifest comes last: until then both lists are known."""
    if any(path.is_file() for path in complete.rglob("*")):  # else a run was killed after the last file
        old, new = listed(directory), listed(complete)
        for name in sorted(old.keys() - new.keys()):
            (directory / name).unlink(missing_ok=True)
            with suppress(OSError):  # other files are in it
                (directory / name).parent.rmdir()
        for name in [*sorted(new), MANIFEST]:
            if (complete / name).exists():
                _move_file(complete / name, directory / name)
    rest = complete.with_name(f".{directory.name}{UNFINISHED}{secrets.token_hex(4)}")
    complete.rename(rest)
    shutil.rmtree(rest)


def _move_file(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.replace(source, target)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        shutil.copyfile(source, target)  # a mount point: killed in the middle, it is copied again
        source.unlink()


def _locked(path: Path, or_unlockable: bool = False, wait: bool = False) -> int | None:
    """An open handle that holds the lock of a directory and loses it with its process; None if it cannot be had.

    Where the file system has no locks nothing is ever cleared, and ``or_unlockable`` gives a handle without one.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_DIRECTORY", 0))
    except OSError:
        return None
    try:
        if fcntl is None:
            raise OSError(errno.ENOSYS, "no locks on this system")
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        if path.exists():
            return handle
    except BlockingIOError:
        pass
    except OSError:
        if or_unlockable:
            return handle
    os.close(handle)
    return None
