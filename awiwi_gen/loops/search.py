"""Search for gains that hold on a whole family of plants: the same for every law, so that laws can be compared.

A try is judged by a step and a load step on some plants of the family, those that proved worst for earlier tries among
them. Its cost is the sum, over settling time, overshoot, stiffness error, slack, limit cycle and chatter, of the logarithm
of how far the worst plant misses the goal; where all are met, a faster step and less pretension decide. An evolution
strategy draws tries about a mean, all factors in logarithms, and moves the mean and the spread of each factor to the best
quarter. Of the last records that is chosen which is best on the whole family. The same seed and number of tries give the
same gains.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.loops.hand_joint import SENSING, Joint
from awiwi_gen.loops.laws import STIFFNESS, Law
from awiwi_gen.loops.scenarios import FAMILY, FORCES, GOALS, JUDGED, STEP, TICKS, Score, load_of, run, score
from awiwi_gen.simulate import Array

TRIES, SEED = 400, 1
FEWEST, MOST = 20, 100_000  # tries
DRAWN, KEPT = 12, 4  # of a generation
SPREAD, NARROWEST, WIDEST = 0.25, 0.02, 0.6  # of the logarithm of a factor
BANDWIDTHS = (1.0, 0.7, 0.5, 0.35, 0.25)  # of the defaults, that a search may start from
STARTED = (*FORCES, 45.0)  # N, likewise
HOPELESS = 20.0  # cost of the best start from which on a light link's gains are taken from its tendons instead
PRETENSIONS = (4.0, 50.0)  # N
CHATTER = 0.2  # of the motors' limit: r.m.s. change of torque from tick to tick
SHORT = 900  # ticks of a run
STAGES = (0.5, 0.75, 1.0)  # shares of the tries, between which the worst plants of the whole family join the judged
REJUDGED = 6  # of the last records, on the whole family
GENTLE = 0.95  # share of a goal from which on it costs something
SPARED = 0.02  # what a factor of e in speed or pretension counts
FAILED = 1e3


def require_tries(tries: int) -> None:
    """Raise InputError for a number of tries that no search can have."""
    if not FEWEST <= tries <= MOST:
        raise InputError(f"--tries {tries}: a search has {FEWEST} to {MOST} tries")


@dataclass(frozen=True)
class Found:
    """Gains and pretension [N] of a law on a joint, their cost, and the score on each plant that was judged.

    ``fastest`` is the shortest time [s] in which the motors' torque allows a step.
    """

    law: str
    gains: Mapping[str, float]
    force: float
    cost: float
    scores: Mapping[str, Score]
    fastest: float

    def worst(self, plants: bool = True) -> Score:
        """The largest of each number over the family, or the numbers of the plant as known."""
        if not plants:
            return self.scores["as known"]
        return worst_of(self.scores)


def worst_of(scores: Mapping[str, Score]) -> Score:
    """The largest of each number over plants."""
    values = {
        name: max((getattr(each, name) for each in scores.values()), key=abs) for name in Score.__dataclass_fields__
    }
    return Score(**values)


def judged(
    library: Any, law: Law, joint: Joint, gains: Mapping[str, float], force: float,
    plants: Mapping[str, Mapping[str, Any]] = JUDGED, names: tuple[str, ...] = ("step", "load"),
    sensing: str = SENSING[0], ticks: int = TICKS, enough: Callable[[Mapping[str, Score]], bool] = lambda _: False,
) -> dict[str, Score]:  # fmt: skip
    """The score of gains on every plant, or until it is ``enough``; the law believes the joint as known."""
    believed, load = joint.believed(), load_of(joint)
    wanted = gains.get("K_p", law.gains_for(joint).get("K_p", STIFFNESS["K_p"].value))
    scores: dict[str, Score] = {}
    for name, plant in plants.items():
        true = joint.perturbed(**plant)
        traces = run(library, law, gains, true, believed, force, names, sensing=sensing, ticks=ticks)
        scores[name] = score(traces, wanted, load)
        if enough(scores):
            break
    return scores


def cost_of(scores: Mapping[str, Score], joint: Joint, force: float, yields: bool = True) -> float:
    """What the search makes small; with more plants it only grows. A law that does not yield has no stiffness to err in."""
    if any(each.failed for each in scores.values()):
        return FAILED
    noisy = CHATTER * joint.limit
    shares = [(*each.shares(GOALS[name != "as known"]), each.chatter / noisy) for name, each in scores.items()]
    worst = np.minimum(np.array(shares).max(axis=0), FAILED)
    worst[2] *= yields
    missed = np.log1p(np.maximum(worst - GENTLE, 0)).sum()
    return float(missed + SPARED * (np.log(max(worst[0], 1e-3)) + np.log(force / FORCES[0])))


def search(
    library: Any, law: Law, joint: Joint, seed: int = SEED, tries: int = TRIES,
    progress: Callable[[int, float], None] = lambda done, cost: None,
) -> Found:  # fmt: skip
    """The best gains of so many tries. Raises InputError where no try ran on all plants, with the plant that fails."""
    names, plants = list(law.gains), dict(JUDGED)

    def gains_at(at: Array) -> tuple[dict[str, float], float]:
        values = np.exp(at)
        return dict(zip(names, map(float, values[:-1]), strict=True)), float(np.clip(values[-1], *PRETENSIONS))

    def cost(at: Array, bound: float = inf) -> float:
        gains, force = gains_at(at)

        def hopeless(scores: Mapping[str, Score]) -> bool:
            return cost_of(scores, joint, force, law.yields) > bound

        try:
            found = judged(library, law, joint, gains, force, plants, ticks=SHORT, enough=hopeless)
        except InputError:  # the law's design has no solution
            return 2 * FAILED
        return cost_of(found, joint, force, law.yields)

    def on_family(at: Array) -> Found:
        gains, force = gains_at(at)
        scores = judged(library, law, joint, gains, force, FAMILY)
        return Found(law.name, gains, force, cost_of(scores, joint, force, law.yields), scores, fastest(joint, STEP))

    starts = [
        np.log([*law.gains_for(joint, bandwidth).values(), force]) for bandwidth in BANDWIDTHS for force in STARTED
    ]
    costs = [cost(start) for start in starts]
    if min(costs) > HOPELESS and {"K_p", "K_3", "K_4", "C_t", "C_s"} <= law.gains.keys():
        stiff = [np.log([*_as_stiff_as_tendons(law, joint, force).values(), force]) for force in STARTED]
        starts, costs = starts + stiff, costs + [cost(start) for start in stiff]
    mean, spread = starts[int(np.argmin(costs))], np.full(len(names) + 1, SPREAD)
    records, lowest = [mean], min(costs)
    random, done = np.random.default_rng(seed), len(starts)
    for share in STAGES:
        while done < share * tries:
            drawn = mean + spread * random.standard_normal((DRAWN, len(mean)))
            drawn[0] = records[-1]
            found: list[float] = []
            for each in drawn:  # a try that cannot be among the kept ones need not see all plants
                found.append(cost(each, sorted(found)[KEPT - 1] if len(found) >= KEPT else inf))
            order = np.argsort(found, kind="stable")[:KEPT]
            if found[order[0]] < lowest:
                lowest = found[order[0]]
                records.append(drawn[order[0]])
            moved = drawn[order].mean(axis=0)
            wide = 1.3 * drawn[order].std(axis=0) + 0.3 * np.abs(moved - mean)
            spread, mean = np.clip(0.8 * spread + 0.2 * wide, NARROWEST, WIDEST), moved
            done += len(drawn)
            progress(done, lowest)
        if share < 1:  # the plants that are worst for what was found join the judges
            plants |= {name: FAMILY[name] for name in worst_plants(on_family(records[-1]).scores)}
            lowest = cost(records[-1])
            mean, records = records[-1], records[-1:]
    chosen = min(map(on_family, records[-REJUDGED:]), key=lambda found: found.cost)
    if chosen.cost >= FAILED:
        failing = next((name for name, each in chosen.scores.items() if each.failed), "as known")
        raise InputError(
            f"{law.name}: none of {tries} tries runs on the plant '{failing}': the law fails there, or the joint leaves all "
            f"bounds, with motors of at most {joint.limit:.3g} N m"
        )
    return chosen


def _as_stiff_as_tendons(law: Law, joint: Joint, force: float) -> dict[str, float]:
    """Gains for a link so light that those for its inertia are far softer than its tendons under a force [N]."""
    gains, stiffness = law.gains_for(joint), 2.5 * float(joint.slopes(force * joint.arm).mean())
    softer = gains["K_p"] / stiffness
    factors = {"K_p": 1 / softer, "K_3": 0.5, "K_4": 0.5, "C_t": softer, "C_s": softer}
    return {name: value * factors.get(name, 1.0) for name, value in gains.items()}


def worst_plants(scores: Mapping[str, Score]) -> list[str]:
    """The plants on which each part of the cost is largest."""
    shares = {name: each.shares(GOALS[1]) for name, each in scores.items()}
    return list({max(shares, key=lambda name: shares[name][part]): None for part in range(5)})


def fastest(joint: Joint, step: float) -> float:
    """The shortest time [s] of a step [rad] that the motors' torque allows: half of it speeding up, half slowing down."""
    level = joint.friction[1] * np.pi / 2
    spare = joint.limit - level
    return (
        float(2 * np.sqrt(step * joint.inertias[1] * joint.limit / (spare * (joint.limit + level))))
        if spare > 0
        else inf
    )
