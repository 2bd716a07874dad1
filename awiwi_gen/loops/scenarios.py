"""Scenarios and scores: the same for all laws, with fixed seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from awiwi_gen.errors import unknown
from awiwi_gen.loops.hand_joint import SENSING, Joint, loop_around, values_of
from awiwi_gen.loops.laws import Law
from awiwi_gen.simulate import PERIOD, Array, Loop, Scenario, Trace, simulate

BEFORE, TICKS = 150, 1500  # ticks at rest, and in all
STEP = 0.2  # rad
LOAD, YIELD = 20 / 3, 0.1  # largest load: N of a tendon; rad by which the joint yields on its springs alone
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
    "friction 30 % down": {"friction": 0.7},
    "link 30 % lighter": {"link": 0.7},
    "link 30 % heavier": {"link": 1.3},
    "link three times heavier": {"link": 3.0},
    "damping halved": {"damping": 0.5},
    "damping doubled": {"damping": 2.0},
}
SPRINGS = ((1.0, 1.0), (1.3, 1.3), (0.7, 0.7), (1.3, 0.7), (0.7, 1.3))
BETWEEN = {"link": (0.7, 1.3, 1.7, 3.0), "damping": (0.5, 0.75, 1.3, 2.0), "friction": (0.7, 1.3)}
CORNERS = {name: (factors[0], factors[-1]) for name, factors in BETWEEN.items()}


def _named(springs: tuple[float, float], link: float, damping: float, friction: float) -> tuple[str, dict[str, Any]]:
    """A plant of the family, and its name: what differs from the plant as known."""
    factors = {"link": link, "damping": damping, "friction": friction}
    parts = [f"springs x{springs[0]:g} and x{springs[1]:g}"] if springs != (1.0, 1.0) else []
    parts += [f"{name} x{factor:g}" for name, factor in factors.items() if factor != 1]
    return ", ".join(parts) or "as known", {"springs": springs, **factors}


def _family() -> dict[str, dict[str, Any]]:
    """All corners of the family, and every factor for itself, at values between its limits too."""
    nothing = dict.fromkeys(BETWEEN, 1.0)
    alone = [_named((1.0, 1.0), **nothing | {name: each}) for name, factors in BETWEEN.items() for each in factors]
    springs = [_named(each, **nothing) for each in SPRINGS]
    corners = [_named(each, *factors) for each in SPRINGS for factors in product(*CORNERS.values())]
    return dict([*springs, *alone, *corners])


JUDGED: Mapping[str, Mapping[str, Any]] = {
    "as known": {},
    **dict(
        _named(*each)
        for each in (
            ((1.0, 1.0), 3.0, 1.0, 1.0), ((1.0, 1.0), 0.7, 1.0, 1.0), ((1.3, 0.7), 3.0, 0.5, 1.3),
            ((0.7, 0.7), 3.0, 2.0, 1.0), ((1.3, 1.3), 0.7, 0.5, 0.7), ((1.3, 1.3), 0.7, 2.0, 0.7),
            ((0.7, 1.3), 1.0, 1.0, 1.0), ((1.3, 1.3), 1.0, 2.0, 1.0), ((1.0, 1.0), 1.0, 0.5, 1.0),
            ((0.7, 0.7), 1.0, 0.5, 0.7), ((0.7, 0.7), 0.7, 2.0, 1.3), ((0.7, 1.3), 0.7, 1.0, 1.3),
        )
    ),
}  # fmt: skip
FAMILY: Mapping[str, Mapping[str, Any]] = {**_family(), **JUDGED}
FORCES = (10.0, 20.0)  # N, pretensions
BANDWIDTH = 256.0  # rad/s, of the default impedance


@dataclass(frozen=True)
class Motion:
    """Desired motion of the link with four derivatives (ticks, 5), and load (ticks,) [N m]."""

    goal: Array
    load: Array


def load_of(joint: Joint) -> float:
    """The load step [N m]: what a tendon and its spring bear, but not more than moves the link within its bandwidth."""
    softer = min(2 * joint.slopes(FORCES[0] * joint.arm).mean(), joint.inertias[0] * BANDWIDTH**2)
    return float(min(LOAD * joint.arm, YIELD * softer))


def motions(load_torque: float, period: float = PERIOD) -> dict[str, Motion]:
    """A step, a load step [N m], and a sine with its derivatives, on a clock of this period [s]."""
    rest, none = np.zeros((TICKS, 5)), np.zeros(TICKS)
    step, load, sine = rest.copy(), none.copy(), rest.copy()
    step[BEFORE:, 0], load[BEFORE:] = STEP, load_torque
    w, t = 2 * np.pi * FREQUENCY, np.arange(TICKS - BEFORE) * period
    waves: list[Callable[[Array], Array]] = [np.cos, lambda a: -np.sin(a), lambda a: -np.cos(a), np.sin, np.cos]
    for order, wave in enumerate(waves):  # 1 - cos starts at rest
        sine[BEFORE:, order] = WAVE / 2 * ((order == 0) - w**order * wave(w * t))
    return {"step": Motion(step, none), "load": Motion(rest, load), "sine": Motion(sine, none)}


SCENARIOS = tuple(motions(0.0))


@dataclass(frozen=True)
class Score:
    """Results of a law in a step, a load step and a sine, on one plant under one pretension.

    settling [s], overshoot and stiffness error as shares, steady and sine error [rad], slack time [s] of the slacker
    tendon, positive work [J] of the motors during the step, chatter [N m]: r.m.s. change of the torques from tick to tick
    at rest, cycle [rad]: amplitude of what motion is left at rest. ``failed``: some run ended early, or the law failed in
    some tick.
    """

    settling: float
    overshoot: float
    steady: float
    stiffness: float
    sine: float
    slack: float
    energy: float
    chatter: float
    cycle: float
    failed: bool

    @property
    def good(self) -> bool:
        """Whether the goal for a wrong plant is reached."""
        return self.within(GOALS[1])

    def within(self, goal: Goal) -> bool:
        """Whether a goal is reached, with no slack tendon and no limit cycle above a milliradian."""
        return not self.failed and max(self.shares(goal)) <= 1

    def shares(self, goal: Goal) -> tuple[float, ...]:
        """Settling, overshoot, stiffness error, slack and cycle as shares of what the goal allows."""
        slack = 1 + self.slack / SLACK if self.slack else 0.0
        errors = self.settling / goal.settling, self.overshoot / goal.overshoot, abs(self.stiffness) / goal.stiffness
        return (*errors, slack, self.cycle / CYCLE)


@dataclass(frozen=True)
class Goal:
    """Largest settling time [s], overshoot and stiffness error as shares."""

    settling: float
    overshoot: float
    stiffness: float


GOALS = (Goal(0.040, 0.01, 0.01), Goal(0.045, 0.04, 0.04))  # of the plant as known, of the family
CALIBRATION, CONTRACTIONS, DEPTH = 2.0, 16, 0.3  # s; how often; share of the pretension
CYCLE, SLACK = 1e-3, 5e-3  # rad; s of a slack tendon that count as much as missing a goal by its own size


def run(
    library: Any, law: Law, gains: Mapping[str, float], true: Joint, believed: Joint, force: float,
    names: Iterable[str] = SCENARIOS, seed: int = 1, sensing: str = SENSING[0], ticks: int = TICKS,
) -> dict[str, Trace]:  # fmt: skip
    """Traces of the named scenarios. Raises InputError for an unknown name."""
    known, names = motions(load_of(believed), true.period), list(names)
    for name in names:
        if name not in known:
            raise unknown("scenario", name, known, f"there are {', '.join(known)}")
    values = values_of(true, believed, force) | law.values(library, believed, force, gains)
    loop = loop_around(true, list(law.blocks), sensing)
    if sensing != SENSING[0] and law.frozen is not None:
        values |= balanced(library, loop, values, true.period)
    cases = [
        Scenario(values, ticks, {"goal": known[n].goal[:ticks], "load": known[n].load[:ticks]}, seed) for n in names
    ]
    return dict(zip(names, simulate(library, loop, cases, WATCHED), strict=True))


def balanced(library: Any, loop: Loop, values: Mapping[str, Any], period: float) -> dict[str, Any]:
    """What a law learns of the springs' difference in a co-contraction at rest; nothing if that run ends early."""
    t = np.arange(round(CALIBRATION / period)) * period
    w, depth = 2 * np.pi * CONTRACTIONS / CALIBRATION, DEPTH * values["pretension"][0]
    waves = depth * np.stack([np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)], axis=1)
    given = {name: value for name, value in values.items() if name != "dither"}
    (trace,) = simulate(library, loop, [Scenario(given, len(t), {"dither": waves})], ["adaptation"])
    if trace.done < len(t):
        return {}
    last = len(t) // CONTRACTIONS  # ticks of the last contraction, over which a ripple of this period has no mean
    unequal = trace["adaptation"][-last:, 1].mean()
    return {"adaptation": [1.0, unequal, *[0.0] * 9], "factors": [1 + unequal, 1 - unequal]}


def score(traces: Mapping[str, Trace], K_p: float, load: float) -> Score:
    """The score of a step, a step of the load [N m], and a sine if there is one."""
    short = any(trace.done < trace.asked for trace in traces.values())
    failed = short or any(trace.status or trace.refused for trace in traces.values())
    if short:
        return Score(*(float("inf"),) * 9, failed=True)
    step, loaded, sine = traces["step"], traces["load"], traces.get("sine")
    q, period = step["x"][:, 0], float(step.time[1] - step.time[0])
    off = np.flatnonzero(np.abs(q - STEP) > BAND * STEP)
    deflexion = float(loaded["x"][-LAST:, 0].mean())
    power = step["u"][1:] * step["x"][1:, 3::2]
    changes = np.diff(np.concatenate([trace["wanted"][-LAST:] for trace in (step, loaded)]), axis=0)
    followed = motions(load, period)["sine"].goal[BEFORE:, 0]
    return Score(
        settling=float(max(off[-1] + 1 - BEFORE, 0) * period) if off[-1] + 1 < len(q) else float("inf"),
        overshoot=float(max(q.max() / STEP - 1, 0)),
        steady=float(abs(q[-LAST:].mean() - STEP)),
        stiffness=float(load / deflexion / K_p - 1) if deflexion else float("inf"),
        sine=float(np.abs(sine["x"][BEFORE:, 0] - followed)[-TICKS // 3 :].max()) if sine else 0.0,
        slack=float(max(((trace["tau"] <= 0).sum(axis=0).max()) for trace in traces.values()) * period),
        energy=float(np.maximum(power, 0).sum() * period),
        chatter=float(np.sqrt((changes**2).mean())),
        cycle=float(max(np.ptp(trace["x"][-LAST:, 0]) / 2 for trace in (step, loaded))),
        failed=bool(failed),
    )
