"""hand.h: what firmware needs of the hand beside its kernels, by name and in the order of their arrays.

Counts, places of fingers in arrays over the whole hand, limits, pulleys, sensors, the motor, and where fingers stand; and
what these files were made from, as macros and as symbols of the compiled library.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from awiwi_gen.cache import key
from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.hand.pose import fixed_rotation
from awiwi_gen.hand.tick import tick_values
from awiwi_gen.kernels.estimates import joint_limits
from awiwi_gen.kernels.fingers import force_range

PER_LINE = 6


@dataclass(frozen=True)
class Constant:
    """An array of numbers of the hand: its name behind the prefix, its size in C, its values, and what it is.

    An array of arrays has their length as ``width``.
    """

    name: str
    size: str
    values: Sequence[Any]
    doc: str
    width: int = 0

    def lines(self, options: Options) -> list[str]:
        """The values as lines of C."""
        texts = [options.literal(Fraction(value)) for value in self.values]
        if self.width:
            return [f"{{{', '.join(texts[i : i + self.width])}}}," for i in range(0, len(texts), self.width)]
        return [", ".join(texts[i : i + PER_LINE]) + "," for i in range(0, len(texts), PER_LINE)]


def header_files(hand: Hand, options: Options, made_from: Any, has_tick: bool) -> dict[str, str]:
    """hand.h, and hand.c with its constants; ``made_from`` are the digests of all other files."""
    prefix, digest = hand.prefix, key(hand.digest(), tick_values(hand), options, made_from)
    found = {
        "banner": banner(),
        "tick": has_tick,
        "prefix": prefix,
        "c_type": options.c_type,
        "options": {"SCALAR": options.scalar, "MATH": options.math, "PARAMS": options.params},
        "digest": digest,
        "build": f"0x{digest[:8]}u",
        "fingers": fingers(hand),
        "joints": enumerators([(name, joint) for name, finger in hand.fingers.items() for joint in finger.joints]),
        "tendons": enumerators(
            [(name, str(i)) for name, f in hand.fingers.items() for i in range(len(f.transmissions))]
        ),
        "motors": motors_of_tendons(hand),
        "constants": [(constant, constant.lines(options)) for constant in constants(hand)],
        "numbers": [(name, options.literal(Fraction(value)), doc) for name, value, doc in numbers(hand)],
    }
    return {"hand.h": render("hand.h.j2", **found), "hand.c": render("hand.c.j2", **found)}


def fingers(hand: Hand) -> list[tuple[str, int, int, int, int]]:
    """Of each finger its name, its first joint and their number, its first tendon and their number."""
    return [
        (name.upper(), columns.start, columns.stop - columns.start, rows.start, rows.stop - rows.start)
        for name, (rows, columns) in hand.blocks.items()
    ]


def motors_of_tendons(hand: Hand) -> list[int]:
    """The motor of every tendon, where one pulls tendons of several fingers; else none."""
    motor = {place: number for number, places in enumerate(hand.motors) for place in places}
    return [motor[place] for place in range(hand.tendons)] if hand.across else []


def enumerators(pairs: Sequence[tuple[str, str]]) -> list[str]:
    """A name for each (finger, joint or number): where two would be the same, the place in the list follows."""
    names = ["_".join(pair).upper() for pair in pairs]
    times = Counter(names)
    return [name if times[name] == 1 else f"{name}_{i}" for i, name in enumerate(names)]


def constants(hand: Hand) -> Iterator[Constant]:
    """The arrays of a hand; those over tendons only where motors pull some."""
    ends = [joint_limits(finger) for finger in hand.fingers.values()]
    doc = "The largest torques that the joints bear in N m, of slides in N: their own, or the hand's limit."
    yield Constant(
        "joint_effort", "JOINTS", [most for finger in hand.fingers.values() for most in efforts(hand, finger)], doc
    )
    radii = [finger.radii.get(joint, 0) for finger in hand.fingers.values() for joint in finger.joints]
    for name, which in (("low", 0), ("high", 1)):
        doc = f"The {name} limits of the joints in rad, of slides in m."
        yield Constant(f"joint_{name}", "JOINTS", [x for pair in ends for x in pair[which]], doc)
    yield Constant("pulley_radius", "JOINTS", [float(r) for r in radii], "Pulleys of the joints in m; 0 where none is.")
    poses = [x for finger in hand.fingers.values() for x in base_pose(finger)]
    doc = "Poses (4 x 4, row by row) of the fingers' base frames in the palm's, in 1 and m."
    yield Constant("finger_base", "FINGERS", poses, doc, 16)
    if not hand.tendons:
        return
    low, high = force_range(hand)
    yield Constant("tendon_low", "TENDONS", [low] * hand.tendons, "The least force of each tendon in N.")
    yield Constant("tendon_high", "TENDONS", [high] * hand.tendons, "The greatest force of each tendon in N.")
    if hand.spring:
        units = [hand.spring.calibrated.get(i, hand.spring).sensor for i in range(hand.tendons)]
        slack, taut = ([float(getattr(unit, end)) for unit in units] for end in ("slack", "taut"))
        yield Constant("sensor_slack", "TENDONS", slack, "Readings of the springs' sensors where the lever is slack.")
        yield Constant("sensor_taut", "TENDONS", taut, "The same where it is taut.")


def efforts(hand: Hand, finger: Any) -> Iterator[float]:
    """The largest torque or force of each independent joint of a finger."""
    for link in finger.links:
        if link.joint in finger.joints:
            limit = hand.limits.slide_force if link.slides else hand.limits.joint_torque
            yield float(link.effort or limit or 0)


def numbers(hand: Hand) -> Iterator[tuple[str, float, str]]:
    """The single numbers of a hand: a macro's name behind the prefix, the value, and what it is."""
    if hand.clock:
        yield "PERIOD", float(hand.clock.period), "of the clock on which the controller runs [s]"
    if motor := hand.motor:
        yield "MOTOR_INERTIA", motor.inertia, "rotor and gear at the output shaft [kg m^2]"
        yield "MOTOR_GEAR_RATIO", float(motor.gear_ratio), "turns of the input per turn of the output shaft"
        yield "MOTOR_PULLEY", float(motor.pulley), "radius that winds the tendon [m]"
        yield "MOTOR_TORQUE", float(motor.torque), "largest torque of the output shaft [N m]"
        yield "MOTOR_VELOCITY", float(motor.velocity), "largest velocity of the output shaft [rad/s]"
        if motor.current:
            yield "MOTOR_CURRENT", float(motor.current.largest), "largest current [A]"
            yield (
                "MOTOR_CURRENT_TORQUE",
                float(motor.current.constant),
                "torque of the output shaft per current [N m/A]",
            )
        yield "MOTOR_TRAVEL", float(motor.travel), "the output shaft turns by this much to either side [rad]"


def base_pose(finger: Any) -> list[float]:
    """The pose (16) of a finger's base frame in the palm, row by row; the identity without a `base`."""
    if finger.base is None:
        return [float(i % 5 == 0) for i in range(16)]
    axes = fixed_rotation(finger.base)
    place = [float(x) for x in finger.base.position]
    rows = [[*(axis[row] for axis in axes), place[row]] for row in range(3)]
    return [x for row in (*rows, [0.0, 0.0, 0.0, 1.0]) for x in row]
