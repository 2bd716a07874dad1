"""What both exports share: a finger's links as rigid parts, and numbers and rotations as text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np

from awiwi_gen.hand import Finger, Hand, Link
from awiwi_gen.hand.palm import Palm
from awiwi_gen.interchange.fits import coupler_fit
from awiwi_gen.interchange.frames import about, turn_matrix
from awiwi_gen.interchange.model import Array, Loss

_OF_JOINTS = ("low", "high", "four_bar", "armature", "damping", "friction", "spring", "effort", "sensor")
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
    def at_zero(self) -> tuple[Array, Array]:
        """The axes (3 x 3) and the origin (3) of its frame in the one before, where its joint is at zero."""
        if self.link.slides:
            return self.axes, self.position - self.axes[:, 2] * self.reference
        return self.axes @ about(2, -self.reference), self.position

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
        if link.four_bar is None:
            found.append(Part(link, axes, position, value(link.reference)))
        else:
            found += _crank_and_coupler(link, axes, position)
        position = vector(link.offset)
    return found


def coupler_of(joint: str) -> str:
    """The name of the hinge between the crank and the coupler of a joint with a four-bar."""
    return f"{joint}.coupler"


def _crank_and_coupler(link: Link, axes: Array, position: Array) -> list[Part]:
    """A link with a four-bar as two in series: a crank without mass, which is the joint, and its coupler, the body.

    They are drawn where the coupler is parallel to the turned frame. The rocker is a function of the crank's angle.
    """
    bar, start = link.four_bar, float(link.start)
    if bar is None:
        raise ValueError(f"{link.joint} has no four-bar")
    turned = about(2, float(bar.reference) + start)
    crank = link.model_copy(update=dict.fromkeys(("mass", "com", "inertia")))
    coupler = link.model_copy(update=dict.fromkeys(_OF_JOINTS) | {"joint": coupler_of(link.joint)})
    return [Part(crank, axes @ turned, position, start), Part(coupler, turned.T, vector((bar.crank, 0, 0)), 0.0)]


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
    rough = [f"{n} {link.joint}" for n, f in hand.fingers.items() for link in f.links if link.friction is not None]
    ranges = [f"{n} {link.joint}" for n, f in hand.fingers.items() for link in f.links
              if link.sensor is not None and link.sensor.quantities()]  # fmt: skip
    clock = ["clock"] * (hand.clock is not None) + ["motor.current"] * bool(hand.motor and hand.motor.current)
    return [
        Loss(FRICTION, tuple(rough)),
        Loss("resolution and range of joint sensors", tuple(ranges)),
        Loss("period of the controller and currents of motors", tuple(clock)),
    ]


def coupler_losses(hand: Hand, degree: int) -> Loss:
    """How far the couplers of four-bars are from polynomials of this degree."""
    places = [
        f"{name} {link.joint} by {coupler_fit(link, degree).error:.2g} rad"
        for name, finger in hand.fingers.items()
        for link in finger.links
        if link.four_bar is not None
    ]
    polynomial = "a line" if degree == 1 else f"a polynomial of degree {degree}"
    return Loss(f"four-bars: the coupler's angle is {polynomial} in the crank's, and differs at most", tuple(places))
