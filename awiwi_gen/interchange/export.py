"""What both exports share: a finger's links as rigid parts, and numbers and rotations as text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np

from awiwi_gen.hand import Finger, Hand
from awiwi_gen.hand.palm import Palm
from awiwi_gen.interchange.frames import about, turn_matrix
from awiwi_gen.interchange.model import Array, Loss

FRICTION = (
    "dry friction is a smooth curve in the hand: the format has its torque, without the velocity at which it rises"
)


@dataclass(frozen=True, eq=False)
class Part:
    """A link of a finger, or a joint of the wrist: its fixed rotation (3 x 3) and position (3) in the one before."""

    link: Any  # Link or PalmJoint
    axes: Array
    position: Array
    reference: float

    @property
    def inertia(self) -> Array:
        """The tensor (3 x 3) about the centre of mass [kg m^2]."""
        tensor = self.link.inertia
        x, y, z, xy, xz, yz = (float(getattr(tensor, key)) for key in ("xx", "yy", "zz", "xy", "xz", "yz"))
        return np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])


def parts(finger: Finger) -> list[Part]:
    """All links of a finger, base to tip."""
    found, position = [], np.zeros(3)
    for link in finger.links:
        axes = turn_matrix(link.turn) @ rpy_matrix(link.rpy)
        found.append(Part(link, axes, position, value(link.reference)))
        position = vector(link.offset)
    return found


def palm_parts(palm: Palm) -> list[Part]:
    """The joints of the wrist, from the forearm to the palm; the first stands in the forearm where `base` says."""
    base = palm.base
    axes, position = rpy_matrix(base.rpy if base else None), vector(base.position) if base else np.zeros(3)
    found = []
    for joint in palm.joints:
        found.append(
            Part(joint, axes @ turn_matrix(joint.turn) @ rpy_matrix(joint.rpy), position, value(joint.reference))
        )
        axes, position = np.eye(3), vector(joint.offset)
    return found


@dataclass(frozen=True, eq=False)
class Drawn:
    """Parts one after the other as drawn: the frame of the last, and each joint's axis and anchor, in the parent's frame."""

    axes: Array
    position: Array
    seats: list[tuple[Part, Array, Array]]

    @classmethod
    def of(cls, parts: Iterable[Part]) -> Drawn:
        """Compose the fixed rotations and positions of parts."""
        axes, position, seats = np.eye(3), np.zeros(3), []
        for part in parts:
            position = position + axes @ part.position
            axes = axes @ part.axes
            seats.append((part, axes[:, 2], position))
        return cls(axes, position, seats)

    def then(self, offset: Array, rotation: Array) -> Drawn:
        """The same with a frame behind the last."""
        return Drawn(self.axes @ rotation, self.position + self.axes @ offset, self.seats)


def rpy_matrix(rpy: Any) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll) (3 x 3)."""
    roll, pitch, yaw = (float(each) for each in rpy or (0, 0, 0))
    return np.asarray(about(2, yaw) @ about(1, pitch) @ about(0, roll))


def value(quantity: Any) -> float:
    """A number of the hand in SI; 0 for what the hand file leaves out."""
    return float(quantity) if quantity is not None else 0.0


def vector(point: Iterable[Any]) -> Array:
    """A point of the hand (3) in metres."""
    return np.array([float(x) for x in point])


def text(numbers: Iterable[float] | float) -> str:
    """Numbers with all digits, as XML has them."""
    values = [numbers] if isinstance(numbers, int | float) else list(numbers)
    return " ".join(repr(float(x) + 0.0).removesuffix(".0") for x in values)


def document(root: ElementTree.Element, hand: Hand) -> str:
    """An XML document with a comment of its origin."""
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    name = hand.name.replace("--", "- -")
    return f"<!-- {name}: written by awiwi-gen export; SI units, radians. -->\n{body}\n"


def common_losses(hand: Hand) -> list[Loss]:
    """What neither format holds."""
    four_bars = [name for name, finger in hand.fingers.items() if has_four_bar(finger)]
    whole = [key for key in ("motor", "spring", "tendon") if getattr(hand, key) is not None]
    rough = [f"{n} {link.joint}" for n, f in hand.fingers.items() for link in f.links if link.friction is not None]
    return [
        Loss("fingers with a four-bar: left out", tuple(four_bars)),
        Loss("the wrist: the palm is the root", ("wrist",) if hand.wrist else ()),
        Loss("mechanisms between motor and tendon: friction, ripple, lever springs, fibres", tuple(whole)),
        Loss(FRICTION, tuple(rough)),
    ]


def has_four_bar(finger: Finger) -> bool:
    """Whether a joint turns a crank."""
    return any(link.four_bar is not None for link in finger.links)
