"""A result of `awiwi-gen simulate`, for programs and for people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from awiwi_gen.report import print_json
from awiwi_gen.results import Table
from awiwi_gen.tables import print_table


@dataclass(frozen=True)
class Shown:
    """A result as plain data for JSON, and as tables and lines."""

    data: Any
    tables: Sequence[Table]
    lines: Sequence[str] = ()

    def show(self, as_json: bool) -> None:
        """Print the data, or tables and lines."""
        if as_json:
            print_json(self.data)
            return
        for table in self.tables:
            print_table(table.columns, table.rows, table.title)
        print("".join(f"{line}\n" for line in self.lines), end="")
