"""The words of csrc/awiwi_hand.h for Python: laws, modes and the bits of a status."""

from __future__ import annotations

import re
from functools import cache

from awiwi_gen.resources import CSRC

LAWS = ("motor_impedance", "cascade", "backstepping")
MODES = ("off", "run", "hold", "ramp", "fault")
FAULTS = (1 << 8) - 1


@cache
def bits() -> dict[str, int]:
    """Name -> bit of every part of a status, as the header defines them."""
    text = (CSRC / "awiwi_hand.h").read_text(encoding="utf-8")
    return {name.lower(): int(place) for name, place in re.findall(r"\bAWIWI_(\w+) = 1 << (\d+),?", text)}


def names_of(status: int) -> list[str]:
    """The names of the bits of a status."""
    return [name for name, place in bits().items() if status >> place & 1]
