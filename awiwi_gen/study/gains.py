"""`awiwi-gen study gains`: gains of a law drawn about those of a joint, each judged on the family of wrong plants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.build import load
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.loops.hand_joint import FINGER, JOINT, Joint, gains_of, joint_of
from awiwi_gen.loops.laws import LAWS, Law
from awiwi_gen.loops.scenarios import FAMILY, Score
from awiwi_gen.loops.search import FAILED, PRETENSIONS, SHORT, cost_of, judged, worst_of
from awiwi_gen.study.base import Array, Report, Result, Study
from awiwi_gen.study.folder import Chunks
from awiwi_gen.study.prepare import Request, generated
from awiwi_gen.study.run import computed
from awiwi_gen.study.spreads import shown
from awiwi_gen.tune.family import NEEDED

USUAL = "backstepping_adaptive"
FACTOR = 2.0  # gains are drawn between those of the joint over this, and times this
SCORES = {
    "settling": "s", "overshoot": "1", "stiffness": "1", "slack": "s", "cycle": "rad", "chatter": "N m",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Gains(Study):
    """Gains and a pretension [N], the last of ``start``, times factors that are drawn evenly in their logarithm."""

    SIZE = 4
    law: str
    joint: Joint
    names: tuple[str, ...]
    start: Array

    def chunk(self, library: Any, random: np.random.Generator) -> dict[str, Array]:
        """Factors (SIZE, gains + 1), costs and the worst scores (SIZE,) over the family of plants."""
        factors = FACTOR ** random.uniform(-1.0, 1.0, (self.SIZE, len(self.start)))
        return self.tried(library, factors)

    def tried(self, library: Any, factors: Array) -> dict[str, Array]:
        """The same for given factors (n, gains + 1)."""
        law, found = LAWS[self.law], []
        for values in self.start * factors:
            gains, force = dict(zip(self.names, map(float, values), strict=False)), float(values[-1])
            force = float(np.clip(force, *PRETENSIONS))
            try:
                scores = judged(library, law, self.joint, gains, force, FAMILY, ticks=SHORT)
                found.append((cost_of(scores, self.joint, force), worst_of(scores)))
            except InputError:  # the law's design has no solution
                found.append((2 * FAILED, Score(*(float("inf"),) * 9, failed=True)))
        worst = {name: np.array([abs(getattr(each, name)) for _, each in found]) for name in SCORES}
        failed = np.array([each.failed for _, each in found])
        return {"factors": factors, "cost": np.array([cost for cost, _ in found]), "failed": failed, **worst}


SAMPLES = 64 * Gains.SIZE


def conduct(request: Request) -> Report:
    """Run the study. Raises InputError for a joint or law that does not exist, or a hand without motors and springs."""
    hand, law = request.hand, law_of(request.law)
    finger, _, name = (request.joint or f"{FINGER}_{JOINT}").partition("_")
    if request.joint and (finger not in hand.fingers or name not in hand.fingers[finger].joints):
        known = [f"{each}_{joint}" for each in hand.fingers for joint in hand.fingers[each].joints]
        raise unknown("joint", request.joint, known, "awiwi-gen show draws them with their names")
    kernels = generated(hand.model_copy(update={"gains": ()}), needed(law), request.progress)
    library = load(kernels)
    joint = joint_of(library, hand, finger, name)
    own = gains_of(library, hand, finger, name) if law.name == USUAL else None
    gains = law.gains_from(joint, own) if own else law.gains_for(joint)
    start = np.array([*gains.values(), float(own.pretension or request.force) if own else request.force])
    study = Gains(request.seed, "gains", law.name, joint, tuple(gains), start)
    count = request.chunks(study.SIZE)
    chunks = joined(computed(study, kernels, count, request.place, request.progress), count)
    return report(study, chunks, study.tried(library, np.ones((1, len(start)))), law, f"{finger} {name}")


def law_of(name: str) -> Law:
    """The law of that name. Raises InputError where there is none."""
    if name and name not in LAWS:
        raise unknown("law", name, LAWS, f"there are {', '.join(LAWS)}")
    return LAWS[name or USUAL]


def needed(law: Law) -> str:
    """Patterns of the kernels that a law runs, beside those of plants and observers."""
    blocks = [each.kernel for each in law.blocks if hasattr(each, "kernel")]
    return ",".join([NEEDED, "lqr*,sdre*,pole_placement*,cascade*,backstepping*,motor_*", *blocks])


def joined(chunks: Chunks, count: int) -> dict[str, Array]:
    """The results of all chunks, one after another."""
    parts = list(chunks.all(count))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def ranks(values: Array) -> Array:
    """The places of values in their order."""
    return np.argsort(np.argsort(values, kind="stable"), kind="stable").astype(float)


def correlation(a: Array, b: Array) -> float:
    """The rank correlation of two samples; 0 where one of them does not vary."""
    if len(a) < 2:
        return 0.0
    return float(np.corrcoef(ranks(a), ranks(b))[0, 1])


def report(study: Gains, found: Mapping[str, Array], own: Mapping[str, Array], law: Law, joint: str) -> Report:
    """What each gain costs over the family, the best gains that were drawn, and how many hold."""
    best = int(found["cost"].argmin())
    names = [*study.names, "pretension"]
    units = [*(law.gains[name].unit for name in study.names), "N"]
    correlations = [correlation(found["factors"][:, i], found["cost"]) for i in range(len(names))]
    order = sorted(range(len(names)), key=lambda i: -abs(correlations[i]))
    rows = [
        (names[i], f"{study.start[i]:.4g}", units[i], f"{correlations[i]:+.2f}", f"{found['factors'][best, i]:.2f}")
        for i in order
    ]
    runs = ~found["failed"]
    lines = [
        f"{joint}, {law.name}: {len(runs)} sets of gains on {len(FAMILY)} plants each; {runs.mean():.0%} run on all of them",
        f"cost of the joint's own gains {own['cost'][0]:.2f}, of the best that were drawn {found['cost'][best]:.2f}",
        "worst of the family, own and best: "
        + ", ".join(
            f"{name} {shown(float(own[name][0]), unit)} and {shown(float(found[name][best]), unit)}"
            for name, unit in SCORES.items()
        ),
    ]
    results = {
        "factors": Result("1", "factors on the gains, the last on the pretension", found["factors"]),
        "start": Result("units of the gains", "gains of the joint, the last the pretension [N]", study.start),
        "names": Result("", "names of the gains", np.array(names)),
        "cost": Result("1", "what the search of tune makes small", found["cost"]),
        "failed": Result("1", "whether a plant of the family failed", found["failed"]),
        **{name: Result(unit, f"largest {name} over the family", found[name]) for name, unit in SCORES.items()},
    }
    data = {
        "joint": joint, "law": law.name, "plants": len(FAMILY), "run": float(runs.mean()),
        "own": {"cost": float(own["cost"][0]), **{name: float(own[name][0]) for name in SCORES}},
        "best": {"cost": float(found["cost"][best]), **{name: float(found[name][best]) for name in SCORES},
                 "gains": {name: float(study.start[i] * found["factors"][best, i]) for i, name in enumerate(names)}},
        "rank_correlation": dict(zip(names, correlations, strict=True)),
    }  # fmt: skip
    columns = ("gain", "joint's own", "unit", "rank correlation with cost", "best factor")
    return Report(results, columns, rows, lines, data, lambda figure: _draw(figure, found, names))


def _draw(figure: Any, found: Mapping[str, Array], names: list[str]) -> None:
    """Costs over the factor of each gain."""
    columns = 5
    grid = figure.subplots(-(-len(names) // columns), columns, sharey=True, squeeze=False).ravel()
    shown = found["cost"] < FAILED
    for axes, name, factors in zip(grid, names, found["factors"].T, strict=False):
        axes.plot(factors[shown], found["cost"][shown], ".", markersize=3)
        axes.set_xscale("log", base=2)
        axes.set_title(name, fontsize=8)
        axes.tick_params(labelsize=6)
    for axes in grid[len(names) :]:
        axes.set_axis_off()
    figure.supylabel("cost over the family", fontsize=9)
    figure.supxlabel("factor on the joint's own gain", fontsize=9)
