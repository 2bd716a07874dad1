"""The figures of the source, computed again: one module per system, each with ``figures(library, hand)``."""

from __future__ import annotations

import importlib
import pkgutil
import re
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.studies.figures.figure import Figure


def all_figures(library: Any, hand: Hand) -> list[Figure]:
    """What every module of this package shows of a hand, in the order of the source."""
    modules = [importlib.import_module(f"{__name__}.{each.name}") for each in pkgutil.iter_modules(__path__)]
    shown = [figure for each in modules if hasattr(each, "figures") for figure in each.figures(library, hand)]
    return sorted(shown, key=_place)


def _place(figure: Figure) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", figure.number)], figure.number
