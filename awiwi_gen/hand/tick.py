"""What a control tick needs besides kernels: its period, and what motors, joints and sensors bear.

No kernel reads these numbers, so they are no part of a hand's digest: of the generated C only hand.h has them. Kernels do
depend on which joints have sensors, where others have none.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.names import Source
from awiwi_gen.hand.part import Keys, Part
from awiwi_gen.units import Quantity

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand
    from awiwi_gen.hand.links import Link

__all__ = ["Clock", "Current", "Effort", "JointSensor", "joint_numbers", "tick_lines", "tick_values"]

_EFFORT = Measure("0.5 N m", "1e-9 N m", "1000 N m", (Measure("20 N", "1e-6 N", "100000 N"),))
_READING = Measure("20 deg", "-1440 deg", "1440 deg", (Measure("12 mm", "-1 m", "1 m"),))
_STEP = Measure("0.1 deg", "1e-9 deg", "90 deg", (Measure("0.1 mm", "1e-9 m", "100 mm"),))
Effort = Annotated[Quantity, _EFFORT]
_Reading = Annotated[Quantity, _READING]


class Clock(Part):
    """The clock on which the hand's controller runs."""

    period: Annotated[Quantity, Measure("333 us", "1 us", "1 s")]
    source: Source


class Current(Part):
    """The largest current that a motor bears, and its torque at the output shaft per current."""

    largest: Annotated[Quantity, Measure("2 A", "1e-6 A", "10000 A")]
    constant: Annotated[Quantity, Measure("0.6 N m/A", "1e-9 N m/A", "10000 N m/A")]


class JointSensor(Part):
    """A sensor of a joint's angle: its least step, and the range that it measures; an empty table has neither."""

    resolution: Annotated[Quantity, _STEP] | None = None
    low: _Reading | None = None
    high: _Reading | None = None


def joint_numbers(link: Link) -> Iterator[tuple[Keys, Quantity, Measure]]:
    """The numbers of a joint that a tick needs: where they are, and what they must be."""
    sensor = link.sensor or JointSensor()
    for keys, quantity, measure in (
        (("effort",), link.effort, _EFFORT),
        (("sensor", "resolution"), sensor.resolution, _STEP),
        (("sensor", "low"), sensor.low, _READING),
        (("sensor", "high"), sensor.high, _READING),
    ):
        if quantity is not None:
            yield keys, quantity, measure


def tick_values(hand: Hand) -> dict[str, str]:
    """Path -> value of everything that a tick needs, as the file has it; a sensor alone is "measured"."""
    found = {"clock.period": str(hand.clock.period)} if hand.clock else {}
    if hand.motor and hand.motor.current:
        found |= {f"motor.current.{key}": str(value) for key, value in hand.motor.current.quantities().items()}
    for name, finger in hand.fingers.items():
        for link in finger.links:
            path = f"fingers.{name}.{link.joint}"
            if link.effort:
                found[f"{path}.effort"] = str(link.effort)
            if link.sensor:
                own = [f"{key} {value}" for key, value in link.sensor.quantities().items()]
                found[f"{path}.sensor"] = ", ".join(own) or "measured"
    return found


def tick_lines(hand: Hand) -> list[str]:
    """The same as lines of text."""
    return [f"tick: {path} = {value}" for path, value in tick_values(hand).items()]
