"""The hand: a frozen tree of the numbers that CAD gives, read from one file and checked.

    hand = Hand.load()                            # the Awiwi hand; Hand.load("my_hand.toml") for another one
    float(hand.fingers["index"].radii["pip"])     # 0.006, in metres
    hand.symbolic(lambda path, _: Symbol(path))   # the same tree, with symbols for numbers

The parts of a hand are in `parts`, reading a file is in `file`, what no hand can have is in `lint` and `tensors`,
warnings are in `plausibility`, and what the tendons of a hand make impossible is in `capability`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from awiwi_gen.errors import Fault
from awiwi_gen.hand.actuation import Fibre, Motor, Spring
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.gains import Gains, gains_complaints, with_gains
from awiwi_gen.hand.lint import Complaint, below, complaints, sources
from awiwi_gen.hand.lint_actuation import actuator_complaints
from awiwi_gen.hand.lint_motors import across_complaints
from awiwi_gen.hand.lint_tick import effort_remarks
from awiwi_gen.hand.names import FingerName, Prefix, Title
from awiwi_gen.hand.palm import Palm, palm_complaints
from awiwi_gen.hand.parts import MOST, Finger, Limits, Link, Part
from awiwi_gen.hand.plausibility import remarks
from awiwi_gen.hand.tick import Clock
from awiwi_gen.hand.wrist import Wrist
from awiwi_gen.resources import DEFAULT_HAND, gains_beside

__all__ = ["Fibre", "Finger", "Hand", "Limits", "Link", "Motor", "Palm", "Spring", "Wrist"]


class Hand(Part):
    """A whole hand; the order of its fingers is the order of their tendons in the forearm."""

    version: Annotated[Literal[1, 2], Field(alias="schema", examples=["2"])] = 1
    prefix: Prefix
    name: Title
    limits: Limits
    fingers: Annotated[
        dict[FingerName, Finger], Field(min_length=1, max_length=MOST, examples=["[[fingers.index.links]]"])
    ]
    wrist: Wrist | None = None
    palm: Palm | None = None
    motor: Motor | None = None
    spring: Spring | None = None
    tendon: Fibre | None = None
    clock: Annotated[Clock | None, Field(exclude=True)] = None
    gains: Gains = ()

    @property
    def tendons(self) -> int:
        """Number of tendons of all fingers that motors pull; those of one motor count as one."""
        return sum(len(finger.transmissions) for finger in self.fingers.values())

    @property
    def blocks(self) -> dict[str, tuple[slice, slice]]:
        """Finger -> slices of its tendons and its joints in arrays over all tendons and joints of the hand."""
        found, row, column = {}, 0, 0
        for name, finger in self.fingers.items():
            tendons, joints = len(finger.transmissions), len(finger.joints)
            found[name] = slice(row, row + tendons), slice(column, column + joints)
            row, column = row + tendons, column + joints
        return found

    @property
    def motors(self) -> tuple[tuple[int, ...], ...]:
        """What each motor pulls, as places in arrays over the hand's tendons, in the order of their first tendons.

        A motor that pulls tendons of several fingers has a place for each of these.
        """
        places: dict[int | str, list[int]] = {}
        pulled = [each for finger in self.fingers.values() for each in finger.transmissions]
        for place, transmission in enumerate(pulled):
            shared = transmission.tendons[0].motor
            places.setdefault(shared.name if shared else place, []).append(place)
        return tuple(map(tuple, places.values()))

    @property
    def across(self) -> dict[str, str]:
        """Finger -> a motor that pulls tendons of it and of others; empty for most hands."""
        owners: dict[str, list[str]] = {}
        for name, finger in self.fingers.items():
            for motor in {tendon.motor.name for tendon in finger.pulled if tendon.motor}:
                owners.setdefault(motor, []).append(name)
        return {name: motor for motor, names in owners.items() if len(names) > 1 for name in names}

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers that the kernels of the whole hand depend on, ready for JSON."""
        fingers = {name: finger.structure() for name, finger in self.fingers.items()}
        shared = {"motors": self.motors} if self.across else {}
        return {"fingers": [*fingers.items()], "wrist": self.wrist and self.wrist.structure(), **shared}

    @classmethod
    def load(cls, path: str | os.PathLike[str] | None = None) -> Hand:
        """Read a hand file; without a path, the Awiwi hand of this package.

        Raises `InputError` with every fault of the first stage that fails: reading, schema, physics.
        """
        return _checked(_read(path))

    @classmethod
    def review(cls, path: str | os.PathLike[str] | None = None) -> tuple[Hand, list[Fault]]:
        """Like `load`, with the warnings about the file: possible, but unusual numbers."""
        file = _read(path)
        hand = _checked(file)
        unusual = (*remarks(hand.fingers), *effort_remarks(hand.limits, hand.fingers))
        warnings = [file.fault(*remark) for remark in unusual]
        return hand, sorted(warnings, key=lambda fault: fault.line or 0)

    @classmethod
    def parse(cls, text: str, name: str = "hand.toml") -> Hand:
        """Like `load`, from text; messages call the file `name`."""
        return _checked(with_gains(HandFile.parse(text, name)))


def _checked(file: HandFile) -> Hand:
    hand = file.validated(Hand)
    found = list(complaints(hand.limits, hand.fingers, hand.wrist))
    found += _palm(hand)
    if hand.clock:
        found += below(("clock",), sources(hand.clock))
    found += actuator_complaints(hand.motor, hand.spring, hand.tendon, hand.tendons)
    lacks = [section for section in ("motor", "spring") if getattr(hand, section) is None]
    found += gains_complaints(hand.gains, hand.tendons, lacks)
    found += across_complaints(hand.across, bool(hand.gains), bool(hand.spring and hand.spring.units))
    if found:
        raise file.error(found)
    return hand


def _palm(hand: Hand) -> Iterator[Complaint]:
    if hand.palm is None:
        return
    if hand.wrist:
        yield ("palm",), "has joints, but the hand has a wrist that moves its palm; leave out [palm] or [wrist]"
    yield from below(("palm",), [*sources(hand.palm), *palm_complaints(hand.palm)])
    for index, joint in enumerate(hand.palm.joints):
        yield from below(("palm", "joints", index), sources(joint))
    if hand.palm.base:
        yield from below(("palm", "base"), sources(hand.palm.base))


def _read(path: str | os.PathLike[str] | None) -> HandFile:
    if path is not None:
        return with_gains(HandFile.read(path), beside=gains_beside(Path(path)))
    file = HandFile.read(DEFAULT_HAND, DEFAULT_HAND.name)
    return with_gains(file, DEFAULT_HAND.parent, gains_beside(DEFAULT_HAND))
