"""A long motion of the whole hand in closed loop: all joints swing, the wrist moves, loads come and go."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.tick.loop import ClosedLoop
from awiwi_gen.tick.status import names_of

if TYPE_CHECKING:
    from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
Watch = Callable[[ClosedLoop], None]
SWING = 0.35  # of a joint's range to either side
LOAD = 0.05  # rad, by which the largest torque from outside deflects a joint of the wanted stiffness
WRIST_SWING = 0.15  # rad
RISE = 0.5  # s, in which the motion begins
CHUNK = 3000  # ticks between changes of the load


@dataclass
class Motion:
    """What a long run showed, ``ticks`` so far.

    ``squares`` are those of the joints' errors [rad] against their filtered references, ``worst`` is the greatest;
    forces [N], torque [N m]; ``slack`` counts tendons without force in all ticks; ``seen`` are all status bits.
    """

    seconds: float
    law: int
    ticks: int = 0
    squares: float = 0.0
    worst: float = 0.0
    least_force: float = np.inf
    greatest_force: float = 0.0
    greatest_torque: float = 0.0
    slack: float = 0.0
    seen: int = 0

    @property
    def rms(self) -> float:
        """Root of the mean square of the errors of all joints [rad]."""
        return float(np.sqrt(self.squares / self.ticks))

    def add(self, loop: ClosedLoop) -> None:
        """Count the tick that just ended."""
        error, force = loop.hand.world.q - loop.step.state.motion[:, 0], loop.hand.world.f
        self.ticks += 1
        self.squares += float(error @ error) / len(error)
        self.worst = max(self.worst, float(np.abs(error).max()))
        self.least_force = min(self.least_force, float(force.min()))
        self.greatest_force = max(self.greatest_force, float(force.max()))
        self.greatest_torque = max(self.greatest_torque, float(np.abs(loop.step.torque).max()))
        self.slack += float(np.mean(force <= 0))
        self.seen |= loop.step.status

    def as_dict(self) -> dict[str, Any]:
        """The same, ready for JSON: with the mean error and the share of slack ticks."""
        found = {**asdict(self), "rms": self.rms, "slack": self.slack / self.ticks, "seen": names_of(self.seen)}
        return {name: value for name, value in found.items() if name != "squares"}


def moved(
    library: Library, seconds: float, law: int, seed: int = 0, begin: Watch | None = None, watch: Watch | None = None
) -> Motion:
    """Run the hand for some seconds [s]; ``begin`` is called at the start, ``watch`` after each tick.

    Raises InputError for a hand without a tick, or where the simulated hand leaves what its model describes.
    """
    loop, found = ClosedLoop(library, seed=seed), Motion(seconds, law)
    loop.step.input.law = law
    if begin:
        begin(loop)
    low, high = loop.step.limits()
    wrist = loop.hand.world.wrist.copy()
    for demand, load, turn in _demands(loop, seconds, seed):
        loop.hand.world.load, loop.hand.world.wrist = load * loop.step.input.stiffness, wrist + turn
        loop.hand.measure(loop.step.input)
        loop.step.input.q_des = loop.start + SWING * (high - low) * demand
        loop.hand.move(loop.step.step())
        found.add(loop)
        if watch:
            watch(loop)
    return found


def _demands(loop: ClosedLoop, seconds: float, seed: int) -> Iterator[tuple[Array, Array, Array]]:
    """Of each tick: demands (joints,) from -1 to 1, loads (joints,) [rad], and angles of the wrist (2,) [rad]."""
    period, joints, random = float(loop.step.gains.period[0]), loop.step.joints, np.random.default_rng(seed)
    rates = random.uniform(0.1, 1.0, (2, joints)) * 2 * np.pi
    phases = random.uniform(0, 2 * np.pi, (2, joints))
    ticks = round(seconds / period)
    for first in range(0, ticks, CHUNK):
        time = np.arange(first, min(ticks, first + CHUNK))[:, None] * period
        rise = np.minimum(1, time / RISE)
        demand = rise * (np.sin(rates[0] * time + phases[0]) + np.sin(rates[1] * time + phases[1])) / 2
        turn = rise * WRIST_SWING * np.sin(2 * np.pi * time * (0.2, 0.13))
        load = random.uniform(-LOAD, LOAD, joints)
        yield from ((demand[tick], load, turn[tick]) for tick in range(len(time)))
