"""The actuators as a hand file describes them: motors, lever springs and tendon fibres (chapters 3 and 4).

Each section is optional; a hand without it has no kernels of that kind. All tendons share one design of each. What
differs from unit to unit, a lever's spring and its sensor, is calibrated: `spring.units` overrides the design.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from awiwi_gen.hand.names import Source
from awiwi_gen.hand.parts import Angle, Length, Measure, Moment, Part, Size
from awiwi_gen.hand.tick import Current
from awiwi_gen.units import Quantity

__all__ = ["CalibratedUnit", "Fibre", "Friction", "Motor", "Ripple", "Roller", "Sensor", "Spring", "Wheel"]

Point2 = Annotated[tuple[Length, Length], Field(strict=False, examples=['["6 mm", "0 mm"]'])]
Reading = Annotated[Quantity, Measure("410", "-1000000", "1000000")]
Torque = Annotated[Quantity, Measure("0.5 N m", "1e-9 N m", "1000 N m")]
Winding = Annotated[Literal[1, -1], Field(examples=["1", "-1"])]


class Friction(Part):
    """Friction torque at the output shaft: atan(steepness w) level + viscosity w (eq. 3.8).

    At high speed the dry friction tends to level pi/2, not to level.
    """

    steepness: Annotated[Quantity, Measure("10 s/rad", "1e-6 s/rad", "1000000 s/rad")]
    level: Torque
    viscosity: Annotated[Quantity, Measure("0.03 N m s/rad", "1e-12 N m s/rad", "1000 N m s/rad")]


class Ripple(Part):
    """One periodic disturbance: amplitude sin(harmonic angle + phase), of the angle of one of the two shafts."""

    shaft: Annotated[Literal["input", "output"], Field(examples=['"input"'])]
    harmonic: Annotated[int, Field(ge=1, le=64, examples=["1"])]
    amplitude: Torque
    phase: Angle


class Motor(Part):
    """A motor with its gear and the pulley that winds up one tendon; torques and angles are those of the output shaft.

    `gear_ratio` counts turns of the input per turn of the output. `compensation` is the share of friction and ripple
    that is fed forward: below 1, because overcompensation adds energy to the motion.
    """

    rotor_inertia: Moment
    gear_inertia: Moment
    gear_ratio: Annotated[Quantity, Measure("100", "0.001", "10000")]
    pulley: Size
    friction: Annotated[Friction, Field(examples=['{ steepness = "10 s/rad", ... }'])]
    ripple: Annotated[tuple[Ripple, ...], Field(strict=False, max_length=16, examples=["[[motor.ripple]]"])] = ()
    compensation: Annotated[Quantity, Measure("0.9", "0.001", "1")]
    travel: Annotated[Quantity, Measure("10 rad", "1e-6 rad", "1000 rad")]
    velocity: Annotated[Quantity, Measure("20 rad/s", "0.001 rad/s", "10000 rad/s")]
    acceleration: Annotated[Quantity, Measure("1000 rad/s^2", "0.001 rad/s^2", "10000000 rad/s^2")]
    torque: Torque
    current: Annotated[Current | None, Field(exclude=True)] = None
    source: Source

    @property
    def inertia(self) -> float:
        """Of rotor and gear, as seen at the output shaft [kg m^2]."""
        return float(self.rotor_inertia) * float(self.gear_ratio) ** 2 + float(self.gear_inertia)

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers, ready for JSON."""
        return {"ripple": [[ripple.shaft, ripple.harmonic] for ripple in self.ripple]}


class Roller(Part):
    """A pulley under the tendon; winding 1 deflects the tendon, seen along its run, to the left, -1 to the right."""

    radius: Size
    winding: Winding


class Wheel(Roller):
    """A pulley with a fixed centre."""

    centre: Point2


class Sensor(Part):
    """Readings of the lever's angle sensor at both ends of the lever's travel; between them it is linear."""

    slack: Reading
    taut: Reading


class CalibratedUnit(Part):
    """The calibrated mechanism of one tendon: numbers measured on it, which replace those of the design.

    `tendon` counts all tendons of the hand from zero, finger by finger, in their order in the forearm.
    """

    tendon: Annotated[int, Field(ge=0, examples=["11"])]
    rate: Annotated[Quantity, Measure("7 N/mm", "0.001 N/m", "1000 kN/m")] | None = None
    free_length: Size | None = None
    sensor: Sensor | None = None
    source: Source

    def measured(self) -> dict[str, Any]:
        """The keys of the design that this unit overrides, with its values."""
        own = {"rate": self.rate, "free_length": self.free_length, "sensor": self.sensor}
        return {key: value for key, value in own.items() if value is not None}


class Spring(Part):
    """The mechanism that makes a tendon elastic (tables 4.1, figure 4.6), drawn in its own plane.

    The tendon runs from the motor's pulley over the roller on a lever to a fixed pulley. Pulled, it turns the lever,
    which stretches a spring from `anchor` to a point at `spring_arm` from the pivot, at `spring_angle` to the arm.
    The lever angle counts from x and goes from `slack` to `taut`.
    """

    motor: Wheel
    fixed: Wheel
    roller: Roller
    pivot: Point2
    arm: Size
    slack: Angle
    taut: Angle
    anchor: Point2
    spring_arm: Size
    spring_angle: Angle
    rate: Annotated[Quantity, Measure("7 N/mm", "0.001 N/m", "1000 kN/m")]
    free_length: Size
    sensor: Sensor
    units: Annotated[tuple[CalibratedUnit, ...], Field(strict=False, max_length=64, examples=["[[spring.units]]"])] = ()
    source: Source

    @property
    def calibrated(self) -> dict[int, Spring]:
        """Tendon -> its mechanism, for calibrated units: the design with the measured numbers."""
        return {unit.tendon: self.model_copy(update=unit.measured()) for unit in self.units}

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers, ready for JSON."""
        return {
            "windings": [wheel.winding for wheel in (self.motor, self.roller, self.fixed)],
            "units": [[unit.tendon, sorted(unit.measured())] for unit in self.units],
        }


class Fibre(Part):
    """The tendon's fibre, from spring to finger, and its guidings.

    `guiding` is the friction coefficient of the capstan equation (eq. 4.1), `bend` the largest total angle by which the
    guidings deflect a tendon.
    """

    modulus: Annotated[Quantity, Measure("90 GPa", "1 kPa", "1000 GPa")]
    section: Annotated[Quantity, Measure("0.2 mm^2", "1e-6 mm^2", "1000 mm^2")]
    length: Size
    guiding: Annotated[Quantity, Measure("0.05", "1e-6", "2")]
    bend: Annotated[Quantity, Measure("6 rad", "1e-6 rad", "100 rad")]
    source: Source

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers: nothing."""
        return {}
