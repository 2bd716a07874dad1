"""The palm behind a wrist of joints in series, as a hand file describes it: from the forearm to the palm's frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from awiwi_gen.hand.links import Base, JointAngle, Rotated, Rpy, Turn
from awiwi_gen.hand.names import JointName, Source
from awiwi_gen.hand.part import Keys, Point

__all__ = ["MOST_AXES", "Palm", "PalmJoint", "palm_complaints"]

MOST_AXES = 3
_NARROWEST_RANGE = 0.01  # deg, as of a finger's joint


class PalmJoint(Rotated):
    """A joint between forearm and palm: first the fixed `turn` and `rpy`, then the joint's rotation about z.

    The rotation is by the joint angle less `reference`. `offset` leads from this joint to the next one, or to the palm.
    """

    joint: JointName
    turn: Turn = "none"
    rpy: Rpy | None = None
    reference: JointAngle | None = None
    low: JointAngle
    high: JointAngle
    offset: Point
    source: Source

    @property
    def four_bar(self) -> None:
        """None: such a joint rotates the palm itself."""
        return

    @property
    def slides(self) -> bool:
        """Whether it slides: it turns."""
        return False

    def structure(self) -> list[Any]:
        """Everything but the numbers."""
        return [self.joint, self.turn, self.quarters, self.reference is not None]


class Palm(Rotated):
    """A palm on one to three joints: `base` says where they stand in the forearm, `rpy` how the palm stands on them."""

    joints: Annotated[
        tuple[PalmJoint, ...],
        Field(strict=False, min_length=1, max_length=MOST_AXES, examples=["[[palm.joints]]"]),
    ]
    rpy: Rpy | None = None
    base: Base | None = None
    source: Source

    @property
    def turn(self) -> str:
        """No turn besides `rpy`."""
        return "none"

    @property
    def links(self) -> tuple[PalmJoint, ...]:
        """The joints, by the name that a finger's chain has for them."""
        return self.joints

    @property
    def couplings(self) -> tuple[()]:
        """None: no joint of the palm follows another."""
        return ()

    @property
    def range(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Lower and upper limits of the joints [rad]."""
        return tuple(float(each.low) for each in self.joints), tuple(float(each.high) for each in self.joints)

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers, ready for JSON."""
        return {
            "joints": [joint.structure() for joint in self.joints],
            "quarters": self.quarters,
            "base": self.base and self.base.quarters,
        }


def palm_complaints(palm: Palm) -> Iterator[tuple[Keys, str]]:
    """Faults of a palm whose single values are valid: names, and the order of limits."""
    names = [each.joint for each in palm.joints]
    for index, each in enumerate(palm.joints):
        if each.joint in names[:index]:
            yield (
                ("joints", index, "joint"),
                f'= "{each.joint}" is the joint of joints[{names.index(each.joint)}] already',
            )
        width = math.degrees(each.high.value - each.low.value)
        if width <= 0:
            yield ("joints", index, "low"), f'= "{each.low}" is not below high = "{each.high}"'
        elif width < _NARROWEST_RANGE:
            least = f"expected {_NARROWEST_RANGE} deg or more"
            message = f'= "{each.high}" leaves a range of {width:.2g} deg from low = "{each.low}"; {least}'
            yield ("joints", index, "high"), message
