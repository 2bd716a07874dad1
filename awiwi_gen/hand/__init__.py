"""The hand: a frozen tree of the numbers that CAD gives, read from one file and checked before anyone may use it.

    hand = Hand.load()                            # the Awiwi hand; Hand.load("my_hand.toml") for another one
    float(hand.fingers["index"].radii["pip"])     # 0.006, in metres
    hand.symbolic(lambda path, _: Symbol(path))   # the same tree, with fingers.index.pulleys[2].radius in its place

The parts of a hand are in `parts`, reading a file is in `file`, what physics demands is in `lint`.
"""

from __future__ import annotations

import os
from typing import Annotated, Any

from pydantic import Field

from awiwi_gen.hand.actuation import Fibre, Motor, Spring
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.gains import Gains, gains_complaints, with_gains
from awiwi_gen.hand.lint import complaints
from awiwi_gen.hand.lint_actuation import actuator_complaints
from awiwi_gen.hand.parts import Finger, FingerName, Limits, Link, Part, Prefix, Title
from awiwi_gen.hand.wrist import Wrist
from awiwi_gen.resources import DEFAULT_HAND

__all__ = ["Fibre", "Finger", "Hand", "Limits", "Link", "Motor", "Spring", "Wrist"]


class Hand(Part):
    """A whole hand; the order of its fingers is the order of their tendons in the forearm."""

    prefix: Prefix
    name: Title
    limits: Limits
    fingers: Annotated[
        dict[FingerName, Finger], Field(min_length=1, max_length=8, examples=["[[fingers.index.links]]"])
    ]
    wrist: Wrist | None = None
    motor: Motor | None = None
    spring: Spring | None = None
    tendon: Fibre | None = None
    gains: Gains = ()

    @property
    def tendons(self) -> int:
        """How many tendons the fingers have together."""
        return sum(len(finger.tendons) for finger in self.fingers.values())

    @property
    def blocks(self) -> dict[str, tuple[slice, slice]]:
        """Finger -> its tendons and its joints in arrays over all tendons and joints of the hand."""
        found, row, column = {}, 0, 0
        for name, finger in self.fingers.items():
            tendons, joints = len(finger.tendons), len(finger.joints)
            found[name] = slice(row, row + tendons), slice(column, column + joints)
            row, column = row + tendons, column + joints
        return found

    def structure(self) -> dict[str, Any]:
        """What the kernels of the whole hand depend on besides numbers, ready for JSON."""
        fingers = {name: finger.structure() for name, finger in self.fingers.items()}
        return {"fingers": [*fingers.items()], "wrist": self.wrist and self.wrist.structure()}

    @classmethod
    def load(cls, path: str | os.PathLike[str] | None = None) -> Hand:
        """Read a hand file; without a path, the Awiwi hand of this package.

        Raises `InputError` with every fault of the first stage that fails: reading, schema, physics.
        """
        return cls._checked(HandFile.read(path) if path is not None else HandFile.read(DEFAULT_HAND, DEFAULT_HAND.name))

    @classmethod
    def parse(cls, text: str, name: str = "hand.toml") -> Hand:
        """Like `load`, from text; `name` is what messages call the file."""
        return cls._checked(HandFile.parse(text, name))

    @classmethod
    def _checked(cls, file: HandFile) -> Hand:
        hand = with_gains(file).validated(cls)
        found = list(complaints(hand.limits, hand.fingers, hand.wrist))
        found += actuator_complaints(hand.motor, hand.spring, hand.tendon, hand.tendons)
        found += gains_complaints(hand.gains, hand.tendons)
        if found:
            raise file.error(found)
        return hand
