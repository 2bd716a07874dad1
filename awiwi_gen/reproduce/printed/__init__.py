"""The numbers that the source prints, against ours: one module per group of chapters, each with ``printed_numbers``."""

from __future__ import annotations

import importlib
import pkgutil
import re
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.results import Printed


def all_numbers(library: Any, hand: Hand) -> list[Printed]:
    """What every module of this package compares for a hand, in the order of the source's chapters."""
    modules = [importlib.import_module(f"{__name__}.{each.name}") for each in pkgutil.iter_modules(__path__)]
    rows = [row for each in modules if hasattr(each, "printed_numbers") for row in each.printed_numbers(library, hand)]
    return sorted(rows, key=_chapter)


def _chapter(row: Printed) -> int:
    return int(re.findall(r"\d+", row.where)[0])
