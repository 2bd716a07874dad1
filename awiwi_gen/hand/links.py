"""Links of a finger and the joints that move them, and the base that a finger stands on: their part of the schema."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PrivateAttr

from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.names import JointName, Source
from awiwi_gen.hand.part import Angle, Mass, Moment, Part, Point, Product, Size
from awiwi_gen.hand.tick import Effort, JointSensor
from awiwi_gen.units import Quantity, parse_quantity

Turn = Annotated[Literal["none", "x+90", "x-90", "y+90", "y-90", "z+90", "z-90"], Field(examples=['"none"', '"x+90"'])]
# Joints with a spool turn several times.
JointAngle = Annotated[Quantity, Measure("20 deg", "-1440 deg", "1440 deg")]
JointPosition = Annotated[Quantity, Measure("20 deg", "-1440 deg", "1440 deg", (Measure("12 mm", "-1 m", "1 m"),))]
Rpy = Annotated[tuple[Angle, Angle, Angle], Field(strict=False, examples=['["0 deg", "12.5 deg", "0 deg"]'])]
Quarters = tuple[int | None, int | None, int | None]
"""Of each angle of an `Rpy`: its number of quarter turns, 0 to 3, or None for an angle between these."""

_QUARTER = parse_quantity("90 deg").value
_OPTIONAL = ("reference", "armature", "damping", "friction", "spring")  # numbers whose presence is structure


def quarters_of(rpy: tuple[Quantity, Quantity, Quantity] | None) -> Quarters:
    """Which of the angles are quarter turns, and how many."""
    turns = [angle.value / _QUARTER for angle in rpy or ()]
    roll, pitch, yaw = [int(turn) % 4 if turn.denominator == 1 else None for turn in turns] or (0, 0, 0)
    return roll, pitch, yaw


class Inertia(Part):
    """Inertia tensor about the centre of mass in link axes; `xy` is an entry of it: minus the integral of x y dm."""

    xx: Moment
    yy: Moment
    zz: Moment
    xy: Product
    xz: Product
    yz: Product


class FourBar(Part):
    """Planar four-bar: the joint turns the crank, the link is the coupler. Crank angle = reference + joint angle.

    The crank turns at the origin, the rocker's pivot lies at distance `ground` on the x axis from which crank angles
    count; `branch` tells the open assembly from the crossed one.
    """

    ground: Size
    crank: Size
    coupler: Size
    rocker: Size
    reference: Angle
    branch: Annotated[Literal[1, -1], Field(examples=["1", "-1"])]
    source: Source


class Friction(Part):
    """Dry friction of a joint: torque * 2/pi * atan(joint velocity / velocity), which is smooth at rest.

    A slide has a force instead of the torque.
    """

    torque: Annotated[Quantity | None, Measure("0.02 N m", "0 N m", "1000 N m")] = None
    force: Annotated[Quantity | None, Measure("0.5 N", "0 N", "10000 N")] = None
    velocity: Annotated[
        Quantity,
        Measure("0.05 rad/s", "1e-6 rad/s", "1000 rad/s", (Measure("2 mm/s", "1e-9 m/s", "100 m/s"),)),
    ]

    @property
    def level(self) -> Any:
        """The torque, or the force of a slide."""
        return self.torque if self.force is None else self.force


class JointSpring(Part):
    """A linear spring in a joint, without torque at the joint angle `reference`, or without force at a slide's position."""

    stiffness: Annotated[
        Quantity,
        Measure("0.5 N m/rad", "0 N m/rad", "10000 N m/rad", (Measure("200 N/m", "0 N/m", "1000000000 N/m"),)),
    ]
    reference: JointPosition


class Rotated(Part):
    """A part with a fixed rotation `rpy`, which its class declares among its keys."""

    if TYPE_CHECKING:
        rpy: Rpy | None
    _quarters: Quarters = PrivateAttr((0, 0, 0))  # structure: it stays where numbers become symbols

    def model_post_init(self, context: Any, /) -> None:
        """Note which angles of `rpy` are quarter turns."""
        self._quarters = quarters_of(self.rpy)

    @property
    def quarters(self) -> Quarters:
        """Of each angle of `rpy`, its number of quarter turns, or None."""
        return self._quarters


class Link(Rotated):
    """A rigid body and the joint that moves it: first the fixed `turn` and `rpy`, then the joint's rotation about z.

    The rotation is by the joint angle less `reference`. `offset` leads from this joint to the next one (or to the
    fingertip), `com` to the centre of mass, in link axes. A link without `mass` is a joint only. `armature` is the
    inertia of a rotor as the joint sees it, `damping` a torque per velocity. `effort` is the largest torque that the joint
    bears, as in URDF.

    A joint of the `kind` "slide" moves along z instead, by its position less `reference`: lengths stand for angles, forces
    for torques and masses for moments of inertia.
    """

    joint: JointName
    turn: Turn = "none"
    low: JointPosition | None = None
    high: JointPosition | None = None
    offset: Point
    mass: Mass | None = None
    com: Point | None = None
    inertia: Annotated[Inertia | None, Field(examples=['{ xx = "35 g mm^2", ... }'])] = None
    four_bar: FourBar | None = None
    kind: Annotated[Literal["hinge", "slide"], Field(examples=['"hinge"', '"slide"'])] = "hinge"
    rpy: Rpy | None = None
    reference: JointPosition | None = None
    armature: Annotated[
        Quantity | None, Measure("1e-6 kg m^2", "0 kg m^2", "10 kg m^2", (Measure("20 g", "0 g", "1000 kg"),))
    ] = None
    damping: Annotated[
        Quantity | None,
        Measure("0.01 N m s/rad", "0 N m s/rad", "1000 N m s/rad", (Measure("0.5 N s/m", "0 N s/m", "100000 N s/m"),)),
    ] = None
    friction: Friction | None = None
    spring: JointSpring | None = None
    effort: Annotated[Effort | None, Field(exclude=True)] = None
    sensor: Annotated[JointSensor | None, Field(exclude=True)] = None
    source: Source
    _limit_next_to_zero: str = PrivateAttr("")  # structure: it stays where numbers become symbols

    def model_post_init(self, context: Any, /) -> None:
        """Note which limit is nearest to zero, if the range leaves zero out, and which fixed angles are quarter turns."""
        super().model_post_init(context)
        above, below = (self.low and self.low.value > 0), (self.high and self.high.value < 0)
        self._limit_next_to_zero = "low" if above else "high" if below else ""

    @property
    def start(self) -> Any:
        """The joint angle of the range that is nearest to zero: there a coupler is parallel to the turned frame."""
        return getattr(self, self._limit_next_to_zero) if self._limit_next_to_zero else 0

    @property
    def slides(self) -> bool:
        """Whether the joint moves along its z axis instead of turning about it."""
        return self.kind == "slide"

    @property
    def passive(self) -> bool:
        """Whether the joint has a torque of its own: damping, friction or a spring."""
        return any(part is not None for part in (self.damping, self.friction, self.spring))

    def four_bar_structure(self) -> Any:
        """None, the branch, or the branch and the limit where the coupler starts."""
        branch = self.four_bar and self.four_bar.branch
        return [branch, self._limit_next_to_zero] if branch and self._limit_next_to_zero else branch

    def structure(self) -> list[Any]:
        """Everything but the numbers."""
        extras: dict[str, Any] = {key: True for key in _OPTIONAL if getattr(self, key) is not None}
        if self.mass is None:
            extras["massless"] = True
        if self.slides:
            extras["slide"] = True
        if self._quarters != (0, 0, 0):
            extras["quarters"] = self._quarters
        return [self.joint, self.turn, self.four_bar_structure(), *([extras] if extras else [])]


class Base(Rotated):
    """Where the base frame of a finger stands in the palm: its origin, and its rotation as in URDF."""

    position: Point
    rpy: Rpy
    source: Source

    @property
    def turn(self) -> str:
        """No turn besides `rpy`."""
        return "none"
