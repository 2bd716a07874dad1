"""Tables for a terminal of 80 characters: aligned columns, never cut; what does not fit goes on in the next line."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from textwrap import TextWrapper
from typing import TextIO

from awiwi_gen.errors import printable

NARROW = 80  # characters of a line on the narrowest terminal
GAP, INDENT = "  ", "    "


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], title: str = "") -> None:
    """Aligned columns, never shortened; on a terminal, rows of failed kernels are red."""
    if title:
        print(printable(title))
    for number, lines in enumerate(table(columns, rows, width())):
        text = printable("\n".join(lines))
        failed = number > 0 and columns[-1] == "verdict" and rows[number - 1][-1] != "proved"
        print(f"\033[31m{text}\033[0m" if failed and sys.stdout.isatty() else text)


def width() -> int:
    """Characters of a line: those of the terminal if it has more than 80."""
    return max(NARROW, shutil.get_terminal_size((NARROW, 24)).columns) if sys.stdout.isatty() else NARROW


def fitted(text: str, stream: TextIO) -> str:
    """Text with lines that a terminal shows without breaking words; files and pipes get it as it is."""
    if not stream.isatty():
        return text
    most = max(NARROW, shutil.get_terminal_size((NARROW, 24)).columns)
    wrapper = TextWrapper(most, subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False)
    return "\n".join(line if len(line) <= most else wrapper.fill(line) for line in text.split("\n"))


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], most: int) -> list[list[str]]:
    """The lines of the head and of each row: one if they have at most ``most`` characters, else as many as it takes.

    The last column is not padded, and may be longer.
    """
    whole = [columns, *rows]
    widths = [max(len(row[i]) for row in whole) for i in range(len(columns))]
    numeric = [sum(row[i][:1].isalpha() for row in rows) * 2 < len(rows) for i in range(len(columns))]
    groups = _groups([*widths[:-1], len(columns[-1])], most)
    return [[_line(row, group, widths, numeric) for group in groups] for row in whole]


def _groups(widths: Sequence[int], most: int) -> list[list[int]]:
    """Columns that share a line; the second and later lines are indented."""
    groups: list[list[int]] = [[]]
    used = -len(GAP)
    for column, each in enumerate(widths):
        if groups[-1] and used + len(GAP) + each > most:
            groups.append([])
            used = len(INDENT) - len(GAP)
        groups[-1].append(column)
        used += len(GAP) + each
    return groups


def _line(row: Sequence[str], group: Sequence[int], widths: Sequence[int], numeric: Sequence[bool]) -> str:
    cells = [row[i].rjust(widths[i]) if numeric[i] else row[i].ljust(widths[i]) for i in group]
    return (INDENT * (group[0] > 0) + GAP.join(cells)).rstrip()
