"""What the tests of motors, springs and identification share: one small hand that has actuators, with changes."""

from __future__ import annotations

import re
from pathlib import Path

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.library import Library
from awiwi_gen.pipeline import Job, cached_tree

ONE_FINGER = (Path(__file__).parent / "one_finger.toml").read_text(encoding="utf-8")
AWIWI = (Path(__file__).parents[1] / "awiwi_gen" / "hand.toml").read_text(encoding="utf-8")
ACTUATORS = "".join(re.findall(r"^\[+(?:motor|spring|tendon)\b.*?(?=^\[|^# -{20}|\Z)", AWIWI, flags=re.M | re.S))


def hand_text(*changes: tuple[str, str]) -> str:
    """One finger with the Awiwi hand's actuators; each change replaces a piece of text that must be there."""
    text = ONE_FINGER + ACTUATORS
    for old, new in changes:
        assert text.count(old) == 1, f"{text.count(old)} times {old!r}"
        text = text.replace(old, new)
    return text


ALL = "[cgmpst][aeopu][ilnrt]*"  # motor_*, spring_*, calibration_*, guiding_*, tendon_* and pole_*, in one library


def compiled(*changes: tuple[str, str], only: str = ALL) -> Library:
    """The kernels of such a hand whose names match."""
    job = Job(Hand.parse(hand_text(*changes)), only=only)
    return load(cached_tree(job), job.store)
