"""What the tick is put through on the simulated hand: long motions, and every fault in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.tick.loop import ClosedLoop
from awiwi_gen.tick.status import FAULTS, MODES, names_of

if TYPE_CHECKING:
    from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
Calls = Callable[[ClosedLoop], None] | None
SWING = 0.35  # of a joint's range to either side
LOAD = 0.05  # rad, by which the largest torque from outside deflects a joint of the wanted stiffness
WRIST_SWING = 0.15  # rad
CHUNK = 3000


@dataclass(frozen=True)
class Motion:
    """What a long run showed: errors [rad] of joints against their filtered references, forces [N], torques [N m].

    ``slack`` is the share of tendon ticks in which a tendon had no force; ``seen`` are all status bits.
    """

    seconds: float
    law: int
    rms: float
    worst: float
    least_force: float
    greatest_force: float
    greatest_torque: float
    slack: float
    seen: int

    def as_dict(self) -> dict[str, Any]:
        """The same, ready for JSON."""
        return {**self.__dict__, "seen": names_of(self.seen)}


def moved(library: Library, seconds: float, law: int, seed: int = 0, log: Calls = None, begin: Calls = None) -> Motion:
    """All joints swing, the wrist moves and loads come and go, for some seconds [s].

    ``begin`` is called at the start, ``log`` after each tick.

    Raises InputError for a hand without a tick, or where the simulated hand leaves what its model describes.
    """
    loop = ClosedLoop(library, seed=seed)
    loop.step.input.law = law
    if begin:
        begin(loop)
    period = float(loop.step.gains.period[0])
    random = np.random.default_rng(seed)
    low, high = loop.step.limits()
    rates, phases = random.uniform(0.1, 1.0, (2, len(low))) * 2 * np.pi, random.uniform(0, 2 * np.pi, (2, len(low)))
    squares, worst, count, seen = 0.0, 0.0, 0, 0
    forces, torque, slack = [np.inf, -np.inf], 0.0, 0
    wrist = loop.hand.world.wrist.copy()
    for demand, load, turn in _demands(round(seconds / period), period, rates, phases, random):
        error, force = np.empty((len(demand), len(low))), np.empty((len(demand), loop.step.tendons))
        for tick in range(len(demand)):
            loop.hand.world.load = load * loop.step.input.stiffness
            loop.hand.world.wrist = wrist + turn[tick]
            loop.hand.measure(loop.step.input)
            loop.step.input.q_des = loop.start + SWING * (high - low) * demand[tick]
            loop.hand.move(loop.step.step())
            seen |= loop.step.status
            error[tick] = loop.hand.world.q - loop.step.state.motion[:, 0]
            force[tick] = loop.hand.world.f
            torque = max(torque, float(np.abs(loop.step.torque).max()))
            if log:
                log(loop)
        squares, count = squares + float((error**2).sum()), count + error.size
        worst = max(worst, float(np.abs(error).max()))
        forces = [min(forces[0], float(force.min())), max(forces[1], float(force.max()))]
        slack += int((force <= 0).sum())
    shares = slack / (count / len(low) * loop.step.tendons)
    return Motion(seconds, law, float(np.sqrt(squares / count)), worst, *forces, torque, shares, seen)


def _demands(ticks: int, period: float, rates: Array, phases: Array, random: Any) -> Iterator[tuple[Array, Array, Array]]:
    """Chunks of demands (ticks, joints) from -1 to 1, a load (joints,) [rad] for each, and wrist angles (ticks, 2) [rad]."""
    for first in range(0, ticks, CHUNK):
        time = np.arange(first, min(ticks, first + CHUNK))[:, None] * period
        rise = np.minimum(1, time / 0.5)  # from rest
        demand = rise * (np.sin(rates[0] * time + phases[0]) + np.sin(rates[1] * time + phases[1])) / 2
        turn = rise * WRIST_SWING * np.sin(2 * np.pi * time * (0.2, 0.13))
        yield demand, random.uniform(-LOAD, LOAD, rates.shape[1]), turn


# -- faults --------------------------------------------------------------------------------------------------

BEFORE, DURING, AFTER = 600, 1800, 3000  # ticks; the reset comes after a tenth of the last part
VICTIM, JOINT = 11, 5  # a tendon and a joint of the second finger


@dataclass(frozen=True)
class Outcome:
    """What became of a fault: status bits and modes of its finger, and of the others.

    ``bound`` is the greatest torque [N m]; ``recovered`` is the greatest error [rad] at the end, after the reset.
    """

    name: str
    seen: int
    modes: tuple[str, ...]
    others: tuple[str, ...]
    delay: int
    bound: float
    jump: float
    recovered: float

    def as_dict(self) -> dict[str, Any]:
        """The same, ready for JSON."""
        return {**self.__dict__, "seen": names_of(self.seen)}


def _set(part: str, member: str, value: Any, where: Any = ...) -> Callable[[ClosedLoop], None]:
    """A fault that overwrites numbers of the tick's input or of the world."""

    def apply(loop: ClosedLoop) -> None:
        target = loop.step.input if part == "input" else loop.hand.world
        getattr(target, member)[where] = value

    return apply


def _noisy(loop: ClosedLoop) -> None:
    loop.step.input.reading[VICTIM] += 5 * np.sin(1e4 * float(loop.hand.world.tick[0]) ** 2)


FAULTS_BY_NAME: dict[str, Callable[[ClosedLoop], None]] = {
    "a reading is lost": _set("input", "reading_valid", 0, VICTIM),
    "a reading is NaN": _set("input", "reading", np.nan, VICTIM),
    "a reading is stuck": _set("input", "reading", 1200, VICTIM),
    "a reading is absurd": _set("input", "reading", 9000, VICTIM),
    "a reading is ten times as noisy": _noisy,
    "a motor's angle is lost": _set("input", "theta_valid", 0, VICTIM),
    "a motor's angle is NaN": _set("input", "theta", np.nan, VICTIM),
    "a motor's angle is off by 1 rad": _set("input", "theta", 3.0, VICTIM),
    "all readings of a finger are lost": _set("input", "reading_valid", 0, slice(8, 16)),
    "the wrist's angles are impossible": _set("input", "wrist", 3.0),
    "references are NaN": _set("input", "q_des", np.nan),
    "references are far beyond limits": _set("input", "q_des", 10.0),
    "torques that no force can give": _set("input", "torque", 5.0),
    "a load that makes tendons slack": _set("world", "load", 0.5, JOINT),
    "a tendon is cut": _set("world", "spring", 0.0, VICTIM),
    "an unknown law": _set("input", "law", 77),
}


def suffered(library: Library, name: str, law: int) -> Outcome:
    """One fault for 0.6 s, while all joints swing; then a reset."""
    loop = ClosedLoop(library)
    fault, last, second = FAULTS_BY_NAME[name], loop.step.torque.copy(), 1
    modes, others, seen, delay = set[int](), set[int](), 0, -1
    bound = jump = recovered = 0.0
    for tick in range(BEFORE + DURING + AFTER):
        loop.hand.measure(loop.step.input)
        loop.step.input.q_des = loop.start + 0.1 * np.sin(2 * np.pi * tick / 3000)
        loop.step.input.law, loop.step.input.torque = law, 0
        loop.hand.world.load, loop.hand.world.spring = 0, 1
        loop.step.input.reset = int(tick >= BEFORE + DURING + AFTER // 10)
        if BEFORE <= tick < BEFORE + DURING:
            fault(loop)
        torque = loop.step.step()
        loop.hand.move(torque)
        if tick >= BEFORE:
            seen |= loop.step.status
            if delay < 0 and loop.step.status & FAULTS:
                delay = tick - BEFORE
            modes.add(int(loop.step.state.mode[second]))
            others |= {int(mode) for i, mode in enumerate(loop.step.state.mode) if i != second}
            bound = max(bound, float(np.abs(torque).max()))
            jump = max(jump, float(np.abs(torque - last).max()))
        last = torque.copy()
        if tick >= BEFORE + DURING + AFTER - 100:
            recovered = max(recovered, float(np.abs(loop.hand.world.q - loop.step.state.motion[:, 0]).max()))
    shown = (tuple(MODES[i] for i in sorted(each)) for each in (modes, others))
    return Outcome(name, seen, *shown, delay, bound, jump, recovered)
