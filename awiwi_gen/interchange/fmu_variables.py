"""The variables of the two FMUs: members of the structs of csrc/awiwi_hand.h, by finger, joint and tendon."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.resources import CSRC
from awiwi_gen.tick.loop import PRETENSION, HandStep, SimulatedHand
from awiwi_gen.tick.status import LAWS, MODES

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand
    from awiwi_gen.library import Library

AXES = ("x", "y", "z")
CHOICES = {"law": LAWS, "mode": MODES}
# The kinds of the C: the type of FMI, and the type in the structs.
KINDS = {
    "REAL": ("Float64", "awiwi_real"),
    "INTEGER": ("Int32", "int"),
    "WORD": ("UInt32", "unsigned"),
    "FLAG": ("Boolean", "unsigned char"),
    "SWITCH": ("Boolean", "int"),
    "CHOICE": ("Int64", "int"),
}
FIELDS = {"double": "REAL", "int": "INTEGER", "unsigned int": "WORD", "unsigned char": "FLAG"}
# What rotations measure, of joints that slide.
SLIDES = {"rad": "m", "rad/s": "m/s", "rad/s^2": "m/s^2", "N m": "N", "N m/rad": "N/m", "N m s/rad": "N s/m"}

# Member, what it is an array over, unit, what it is.
INPUTS = (
    ("reading", "tendon", "1", "reading of the spring's sensor, as it counts"),
    ("reading_valid", "tendon", "", "whether the reading is valid"),
    ("theta", "tendon", "rad", "angle of the motor's output shaft as measured"),
    ("theta_valid", "tendon", "", "whether the angle is valid"),
    ("wrist", "wrist", "rad", "angle of the wrist"),
    ("gravity", "axis", "m/s^2", "acceleration of the free fall in the palm's axes"),
    ("q_des", "joint", "rad", "wanted position"),
    ("qd_des", "joint", "rad/s", "its rate"),
    ("qdd_des", "joint", "rad/s^2", "its second derivative"),
    ("torque", "joint", "N m", "torque to add to the joint"),
    ("stiffness", "joint", "N m/rad", "wanted stiffness"),
    ("damping", "joint", "N m s/rad", "wanted damping"),
    ("tip", "tip", "m", "wanted place of the fingertip in the finger's base frame"),
    ("tip_stiffness", "finger", "N/m", "of the spring at the fingertip; 0 for none"),
    ("tip_damping", "finger", "N s/m", "of the damper at the fingertip"),
    ("law", "", "", "the law by which motors give the tendon forces"),
    ("enable", "", "", "false fades all torques out"),
    ("reset", "", "", "true ends a fault that is gone"),
)
TELEMETRY = (
    ("q", "joint", "rad", "estimated position"),
    ("qd", "joint", "rad/s", "its rate"),
    ("tau", "joint", "N m", "wanted joint torque"),
    ("f", "tendon", "N", "measured tendon force"),
    ("f_des", "tendon", "N", "wanted tendon force"),
    ("heat", "tendon", "1", "1 where the motor is as hot as it may be"),
    ("share", "finger", "1", "of the torques that the finger's motors get"),
    ("mode", "finger", "", "off, run, hold, ramp or fault"),
    ("tendon_status", "tendon", "", "bits of AWIWI_READING_LOST and so on"),
    ("finger_status", "finger", "", "the same of a finger with its tendons"),
)
SURROUNDINGS = (
    ("gravity", "axis", "m/s^2", "acceleration of the free fall in the palm's axes"),
    ("wrist", "wrist", "rad", "angle of the wrist"),
    ("load", "joint", "N m", "torque from outside"),
)
FAULTS = (
    ("damping", "joint", "N m s/rad", "of the link"),
    ("spring", "tendon", "1", "force of the spring over that of its calibration; 0 for a cut tendon"),
    ("friction", "", "1", "of the motors, over that of the hand"),
    ("added_inertia", "", "1", "of the links, as a share of their own; it has no weight"),
    ("reading_noise", "", "1", "standard deviation of readings, in counts"),
    ("theta_step", "", "rad", "of the motors' sensors; 0 for none"),
)
MOTION = (
    ("q", "joint", "rad", "position"),
    ("qd", "joint", "rad/s", "its rate"),
    ("f", "tendon", "N", "tendon force"),
    ("thd", "tendon", "rad/s", "rate of the motor's output shaft"),
    ("lever", "tendon", "1", "reading without noise"),
)
SENSED = ("reading", "theta")


@dataclass(frozen=True)
class Variable:
    """One variable: where it is in the model (a designator of C), its kind, unit and start value."""

    name: str
    member: str
    kind: str
    role: str  # INPUT, TUNABLE, FIXED or TOLD
    causality: str
    variability: str
    unit: str = ""
    doc: str = ""
    start: Any = None
    choices: str = ""

    @property
    def type(self) -> str:
        """The type of FMI."""
        return KINDS[self.kind][0]

    @property
    def start_c(self) -> str:
        """The start value in C."""
        return repr(float(self.start)) if self.kind == "REAL" else str(int(self.start))

    @property
    def start_text(self) -> str:
        """The start value in XML."""
        return str(bool(self.start)).lower() if self.type == "Boolean" else self.start_c


TIME = Variable("time", "time", "REAL", "TOLD", "independent", "continuous", "s", "the time of the simulation")


class Places:
    """Names of the elements of a hand's arrays, and the units of joints that slide."""

    def __init__(self, hand: Hand) -> None:
        slides = {f"{name}.{joint}" for name, finger in hand.fingers.items() for joint in finger.sliding}
        joints = [f"{name}.{joint}" for name, finger in hand.fingers.items() for joint in finger.joints]
        self.sliding = [joint in slides for joint in joints]
        self.names = {
            "": [""],
            "axis": list(AXES),
            "finger": list(hand.fingers),
            "joint": joints,
            "tendon": [
                f"{name}.tendon_{i}" for name, finger in hand.fingers.items() for i in range(len(finger.transmissions))
            ],
            "tip": [f"{finger}.{axis}" for finger in hand.fingers for axis in AXES],
            "wrist": ["q71", "q73"] if hand.wrist else [],
        }

    def of(self, over: str, unit: str) -> Iterator[tuple[str, str, str]]:
        """Of each element its name, its index in C, and its unit."""
        for index, name in enumerate(self.names[over]):
            place = f"[{index // 3}][{index % 3}]" if over == "tip" else f"[{index}]" if over else ""
            slides = over == "joint" and self.sliding[index]
            yield name, place, SLIDES.get(unit, unit) if slides else unit


def _variables(
    places: Places, rows: Any, struct: Any, of_model: str, role: str, causality: str, variability: str
) -> Iterator[Variable]:
    """A variable for each element of the members of a struct, which has their start values unless they are TOLD."""
    for member, over, unit, doc in rows:
        values = np.asarray(getattr(struct, member))
        kind = FIELDS[{"f8": "double", "i4": "int", "u4": "unsigned int", "u1": "unsigned char"}[values.dtype.str[1:]]]
        kind = {"law": "CHOICE", "mode": "CHOICE", "enable": "SWITCH", "reset": "SWITCH"}.get(member, kind)
        when = "discrete" if kind != "REAL" and variability == "continuous" else variability
        for (name, index, own), value in zip(places.of(over, unit), values.ravel(), strict=False):
            yield Variable(
                ".".join(part for part in (member, name) if part), f"{of_model}.{member}{index}", kind, role,
                causality, when, own, doc, None if role == "TOLD" else value, member if member in CHOICES else "",
            )  # fmt: skip


def _plain(
    places: Places, name: str, member: str, over: str, unit: str, doc: str, values: Any,
    role: str, causality: str, variability: str,
) -> Iterator[Variable]:  # fmt: skip
    """A variable for each element of an array of the model itself."""
    values = np.broadcast_to(np.asarray(values), len(places.names[over]))
    for (element, index, own), value in zip(places.of(over, unit), values, strict=True):
        text = f"{name}.{element}" if element else name
        start = None if role == "TOLD" else value
        yield Variable(text, f"{member}{index}", "REAL", role, causality, variability, own, doc, start)


def plant_variables(hand: Hand, library: Library) -> list[Variable]:
    """Those of the simulated hand, by value reference. It rests in the middle of its joints' ranges."""
    places, simulated, middle, force = Places(hand), *at_rest(library)
    world, measured = simulated.world, HandStep(library).input
    torque = np.full(simulated.tendons, simulated.plant.hand.motor_pulley * force)
    start = ("FIXED", "parameter", "fixed")
    found = [TIME]
    found += _plain(places, "torque", "torque", "tendon", "N m", "torque of the motor's output shaft; positive "
                    "winds up", torque, "INPUT", "input", "discrete")  # fmt: skip
    found += _variables(places, SURROUNDINGS, world, "world", "INPUT", "input", "continuous")
    sensed = [row for row in INPUTS if row[0] in SENSED]
    found += _variables(places, sensed, measured, "sensors", "TOLD", "output", "discrete")
    found += _variables(places, FAULTS, world, "world", "TUNABLE", "parameter", "tunable")
    found += _plain(places, "start.q", "q", "joint", "rad", "position at the start", middle, *start)
    found += _plain(places, "start.theta", "theta", "tendon", "rad", "angle of the motor at the start", 0, *start)
    found += _plain(places, "start.force", "force", "", "N", "force of all tendons at the start, about", force, *start)
    numbers = (("seed", "", "", "of the sensors' noise"), ("substeps", "", "", "steps of integration in a period"))
    found += _variables(places, numbers, world, "world", *start)
    found += _variables(places, MOTION, world, "world", "TOLD", "local", "continuous")
    return found


def controller_variables(hand: Hand, library: Library) -> list[Variable]:
    """Those of the tick, by value reference. It starts with the sensors of the simulated hand at rest."""
    places, simulated, middle, _ = Places(hand), *at_rest(library)
    step = HandStep(library)
    simulated.measure(step.input)
    step.suggest(middle)
    step.input.q_des, step.input.enable = middle, 1
    found = [TIME]
    found += _variables(places, INPUTS, step.input, "input", "INPUT", "input", "discrete")
    found += _plain(places, "motor_torque", "torque", "tendon", "N m", "torque of the motor, on its output shaft; positive "
                    "winds up", 0, "TOLD", "output", "discrete")  # fmt: skip
    status = (("status", "", "", "bits of AWIWI_READING_LOST and so on, of all fingers"),)
    found += _variables(places, status, step.state, "state", "TOLD", "output", "discrete")
    found += _gain_variables(places, step.gains)
    found += _plain(
        places, "start.q", "q", "joint", "rad", "known position at the start", middle, "FIXED", "parameter", "fixed"
    )
    found += _variables(places, TELEMETRY, step.state, "state", "TOLD", "local", "discrete")
    return found


@dataclass(frozen=True)
class Gain:
    """A member of awiwi_hand_gains: one number, or for all ``over`` one for each of ``parts``, which are (name, unit)."""

    name: str
    over: str
    parts: tuple[tuple[str, str], ...]
    doc: str


def gains() -> Iterator[Gain]:
    """Every gain but the period with the units and the words that the header has for it, or for the one before."""
    header = (CSRC / "awiwi_hand.h").read_text(encoding="utf-8")
    body = header.partition("typedef struct awiwi_hand_gains {")[2].partition("}")[0]
    before = ""
    for name, sizes, comment in re.findall(r"(?:awiwi_real|int) (\w+)((?:\[\w+\])*);(?:\s*/\*(.*?)\*/)?", body):
        before = comment or before
        named = [(words, unit) for words, unit in re.findall(r"([^\[\]]*)\[([^\]]*)\]", before)]
        if sizes:
            parts = [(part, unit) for words, unit in named for part in re.findall(r"\w+", words)]
        else:
            parts = [("", named[0][1] if named else "" if name.endswith("_ticks") else "1")]
        if name != "period":
            over = next((kind for kind in ("joint", "finger", "tendon") if f"ALL_{kind.upper()}S" in sizes), "")
            yield Gain(name, over, tuple(parts), re.sub(r"\s*\[[^\]]*\]", "", before).strip())


def _gain_variables(places: Places, struct: Any) -> Iterator[Variable]:
    """A variable for each number of all gains."""
    for gain in gains():
        values = getattr(struct, gain.name)
        kind = "INTEGER" if values.dtype.kind == "i" else "REAL"
        rows = values.reshape(-1, len(gain.parts))
        for j, (place, row) in enumerate(zip(places.names[gain.over], rows, strict=False)):
            for i, ((part, unit), value) in enumerate(zip(gain.parts, row, strict=True)):
                yield Variable(
                    ".".join(word for word in ("gains", gain.name, place, part) if word),
                    f"gains.{gain.name}[{j}][{i}]" if gain.over else f"gains.{gain.name}",
                    kind, "TUNABLE", "parameter", "tunable", unit, gain.doc, value,
                )  # fmt: skip


def at_rest(library: Library) -> tuple[SimulatedHand, Any, float]:
    """The simulated hand, its pose (joints,) in the middle of the joints' ranges, and the force [N] of its tendons."""
    step, simulated = HandStep(library), SimulatedHand(library)
    low, high = step.limits()
    middle, force = (low + high) / 2, PRETENSION * float(step.gains.force_low[0])
    simulated.world.wrist = resting_wrist(library)
    simulated.place(middle, 0.0, force)
    return simulated, middle, force


def resting_wrist(library: Library) -> Any:
    """The middle (2,) of the wrist's ranges [rad]; zeros for a hand without a wrist."""
    if "wrist_tendon_lengths" not in library:
        return np.zeros(2)
    return [(port["low"][0] + port["high"][0]) / 2 for port in library.wrist_tendon_lengths.inputs]
