"""What a schema cannot see in motors, springs and fibres: complaints as in `hand_lint`, with the angle that fails."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from awiwi_gen.hand_actuation import CalibratedUnit, Fibre, Motor, Sensor, Spring
from awiwi_gen.hand_lever import Lever, Pose
from awiwi_gen.hand_lint import Complaint, below, sources
from awiwi_gen.hand_parts import Finger

__all__ = ["actuator_complaints"]

_STEPS = 200
_LEAST_LEVERAGE = 0.02  # of the lever's arm: nearer to a dead point, force and stiffness have no bound worth its name


def actuator_complaints(
    motor: Motor | None, spring: Spring | None, tendon: Fibre | None, fingers: Mapping[str, Finger]
) -> Iterator[Complaint]:
    """All that is wrong with actuators whose single values are all right."""
    if motor:
        yield from below(("motor",), _motor(motor))
    if spring:
        yield from below(("spring",), _spring(spring, fingers))
    if tendon:
        yield from below(("tendon",), sources(tendon))
    if motor and spring and motor.pulley != spring.motor.radius:
        same = f'motor.pulley = "{motor.pulley}"; the mechanism begins at the pulley of the motor'
        yield ("spring", "motor", "radius"), f'= "{spring.motor.radius}" is not {same}'


def _motor(motor: Motor) -> Iterator[Complaint]:
    yield from sources(motor)
    lines = [(ripple.shaft, ripple.harmonic) for ripple in motor.ripple]
    for index, line in enumerate(lines):
        if line in lines[:index]:
            first = lines.index(line)
            yield ("ripple", index), f"is harmonic {line[1]} of the {line[0]} shaft, which ripple[{first}] is already"


def _spring(spring: Spring, fingers: Mapping[str, Finger]) -> Iterator[Complaint]:
    yield from sources(spring)
    yield from below(("sensor",), _sensor(spring.sensor))
    if spring.slack == spring.taut:
        yield ("taut",), f'= "{spring.taut}" is where the lever is slack: it would not move'
        return
    fault = _obstacle(spring)
    if fault:
        yield (), fault
    for index, unit in enumerate(spring.units):
        yield from below(("units", index), _unit(spring.units, index, fingers))
        own = {"rate": unit.rate or spring.rate, "free_length": unit.free_length or spring.free_length}
        if not fault and (own_fault := _obstacle(spring.model_copy(update=own))):
            yield ("units", index), own_fault


def _sensor(sensor: Sensor) -> Iterator[Complaint]:
    if sensor.slack.value == sensor.taut.value:
        yield ("taut",), f'= "{sensor.taut}" is what it reads when slack: it would measure nothing'


def _unit(units: Sequence[CalibratedUnit], index: int, fingers: Mapping[str, Finger]) -> Iterator[Complaint]:
    """A unit is that of an existing tendon, and the only one."""
    unit = units[index]
    yield from sources(unit)
    if unit.sensor:
        yield from below(("sensor",), _sensor(unit.sensor))
    if unit.finger not in fingers:
        yield ("finger",), f'= "{unit.finger}" names no finger; known here: {", ".join(fingers)}'
    elif unit.tendon >= len(fingers[unit.finger].tendons):
        last = len(fingers[unit.finger].tendons) - 1
        yield ("tendon",), f"= {unit.tendon} names no tendon of {unit.finger}; they are 0 to {last}"
    owners = [(other.finger, other.tendon) for other in units]
    if (first := owners.index(owners[index])) < index:
        yield ("tendon",), f"= {unit.tendon} of {unit.finger} is units[{first}] already"


def _obstacle(spring: Spring) -> str:
    """The first lever angle where the mechanism is no spring such as tendons need, and why; nothing if all is well."""
    lever = Lever(spring)
    stiffness = 0.0
    for angle in lever.angles(_STEPS):
        try:
            pose = lever.at(angle)
        except ValueError as error:
            return f"fails at a lever angle of {angle:.5g} rad: {error}"
        if reason := _fault(pose, lever):
            return f"fails at a lever angle of {angle:.5g} rad: {reason}"
        if not pose.stiffness > stiffness:
            found = f"stiffness goes from {stiffness:.5g} to {pose.stiffness:.5g} N/m as the force rises"
            return f"is not strictly convex at a lever angle of {angle:.5g} rad: {found}"
        stiffness = pose.stiffness
    return ""


def _fault(pose: Pose, lever: Lever) -> str:
    pays_out = -pose.leverage if lever.taut > lever.slack else pose.leverage  # m of tendon per rad towards taut
    if not pays_out > _LEAST_LEVERAGE * lever.arm:
        return f"the tendon turns the lever with an arm of {pays_out * 1e3:.4g} mm; dead points must stay far away"
    if not pose.wrap > 0:
        return f"the tendon leaves the roller, around which it turns by {pose.wrap:.4g} rad"
    if not pose.stretch > 0:
        return f"the spring is not stretched but {-pose.stretch * 1e3:.4g} mm too short to pull"
    if not pose.force > 0:
        return f"the tendon's force is {pose.force:.4g} N; the spring pulls the lever the wrong way"
    if not pose.stiffness > 0:
        return f"the stiffness is {pose.stiffness:.4g} N/m, so the force does not rise"
    return ""
