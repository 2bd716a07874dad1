"""Scores of whole fingers, and the goals: those of a single joint times factors that are stated here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.loops.scenarios import Goal
from awiwi_gen.tick.status import FAULTS
from awiwi_gen.tick.whole_finger import (
    DEFLEXION,
    SETTING,
    STEP,
    Plant,
    Record,
    Run,
    Setting,
    loaded,
    stepped,
    touched,
    turned,
)

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand
    from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
BAND = 0.02  # of the step: of settling, and of what a palm that turns does
LAST = 150  # ticks over which what lasts is averaged
CONTACT_BAND = 0.05  # of the force in contact
SETTLING, OVERSHOOT, STIFFNESS = 4.0, 8.0, 3.0  # factors on the goals of a single joint
FLING = 0.3  # of the deflexion, beyond the goal, when the wall is gone


@dataclass(frozen=True)
class FingerScore:
    """What the worst joint of a finger, or any of its tendons, did on one plant.

    settling [s] and overshoot (a share of the step) of a step; stiffness: error, as a share, under a load on all joints;
    touching [s]: until the contact force stays within 5 % of its last value; pressing: error of that, as a share;
    release [s] and fling: settling and overshoot when the wall is gone, the latter a share of the deflexion;
    turning [rad]: the largest error while the palm turns; slack [s] and force [N]: of any tendon, in all scenarios.
    ``faults``: whether the tick told one.
    """

    settling: float
    overshoot: float
    stiffness: float
    touching: float
    pressing: float
    release: float
    fling: float
    turning: float
    slack: float
    force: float
    faults: bool

    def within(self, goal: Goal, most: float, links: float = 1.0) -> bool:
        """Whether a goal for one joint is reached, by the factors, with no slack tendon and none above `most` [N].

        On springs of the wanted stiffness, links with ``links`` times the inertia are slower by the root of it, and a palm
        that turns deflects them so many times as far.
        """
        times = (self.settling, self.touching, self.release)
        heavier = max(links, 1.0)
        return (
            not self.faults
            and max(times) <= SETTLING * sqrt(heavier) * goal.settling
            and self.overshoot <= OVERSHOOT * goal.overshoot
            and max(self.stiffness, self.pressing) <= STIFFNESS * goal.stiffness
            and self.fling <= FLING
            and self.turning <= BAND * heavier * STEP
            and self.slack == 0
            and self.force <= most
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


def scores(
    library: Library, hand: Hand, law: int, plant: Plant, setting: Setting = SETTING, seed: int = 0
) -> dict[str, FingerScore]:
    """The score of every finger of a hand with a law of the tick. Raises InputError where the hand leaves its model."""

    def run() -> Run:
        return Run(library, hand, law, setting, plant, seed)

    records = [stepped(run()), loaded(run()), *touched(run()), turned(run())]
    faults = any(each.seen & FAULTS for each in records)
    return {
        name: FingerScore(
            *_step(records[0], joints),
            _stiffness(records[1], joints),
            *_contact(records[2], index),
            *_release(records[2], records[3], joints),
            float(np.abs(records[4].q[:, joints] - records[4].goal[joints]).max()),
            sum(float((each.f[:, rows] <= 0).sum(axis=0).max()) * each.period for each in records),
            max(float(each.f[:, rows].max()) for each in records),
            faults,
        )
        for index, (name, (rows, joints)) in enumerate(hand.blocks.items())
    }


def settled(off: Array, period: float) -> float:
    """Time [s] from which on nothing is `off` (ticks, ...) any more; infinite where that is not so at the end."""
    wrong = np.flatnonzero(off.reshape(len(off), -1).any(axis=1))
    if not len(wrong):
        return 0.0
    return float("inf") if wrong[-1] == len(off) - 1 else float(wrong[-1] + 1) * period


def _step(record: Record, joints: slice) -> tuple[float, float]:
    error = record.q[:, joints] - record.goal[joints]
    return settled(np.abs(error) > BAND * record.step, record.period), max(0.0, float(error.max()) / record.step)


def _stiffness(record: Record, joints: slice) -> float:
    """The largest error of a joint's stiffness; that of a joint that does not yield is infinite."""
    yielded = (record.q[-LAST:, joints] - record.goal[joints]).mean(axis=0) / DEFLEXION
    return float(np.abs(1 / yielded - 1).max()) if (yielded > 0).all() else float("inf")


def _contact(record: Record, finger: int) -> tuple[float, float]:
    force = record.contact[:, finger]
    last = float(force[-LAST:].mean())
    return settled(np.abs(force - last) > CONTACT_BAND * last, record.period), abs(last / record.pressed[finger] - 1)


def _release(pressing: Record, free: Record, joints: slice) -> tuple[float, float]:
    error = free.q[:, joints] - free.goal[joints]
    away = pressing.q[-LAST:, joints].mean(axis=0) - pressing.goal[joints]
    beyond = (-np.sign(away) * error).max(axis=0) / np.maximum(np.abs(away), free.step)
    return settled(np.abs(error) > BAND * free.step, free.period), max(0.0, float(beyond.max()))


def worst_of(found: Iterable[FingerScore]) -> FingerScore:
    """The largest of each number."""
    each = list(found)
    return FingerScore(**{field.name: max(getattr(one, field.name) for one in each) for field in fields(FingerScore)})


def force_limit(library: Library) -> float:
    """The greatest force [N] that the tick may plan for a tendon."""
    gains = getattr(library.c, f"{library.manifest['prefix']}_default_gains")
    return float(gains.force_high)
