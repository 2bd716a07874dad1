"""The readings of table 5.2, which prints the same four points for both ends of the thumb's base tendons."""

from __future__ import annotations

import re
from pathlib import Path

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree

SHIPPED = (Path(__file__).resolve().parent.parent / "awiwi_gen" / "hand.toml").read_text(encoding="utf-8")


def wider(text: str) -> str:
    """The hand with a thumb whose base may turn by 1 rad to each side."""
    return replaced(text, r'low = "-35 deg"\nhigh = "35 deg"', 'low = "-1 rad"\nhigh = "1 rad"', 2)


def literal(text: str) -> str:
    """The hand with the distal points as printed: as far apart as the palmar ones."""
    return replaced(text, r'to = \["2 mm", "(-?)3 mm", "(-?)2.5 mm"\]', r'to = ["2 mm", "\g<1>30 mm", "\g<2>25 mm"]', 4)


def replaced(text: str, pattern: str, by: str, times: int) -> str:
    changed, count = re.subn(pattern, by, text)
    assert count == times
    return changed


def thumb(text: str):
    """A hand from this text, and its compiled thumb."""
    job = Job(Hand.parse(text), only="thumb_*")
    return job.hand, load(cached_tree(job), job.store)
