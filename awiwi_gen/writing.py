"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from awiwi_gen.errors import OutputError


def write_whole(path: Path, text: str, replace: bool = True) -> None:
    """Write a text file, all or nothing. Raises OutputError where the system refuses, or where a file would be lost."""
    refuse_to_replace(path, replace)
    with whole_file(path) as stream:
        stream.write(text.encode())


def refuse_to_replace(path: Path, replace: bool) -> None:
    """Raise OutputError where a file would be lost."""
    if path.exists() and not replace:
        raise OutputError(f"{path} exists; choose another name with -o, or replace it with --replace")


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """A stream for a file that appears only when all is written. Raises OutputError where the system refuses."""
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with unfinished.open("wb") as stream:
            yield stream
        os.replace(unfinished, path)
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror}") from None
    finally:
        unfinished.unlink(missing_ok=True)
