"""Scenarios and scores: the same for all laws, with fixed seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.compare.laws import Law
from awiwi_gen.errors import unknown
from awiwi_gen.loops.hand_joint import Joint, loop_around, values_of
from awiwi_gen.simulate import PERIOD, Array, Scenario, Trace, simulate

BEFORE, TICKS = 150, 1500  # ticks at rest, and in all
STEP, LOAD = 0.2, 0.04  # rad, N m
WAVE, FREQUENCY = 0.2, 2.0  # rad, Hz
BAND = 0.02  # of a step: tolerance of the settling time
LAST = 300  # ticks over which the steady state is averaged
WATCHED = ("x", "u", "tau", "wanted")

PLANTS: Mapping[str, Mapping[str, Any]] = {
    "as known": {},
    "springs 30 % soft": {"springs": (0.7, 0.7)},
    "springs 30 % stiff": {"springs": (1.3, 1.3)},
    "one 30 % soft, one stiff": {"springs": (0.7, 1.3)},
    "friction 30 % up": {"friction": 1.3},
    "link 30 % heavier": {"link": 1.3},
}
FORCES = (10.0, 20.0)  # N, pretensions


@dataclass(frozen=True)
class Motion:
    """Desired motion of the link with four derivatives (ticks, 5), and load (ticks,) [N m]."""

    goal: Array
    load: Array


def motions(period: float = PERIOD) -> dict[str, Motion]:
    """A step, a load step, and a sine with its derivatives, on a clock of this period [s]."""
    rest, none = np.zeros((TICKS, 5)), np.zeros(TICKS)
    step, load, sine = rest.copy(), none.copy(), rest.copy()
    step[BEFORE:, 0], load[BEFORE:] = STEP, LOAD
    w, t = 2 * np.pi * FREQUENCY, np.arange(TICKS - BEFORE) * period
    waves: list[Callable[[Array], Array]] = [np.cos, lambda a: -np.sin(a), lambda a: -np.cos(a), np.sin, np.cos]
    for order, wave in enumerate(waves):  # 1 - cos starts at rest
        sine[BEFORE:, order] = WAVE / 2 * ((order == 0) - w**order * wave(w * t))
    return {"step": Motion(step, none), "load": Motion(rest, load), "sine": Motion(sine, none)}


SCENARIOS = tuple(motions())


@dataclass(frozen=True)
class Score:
    """Results of a law in a step, a load step and a sine, on one plant under one pretension.

    settling [s], overshoot and stiffness error as shares, steady and sine error [rad], slack time [s] of the slacker
    tendon, positive work [J] of the motors during the step, chatter [N m]: r.m.s. change of the torques from tick to tick
    at rest. ``failed``: some run ended early, or the law failed in some tick.
    """

    settling: float
    overshoot: float
    steady: float
    stiffness: float
    sine: float
    slack: float
    energy: float
    chatter: float
    failed: bool

    @property
    def good(self) -> bool:
        """Whether the goal is reached: 40 ms, 2 % of overshoot, 3 % of stiffness error, no slack."""
        fast = self.settling <= 0.040 and self.overshoot <= 0.02
        return not self.failed and fast and abs(self.stiffness) <= 0.03 and self.slack == 0


def run(
    library: Any, law: Law, gains: Mapping[str, float], true: Joint, believed: Joint, force: float,
    names: Iterable[str] = SCENARIOS, seed: int = 1,
) -> dict[str, Trace]:  # fmt: skip
    """Traces of the named scenarios. Raises InputError for an unknown name."""
    known, names = motions(true.period), list(names)
    for name in names:
        if name not in known:
            raise unknown("scenario", name, known, f"there are {', '.join(known)}")
    values = values_of(true, believed, force) | law.values(library, believed, force, gains)
    loop = loop_around(true, list(law.blocks))
    cases = [Scenario(values, TICKS, {"goal": known[n].goal, "load": known[n].load}, seed) for n in names]
    return dict(zip(names, simulate(library, loop, cases, WATCHED), strict=True))


def score(traces: Mapping[str, Trace], K_p: float) -> Score:
    """The score of the three scenarios."""
    step, load, sine = (traces[name] for name in ("step", "load", "sine"))
    failed = any(trace.status or trace.refused or trace.done < TICKS for trace in traces.values())
    if any(trace.done < TICKS for trace in traces.values()):
        return Score(*(float("inf"),) * 8, failed=True)
    q, period = step["x"][:, 0], float(step.time[1] - step.time[0])
    off = np.flatnonzero(np.abs(q - STEP) > BAND * STEP)
    deflexion = float(load["x"][-LAST:, 0].mean())
    power = step["u"][1:] * step["x"][1:, 3::2]
    changes = np.diff(np.concatenate([trace["wanted"][-LAST:] for trace in (step, load)]), axis=0)
    return Score(
        settling=float(max(off[-1] + 1 - BEFORE, 0) * period) if off[-1] + 1 < TICKS else float("inf"),
        overshoot=float(max(q.max() / STEP - 1, 0)),
        steady=float(abs(q[-LAST:].mean() - STEP)),
        stiffness=float(LOAD / deflexion / K_p - 1) if deflexion else float("inf"),
        sine=float(np.abs(sine["x"][BEFORE:, 0] - motions(period)["sine"].goal[BEFORE:, 0])[-TICKS // 3 :].max()),
        slack=float(max(((trace["tau"] <= 0).sum(axis=0).max()) for trace in traces.values()) * period),
        energy=float(np.maximum(power, 0).sum() * period),
        chatter=float(np.sqrt((changes**2).mean())),
        failed=bool(failed),
    )
