"""Every fault in closed loop, for a while, and then a reset."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.tick.loop import ClosedLoop
from awiwi_gen.tick.status import FAULTS, MODES, names_of

if TYPE_CHECKING:
    from awiwi_gen.library import Library

BEFORE, DURING, AFTER, RESET = 600, 1800, 3000, 300  # ticks; the reset comes RESET ticks after the fault
SWING = 0.1  # rad, of all joints


@dataclass(frozen=True)
class Victim:
    """Where a fault strikes: a finger, one of its tendons and of its joints, in arrays over the whole hand."""

    finger: int
    tendon: int
    joint: int
    tendons: slice

    @classmethod
    def of(cls, loop: ClosedLoop) -> Victim:
        """The last tendon and joint but one of the second finger, or of the only one."""
        index = min(1, loop.step.fingers - 1)
        finger = loop.step.model.finger[index]
        first, last = finger.first_tendon, finger.first_tendon + finger.tendons
        joint = finger.first_joint + max(finger.joints - 3, 0)
        return cls(index, max(last - 5, first), joint, slice(first, last))


@dataclass
class Outcome:
    """What became of a fault: status bits, modes of its finger and of the others.

    ``delay`` is the tick in which a fault was told, -1 if none was; ``bound`` and ``jump`` are the greatest torque and
    its greatest change in a tick [N m]; ``recovered`` is the greatest error [rad] of all joints at the end.
    """

    name: str
    seen: int = 0
    modes: set[str] = field(default_factory=set)
    others: set[str] = field(default_factory=set)
    delay: int = -1
    bound: float = 0.0
    jump: float = 0.0
    recovered: float = 0.0

    def add(self, loop: ClosedLoop, victim: Victim, tick: int, change: Any) -> None:
        """Count a tick, the first one of the fault is 0."""
        self.seen |= loop.step.status
        if self.delay < 0 and loop.step.status & FAULTS:
            self.delay = tick
        for index, mode in enumerate(loop.step.state.mode):
            (self.modes if index == victim.finger else self.others).add(MODES[mode])
        self.bound = max(self.bound, float(np.abs(loop.step.torque).max()))
        self.jump = max(self.jump, float(np.abs(change).max()))

    def as_dict(self) -> dict[str, Any]:
        """The same, ready for JSON."""
        return {**asdict(self), "seen": names_of(self.seen), "modes": sorted(self.modes), "others": sorted(self.others)}


Fault = Callable[[ClosedLoop, Victim], None]


def _reading(value: float) -> Fault:
    """A sensor reads so many counts of its span."""

    def apply(loop: ClosedLoop, victim: Victim) -> None:
        slack, taut = loop.step.model.sensor_slack[victim.tendon], loop.step.model.sensor_taut[victim.tendon]
        loop.step.input.reading[victim.tendon] = slack + value * (taut - slack)

    return apply


def _noisy(loop: ClosedLoop, victim: Victim) -> None:
    loop.step.input.reading[victim.tendon] += 5 * np.sin(1e4 * float(loop.hand.world.tick[0]) ** 2)


def _set(member: str, value: float, part: str = "", of_world: bool = False) -> Fault:
    """An input, or a number of the world, is overwritten: at the victim's tendon, joint, ..., or everywhere."""

    def apply(loop: ClosedLoop, victim: Victim) -> None:
        target = getattr(loop.hand.world if of_world else loop.step.input, member)
        target[getattr(victim, part) if part else ...] = value

    return apply


FAULTS_BY_NAME: dict[str, Fault] = {
    "a reading is lost": _set("reading_valid", 0, "tendon"),
    "a reading is NaN": _set("reading", np.nan, "tendon"),
    "a reading is stuck": _reading(0.25),
    "a reading is absurd": _reading(3),
    "a reading is ten times as noisy": _noisy,
    "a motor's angle is lost": _set("theta_valid", 0, "tendon"),
    "a motor's angle is NaN": _set("theta", np.nan, "tendon"),
    "a motor's angle jumps": _set("theta", 3.0, "tendon"),
    "all readings of a finger are lost": _set("reading_valid", 0, "tendons"),
    "the wrist's angles are impossible": _set("wrist", 3.0),
    "references are NaN": _set("q_des", np.nan),
    "references are far beyond limits": _set("q_des", 10.0),
    "torques that no force can give": _set("torque", 5.0),
    "a load that makes tendons slack": _set("load", 0.5, "joint", of_world=True),
    "a tendon is cut": _set("spring", 0.0, "tendon", of_world=True),
    "an unknown law": _set("law", 77),
}


def suffered(library: Library, name: str, law: int) -> Outcome:
    """One fault while all joints swing; then a reset. Raises InputError for a hand without a tick."""
    loop, found = ClosedLoop(library), Outcome(name)
    victim, end = Victim.of(loop), BEFORE + DURING + AFTER
    last = loop.step.torque.copy()
    for tick in range(end):
        loop.hand.world.load, loop.hand.world.spring = 0, 1
        loop.hand.measure(loop.step.input)
        loop.step.input.q_des = loop.start + SWING * np.sin(2 * np.pi * tick / 3000)
        loop.step.input.law, loop.step.input.torque = law, 0
        loop.step.input.reset = int(tick >= BEFORE + DURING + RESET)
        if BEFORE <= tick < BEFORE + DURING:
            FAULTS_BY_NAME[name](loop, victim)
        loop.hand.move(loop.step.step())
        if tick >= BEFORE:
            found.add(loop, victim, tick - BEFORE, loop.step.torque - last)
        if tick >= end - 100:
            error = np.abs(loop.hand.world.q - loop.step.state.motion[:, 0]).max()
            found.recovered = max(found.recovered, float(error))
        last[:] = loop.step.torque
    return found
