"""What no motor, spring or fibre can have: complaints as in `lint`, with the lever angle that fails."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from awiwi_gen.hand.actuation import CalibratedUnit, Fibre, Motor, Sensor, Spring
from awiwi_gen.hand.lever import CURVE_NODES, Lever, Pose
from awiwi_gen.hand.lint import Complaint, below, sources
from awiwi_gen.hand.lint_tick import current_complaints

__all__ = ["actuator_complaints"]

_STEPS = 200
_FARTHEST_ANGLE = 1000.0  # rad; sines of larger arguments lose too many digits, and the generated sincos refuses them
_LARGEST_CURVE_ERROR = 1e-6  # of the largest force: far below what a sensor of 12 bits resolves
_LEAST_LEVERAGE = 0.02  # of the lever's arm: nearer to a dead point, force and stiffness have no useful bound


def actuator_complaints(
    motor: Motor | None, spring: Spring | None, tendon: Fibre | None, tendons: int
) -> Iterator[Complaint]:
    """All faults of actuators whose single values are valid, for a hand with so many tendons."""
    if motor:
        yield from below(("motor",), _motor(motor))
    if spring:
        yield from below(("spring",), _spring(spring, tendons))
    if tendon:
        yield from below(("tendon",), sources(tendon))
    if motor and spring and motor.pulley != spring.motor.radius:
        same = f'motor.pulley = "{motor.pulley}"; they are the same pulley'
        yield ("spring", "motor", "radius"), f'= "{spring.motor.radius}" is not {same}'


def _motor(motor: Motor) -> Iterator[Complaint]:
    yield from sources(motor)
    yield from current_complaints(motor)
    rotation = float(motor.travel) * float(motor.gear_ratio)
    harmonic = max((ripple.harmonic for ripple in motor.ripple if ripple.shaft == "input"), default=0)
    if rotation * harmonic > _FARTHEST_ANGLE:
        limit = f"harmonic {harmonic} of its ripple is computed to {_FARTHEST_ANGLE:.0f}/{harmonic} rad"
        yield ("travel",), f'= "{motor.travel}" turns the rotor by {rotation:.6g} rad; {limit}'
    lines = [(ripple.shaft, ripple.harmonic) for ripple in motor.ripple]
    for index, line in enumerate(lines):
        if line in lines[:index]:
            first = lines.index(line)
            yield ("ripple", index), f"is harmonic {line[1]} of the {line[0]} shaft, which ripple[{first}] is already"


def _spring(spring: Spring, tendons: int) -> Iterator[Complaint]:
    yield from sources(spring)
    yield from below(("sensor",), _sensor(spring.sensor))
    if spring.slack == spring.taut:
        yield ("taut",), f'= "{spring.taut}" is where the lever is slack: it would not move'
        return
    fault = _obstacle(spring)
    if fault:
        yield (), fault
    elif (error := Lever(spring).curve_error()) > _LARGEST_CURVE_ERROR:
        misses = f"a polynomial through {CURVE_NODES} samples would miss its force by {error:.1g} of the largest"
        yield ("taut",), f'= "{spring.taut}" is too near a dead point: {misses}; end the travel earlier'
    for index, unit in enumerate(spring.units):
        yield from below(("units", index), _unit(spring.units, index, tendons))
        if not fault and (own_fault := _obstacle(spring.model_copy(update=unit.measured()))):
            yield ("units", index), own_fault


def _sensor(sensor: Sensor) -> Iterator[Complaint]:
    if sensor.slack.value == sensor.taut.value:
        yield ("taut",), f'= "{sensor.taut}" is what it reads when slack: it would measure nothing'


def _unit(units: Sequence[CalibratedUnit], index: int, tendons: int) -> Iterator[Complaint]:
    """A unit belongs to an existing tendon, which has no other unit."""
    unit = units[index]
    yield from sources(unit)
    if unit.sensor:
        yield from below(("sensor",), _sensor(unit.sensor))
    if unit.tendon >= tendons:
        yield ("tendon",), f"= {unit.tendon} is no tendon of this hand; expected 0 to {tendons - 1}"
    first = next(i for i, other in enumerate(units) if other.tendon == unit.tendon)
    if first < index:
        yield ("tendon",), f"= {unit.tendon} is units[{first}] already"


def _obstacle(spring: Spring) -> str:
    """The first lever angle where the mechanism is no convex spring, and why; empty if there is none."""
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
        return f"the tendon leaves the roller, with a wrap angle of {pose.wrap:.4g} rad"
    if not pose.stretch > 0:
        return f"the spring is not stretched but {-pose.stretch * 1e3:.4g} mm too short to pull"
    if not pose.force > 0:
        return f"the tendon's force is {pose.force:.4g} N; the spring pulls the lever the wrong way"
    if not pose.stiffness > 0:
        return f"the stiffness is {pose.stiffness:.4g} N/m, so the force does not rise"
    return ""
