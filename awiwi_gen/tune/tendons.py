"""Gains of all tendons from a file of costs: `awiwi-gen tune --costs costs.toml -o gains.toml` (chapter 16).

    [cost]
    Q = [100.0, 0.01, 0.01, 0.01]  # weights of the squares of q, q', tau, tau' in SI; or a 4 x 4 matrix
    R = 0.1                        # weight of the square of the motor's torque
    pretension = "10 N"            # tendon force at which the springs' stiffness is taken

    [fingers.thumb]                # optional: costs of one finger
    R = 1.0

Every tendon is tuned as one half of its joint; each joint has the same number of tendons. Two motors of
inertia b behind springs k move the link as one motor 2 b behind a spring 2 k does, with half the weights (section
15.5); so the regulator is that of a single joint, and its gains are those of either motor. Gains that the hand's
clock, of 3 kHz without `[clock]`, would make unstable are refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, PlainValidator

import awiwi_gen
from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand import Finger, Hand
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.gains import TendonGains
from awiwi_gen.hand.parts import Measure, Part
from awiwi_gen.loops.hand_joint import drives, period_of
from awiwi_gen.loops.joint import Loop, Plant
from awiwi_gen.loops.nearest import least
from awiwi_gen.loops.regulator import Gains, cancelling, exact_gains, loop_of, pretension_loop, regulator
from awiwi_gen.simulate import PERIOD, Array
from awiwi_gen.units import Quantity

Rows = tuple[tuple[float, ...], ...]
GAINS = {
    name: note.unit
    for name, field in TendonGains.model_fields.items()
    for note in field.metadata
    if isinstance(note, Measure)
}
DECADES = 12  # of the largest factor on R that is tried
HALVINGS = 8  # of a decade: to 1 %


def _cost_matrix(value: object) -> Rows:
    """Four numbers, or four rows of four, as a positive semidefinite matrix."""
    try:
        given = np.array(value, dtype=float)
    except (TypeError, ValueError):
        given = np.empty(0)
    if given.shape not in ((4,), (4, 4)):
        raise ValueError("is neither 4 numbers nor 4 rows of 4")
    if not np.isfinite(given).all():
        raise ValueError("has entries that are not finite")
    rows = np.diag(given) if given.ndim == 1 else given
    if not np.array_equal(rows, rows.T):
        raise ValueError("is not symmetric")
    if np.linalg.eigvalsh(rows).min() < -1e-12 * np.abs(rows).max():
        raise ValueError("has a negative eigenvalue: some motion would have a negative cost")
    if rows[0, 0] <= 0:
        raise ValueError("does not weigh the position q")
    return tuple(map(tuple, rows.tolist()))


def _weight(value: object) -> float:
    """A positive number."""
    if not isinstance(value, int | float) or not 0 < value < float("inf"):
        raise ValueError("is not a positive number")
    return float(value)


Matrix = Annotated[Rows, PlainValidator(_cost_matrix), Field(examples=["[100.0, 0.01, 0.01, 0.01]"])]
Weight = Annotated[float, PlainValidator(_weight), Field(examples=["0.1"])]
Force = Annotated[Quantity, Measure("10 N", "0", "10 kN")]


class Cost(Part):
    """Costs of a joint's motion, and the tendon force at which its springs' stiffness is taken."""

    Q: Matrix
    R: Weight
    pretension: Force


class OwnCost(Part):
    """Costs of one finger; missing ones are those of all fingers."""

    Q: Matrix | None = None
    R: Weight | None = None
    pretension: Force | None = None


class CostFile(Part):
    """A file of costs."""

    cost: Cost
    fingers: dict[str, OwnCost] = Field(default_factory=dict)

    def of(self, finger: str) -> Cost:
        """The cost for a finger."""
        own = self.fingers.get(finger, OwnCost())
        return self.cost.model_copy(update={key: value for key, value in own if value is not None})


@dataclass(frozen=True)
class Tuned:
    """Gains of a tendon: its number in the hand, its joint, spectral radius and delay margin on the hand's clock."""

    tendon: int
    joint: str
    plant: Plant
    gains: Gains
    sampled_radius: float
    delay_margin: float

    def values(self) -> dict[str, float]:
        """The gains by their keys in a file of gains."""
        return dict(zip(GAINS, map(float, (*self.gains.gains, *self.gains.weights)), strict=True))

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        clock = {"sampled_radius": self.sampled_radius, "delay_margin": self.delay_margin}
        return {"tendon": self.tendon, "joint": self.joint, **self.values(), **clock}


def tune_hand(hand: Hand, costs: Path) -> list[Tuned]:
    """Gains of every tendon of a hand from a file of costs. Raises InputError with all its faults."""
    read = read_costs(costs, hand)
    return tune(awiwi_gen.build(hand), hand, read)


def read_costs(path: Path, hand: Hand) -> CostFile:
    """Read a file of costs. Raises InputError with all its faults."""
    file = HandFile.read(path)
    costs = file.validated(CostFile)
    known = ", ".join(hand.fingers)
    strange = [name for name in costs.fingers if name not in hand.fingers]
    if strange:
        raise file.error([(("fingers", name), f"is no finger of this hand; it has {known}") for name in strange])
    return costs


def tune(library: Any, hand: Hand, costs: CostFile) -> list[Tuned]:
    """Gains of every tendon of the hand. Raises InputError that names each tendon for which there are none."""
    tuned, faults = [], []
    for name, finger in hand.fingers.items():
        cost = costs.of(name)
        driven = plants(library, hand, name, finger, float(cost.pretension)) if finger.pulled else []
        for index, (joint, plant) in enumerate(driven):
            tendon = hand.blocks[name][0].start + index
            try:
                tuned.append(tune_tendon(library, tendon, joint, plant, np.array(cost.Q), cost.R, period_of(hand)))
            except InputError as error:
                faults.append(Fault(message=f"tendon {tendon} ({name}, {joint}): {error}"))
    if faults:
        raise InputError(faults)
    return tuned


def plants(library: Any, hand: Hand, name: str, finger: Finger, force: float) -> list[tuple[str, Plant]]:
    """Joint and plant of each tendon, in joint coordinates: the finger straight, its other joints held.

    Raises InputError for a hand without motors or springs, and for a force that its springs cannot have.
    """
    if hand.motor is None or hand.spring is None:
        raise InputError("gains need a hand with the sections [motor] and [spring]")
    if finger.sliding:
        raise InputError(f"gains are of joints that turn, but {finger.sliding[0]} of fingers.{name} slides")
    elongation = library.spring_elongation(force)
    if elongation.status:
        raise InputError(f"pretension = {force:g} N is beyond what the hand's springs can hold")
    k = float(library.spring_stiffness(elongation.x).k)
    return [
        (finger.joints[each.joint], Plant(each.link, 2 * each.motor, 2 * k * each.arm**2))
        for each in drives(library, name, float(hand.motor.pulley))
    ]


def tune_tendon(
    library: Any, tendon: int, joint: str, plant: Plant, Q: Array, R: float, period: float = PERIOD
) -> Tuned:
    """Gains of one tendon of a pair, on a clock of this period [s].

    Raises InputError with the least stable R if they are unstable.
    """
    single, loops = _regulated(library, plant, Q, R, period)
    radius = max(loop.sampled_radius(period=period) for loop in loops)
    margin = min(loop.delay_margin() for loop in loops)
    if radius >= 1:
        raise InputError(
            f"R = {R:g} gives gains that are unstable at {1 / period:.0f} Hz and a delay of one sample (spectral "
            f"radius {radius:.3g}, delay margin {margin * 1e6:.0f} us); {_way_out(library, plant, Q, R, period)}"
        )
    return Tuned(tendon, joint, plant, Gains(single.gains, 2 * single.weights), radius, margin)


def _regulated(library: Any, plant: Plant, Q: Array, R: float, period: float) -> tuple[Gains, tuple[Loop, Loop]]:
    """The gains of the regulator, and the loops of the link and of the pretension."""
    wanted = regulator(plant, Q, R) + cancelling(plant)
    gains = exact_gains(library, plant, wanted, period)
    return gains, (loop_of(plant, wanted), pretension_loop(plant, gains))


def _way_out(library: Any, plant: Plant, Q: Array, R: float, period: float) -> str:
    """The least stable R, found by bisection, in words."""

    def works(share: float) -> bool:
        _, loops = _regulated(library, plant, Q, 10 ** (DECADES * share) * R, period)
        return all(loop.sampled_radius(period=period) < 1 for loop in loops)

    bracket = least(works, DECADES, HALVINGS)
    if bracket is None:
        ringing = np.sqrt(plant.k * (1 / plant.m + 1 / plant.b)) / (2 * np.pi)
        return f"no R helps, for link and spring ring at {ringing:.0f} Hz"
    return f"R = {10 ** (DECADES * bracket[1]) * R:.3g} is the least that works"


def write_gains(path: Path, tuned: list[Tuned]) -> None:
    """Write a file of gains, numbers with all digits. Raises InputError if it cannot be written."""
    lines = ['# Written by awiwi-gen tune; a hand file takes it in with: gains = "gains.toml"']
    for each in tuned:
        lines += ["", "[[gains]]", f"tendon = {each.tendon}  # {each.joint}"]
        lines += [f'{name} = "{value!r} {GAINS[name]}"' for name, value in each.values().items()]
        lines.append('source = "awiwi-gen tune"')
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from None
