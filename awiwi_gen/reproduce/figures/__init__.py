"""The figures of the source, computed again: one module per system, each with ``figures(library, hand)``."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterable
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.results import Figure


def all_figures(library: Any, hand: Hand) -> list[Figure]:
    """The figures that the modules of this package have for a hand."""
    modules = [importlib.import_module(f"{__name__}.{each.name}") for each in pkgutil.iter_modules(__path__)]
    return [figure for each in modules if hasattr(each, "figures") for figure in each.figures(library, hand)]


def in_order(figures: Iterable[Figure]) -> list[Figure]:
    """Figures in the order of the source."""
    return sorted(
        figures, key=lambda figure: ([int(digits) for digits in re.findall(r"\d+", figure.number)], figure.number)
    )
