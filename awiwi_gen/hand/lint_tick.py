"""Protection values and sensors that contradict the rest of a hand, or are unusual beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from awiwi_gen.hand.actuation import Motor
from awiwi_gen.hand.parts import Finger, Keys, Limits, Link
from awiwi_gen.hand.plausibility import Remark

__all__ = ["current_complaints", "effort_remarks", "joint_complaints"]

Complaint = tuple[Keys, str]

_COARSEST = 0.1  # of the joint's range


def joint_complaints(link: Link, follows: bool) -> Iterator[Complaint]:
    """A joint's protection value and sensor."""
    if link.effort and follows:
        yield ("effort",), f'= "{link.effort}" is at a joint that follows another; expected it at its leader'
    sensor = link.sensor
    if sensor is None:
        return
    ends = [("low", sensor.low, sensor.high), ("high", sensor.high, sensor.low)]
    for key, own, other in ends:
        if own is None and other is not None:
            yield ("sensor", key), 'is missing; expected an angle such as "20 deg" (a range has two ends)'
    if sensor.low and sensor.high and sensor.low.value >= sensor.high.value:
        yield ("sensor", "low"), f'= "{sensor.low}" is not below high = "{sensor.high}"'
    if link.low is None or link.high is None:
        return
    if sensor.low and sensor.low.value > link.low.value:
        yield ("sensor", "low"), f'= "{sensor.low}" is above the joint\'s low = "{link.low}", where it measures nothing'
    if sensor.high and sensor.high.value < link.high.value:
        yield (
            ("sensor", "high"),
            f'= "{sensor.high}" is below the joint\'s high = "{link.high}", where it measures nothing',
        )
    width = float(link.high) - float(link.low)
    if sensor.resolution and float(sensor.resolution) > _COARSEST * width > 0:
        yield ("sensor", "resolution"), f'= "{sensor.resolution}" is more than a tenth of the joint\'s range'


def current_complaints(motor: Motor) -> Iterator[Complaint]:
    """The largest current gives the largest torque."""
    if motor.current:
        torque = float(motor.current.largest) * float(motor.current.constant)
        if torque < float(motor.torque):
            most = f'{torque:.4g} N m, but torque = "{motor.torque}"; expected a larger current or a smaller torque'
            yield ("current", "largest"), f'= "{motor.current.largest}" gives at most {most}'


def effort_remarks(limits: Limits, fingers: Mapping[str, Finger]) -> Iterator[Remark]:
    """Joints that may have larger torques than those for which kernels are verified."""
    for name, finger in fingers.items():
        for index, link in enumerate(finger.links):
            most = limits.slide_force if link.slides else limits.joint_torque
            if link.effort and most and link.effort.value > most.value:
                key = "slide_force" if link.slides else "joint_torque"
                verified = f'limits.{key} = "{most}", up to which kernels are verified'
                ratio = float(link.effort) / float(most)
                keys: Keys = ("fingers", name, "links", index, "effort")
                yield Remark(keys, f'= "{link.effort}" is above {verified}', ratio)
