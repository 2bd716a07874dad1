"""A table of results as text."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Columns and rows of text, the last of them a verdict."""

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
