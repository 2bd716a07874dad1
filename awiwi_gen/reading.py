"""Text files and tables of other people, read with an error that names the file."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path

from awiwi_gen.errors import Fault, InputError


def read_text(path: Path) -> str:
    """The text of a file in UTF-8, without a byte order mark. Raises InputError where it cannot be read."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or "is not UTF-8 text"
        raise InputError(Fault(file=str(path), message=f"cannot be read: {reason}")) from None


def read_table(path: Path) -> tuple[list[tuple[str, str]], Iterator[tuple[int, list[str]]]]:
    """A table in CSV: its columns, which are (name, unit) as in `mass [g]`, and rows that are not empty with their lines."""
    reader = csv.reader(read_text(path).splitlines())
    columns = []
    for head in next(reader, []):
        found = re.fullmatch(r"\s*(\w+)\s*(?:\[(.*)\])?\s*", head)
        columns.append((found[1], found[2] or "") if found else (head.strip(), ""))
    return columns, ((reader.line_num, cells) for cells in reader if any(cells))
