"""`awiwi-gen study tolerance`: the spread of hands as known, what every number costs, and what must be known better."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from awiwi_gen.build import load
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.study.base import Array, Report, Result, poses_of, random_of
from awiwi_gen.study.figures import FIGURES, GOALS
from awiwi_gen.study.folder import Chunks
from awiwi_gen.study.prepare import Request, families_of, generated, ranges_of, with_numbers, without_zeros
from awiwi_gen.study.run import computed
from awiwi_gen.study.spreads import SHOWN as SHOWN_UNITS
from awiwi_gen.study.spreads import share_or_quantity, shown, spreads_of
from awiwi_gen.study.tolerance import (
    PERCENTILE,
    POSES,
    Slopes,
    Tolerance,
    demanded,
    require_agreement,
    slopes,
    summary,
)
from awiwi_gen.units import Quantity

SAMPLES = 32 * Tolerance.SIZE
SHOWN = 15  # numbers of a table or a plot
NEGLIGIBLE = 1e-9  # m or rad in the place of zero: some derived numbers are quotients of numbers that may all be zero


@dataclass(frozen=True)
class Found:
    """The stages of a study of tolerances, and what was found between them."""

    request: Request
    study: Tolerance
    paths: list[str]
    goals: dict[str, float]
    slopes: Slopes
    demands: Array
    before: dict[str, Array]
    after: dict[str, Array]
    agreement: float


def goals_of(texts: tuple[str, ...], figures: tuple[str, ...]) -> dict[str, float]:
    """The largest permitted errors, in SI units. Raises InputError for an unknown figure or a quantity of another kind."""
    goals = {}
    for text in texts or tuple(f"{name}={goal}" for name, goal in GOALS.items() if name in figures):
        name, _, value = text.partition("=")
        if name not in figures:
            raise unknown("figure", name, figures, f"this finger has {', '.join(figures)}")
        goal, unit = share_or_quantity(value.strip()), FIGURES[name].unit
        if (str(goal.unit) if isinstance(goal, Quantity) else "1") != unit or not float(goal) > 0:
            raise InputError(
                f"--goal {text}: expected {'a share such as 5 %' if unit == '1' else 'a length such as 1 mm'}"
            )
        goals[name] = float(goal)
    return goals


def conduct(request: Request) -> Report:
    """Run the study. Raises InputError for spreads and goals that do not fit, VerificationError if C disagrees."""
    hand, finger = request.hand, request.finger
    have = families_of(hand, finger)
    figures = tuple(name for name, each in FIGURES.items() if have.issuperset(each.families))
    goals = goals_of(request.goals, figures)
    only = ",".join(f"{finger}_{family}" for name in figures for family in FIGURES[name].families)
    kernels = generated(without_zeros(hand, finger), only, request.progress, "runtime")
    library = load(kernels)
    numbers = hand.quantities()
    read = [entry["path"] for entry in library.manifest["params"]["numbers"]]
    values = np.array([float(numbers[path]) or NEGLIGIBLE * (1 + i / len(read)) for i, path in enumerate(read)])
    paths = [path for path in read if not path.startswith("limits.") and not path.endswith((".low", ".high"))]
    given = spreads_of(hand, finger, paths, request.spreads)
    study = Tolerance(
        request.seed, "spread", finger, figures, values, np.array([given.get(path, 0.0) for path in read]),
        poses_of(*ranges_of(hand, finger), request.seed, POSES),
        np.full(len(hand.fingers[finger].tendons), request.force), np.array([0.0, 0.0, -float(hand.limits.gravity)]),
    )  # fmt: skip
    agreement = agreed(study, library, request, only, read)
    effects = slopes(study, library, read)
    units = np.array([1 / SHOWN_UNITS.get(str(numbers[path].unit), ("", 1.0))[1] for path in read])
    demands = demanded(effects, goals, study.spreads, units, request.seed)
    count = request.chunks(study.SIZE)
    before = joined(computed(study, kernels, count, request.place, request.progress), count)
    better = replace(study, stage="demand", spreads=demands)
    changed = bool((demands < study.spreads).any())
    after = joined(computed(better, kernels, count, request.place, request.progress), count) if changed else before
    return report(Found(request, study, read, goals, effects, demands, before, after, agreement))


def agreed(study: Tolerance, library: Any, request: Request, only: str, read: list[str]) -> float:
    """The largest difference from C with the numbers in its code, of the first hand of the study."""
    drawn = study.drawn(random_of(study.seed, 0, study.stage))[0]
    hand = with_numbers(request.hand, dict(zip(read, map(float, drawn), strict=True)))
    baked = load(generated(hand, only, request.progress))
    return require_agreement(study, library, baked, drawn)


def joined(chunks: Chunks, count: int) -> dict[str, Array]:
    """The results of all chunks, one after another."""
    parts = list(chunks.all(count))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def report(found: Found) -> Report:
    """The table of numbers, those that cost most first, and the shares of hands that reach the goals."""
    study, alone = found.study, found.slopes.alone
    numbers = found.request.hand.quantities()
    units = {path: str(each.unit) for path, each in numbers.items()}
    guesses = found.request.hand.assumed()
    cost = np.max([alone[name] / goal for name, goal in found.goals.items()] or [*alone.values()], axis=0)
    order = [int(i) for i in np.argsort(-cost, kind="stable") if study.spreads[i] > 0]
    rows = [
        (
            found.paths[i].removeprefix(f"fingers.{study.finger}."),
            shown(float(numbers[found.paths[i]]), units[found.paths[i]]),
            shown(study.spreads[i], units[found.paths[i]]),
            *(shown(float(alone[name][i]), FIGURES[name].unit, 2) for name in study.figures),
            shown(found.demands[i], units[found.paths[i]]) if found.demands[i] < study.spreads[i] else "as it is",
            "guess" if found.paths[i] in guesses else "",
        )
        for i in order[: max(SHOWN, int((found.demands < study.spreads).sum()))]
    ]
    summaries = {"spread": summary(found.before, found.goals), "demand": summary(found.after, found.goals)}
    demands = [
        {
            "number": path, "value": float(numbers[path]), "spread": float(study.spreads[i]), "unit": units[path],
            "alone": {name: float(alone[name][i]) for name in study.figures}, "demand": float(found.demands[i]),
        }
        for i, path in enumerate(found.paths)
    ]  # fmt: skip
    return Report(
        results(found),
        ("number", "value", "known to", *(f"{name} alone" for name in study.figures), "needed to", ""),
        rows,
        lines(found, summaries, len(order)),
        {"numbers": demands, **summaries, "agreement": found.agreement},
        lambda figure: draw(figure, found, order),
    )


def results(found: Found) -> dict[str, Result]:
    """The arrays of the files."""
    arrays = {
        f"{stage}_{name}": Result(FIGURES[name].unit, f"worst error over the poses, of every hand, {what}", values)
        for stage, what, each in (("spread", "as known", found.before), ("demand", "as needed", found.after))
        for name, values in each.items()
    }
    for name, values in found.slopes.alone.items():
        arrays[f"alone_{name}"] = Result(FIGURES[name].unit, "worst error when one number is as wrong as known", values)
    arrays["poses"] = Result("rad (m for slides)", "joint positions", found.study.poses)
    arrays["spreads"] = Result("SI", "half width of each number as known", found.study.spreads)
    arrays["demands"] = Result("SI", "half width of each number as needed", found.demands)
    arrays["numbers"] = Result("", "path of each number", np.array(found.paths))
    return arrays


def lines(found: Found, summaries: Mapping[str, Mapping[str, Mapping[str, float]]], count: int) -> list[str]:
    """Sentences about all hands."""
    study = found.study
    better = int((found.demands < study.spreads).sum())
    hands = len(found.before[study.figures[0]])
    said = [
        f"{hands} hands at {POSES} poses; numbers at run time and in the code agree to {found.agreement:.0e}",
        f"{better} of {count} numbers must be known better than they are",
    ]
    for name in study.figures:
        each = [summaries[stage][name] for stage in ("spread", "demand")]
        text = [shown(stage["percentile"], FIGURES[name].unit) for stage in each]
        goal = f"; within {shown(found.goals[name], FIGURES[name].unit)}: " if name in found.goals else ""
        share = " and ".join(f"{stage['within']:.1%}" for stage in each) if goal else ""
        said.append(
            f"{name}: {PERCENTILE:.0%} of the hands within {text[0]} as known, {text[1]} as needed{goal}{share}"
        )
    return said


def draw(figure: Any, found: Found, order: list[int]) -> None:
    """For each figure the numbers that cost most, and the distribution of the worst errors before and after."""
    names = list(found.goals) or list(found.study.figures)
    axes = figure.subplots(len(names), 2, squeeze=False, width_ratios=(1.4, 1))
    for (left, right), name in zip(axes, names, strict=True):
        scale, unit = (1e3, "mm") if FIGURES[name].unit == "m" else (1e2, "%")
        alone = found.slopes.alone[name]
        top = sorted((i for i in order if alone[i] > 0), key=lambda i: -alone[i])[:10][::-1]
        own = f"fingers.{found.study.finger}."
        left.barh([found.paths[i].removeprefix(own) for i in top], alone[top] * scale, color="#1f5fbf")
        left.set_xlabel(f"{name}: worst error when one number is as wrong as known [{unit}]", fontsize=8)
        left.tick_params(labelsize=7)
        for values, label in ((found.before[name], "as known"), (found.after[name], "as needed")):
            kept = np.sort(values[np.isfinite(values)]) * scale
            right.plot(kept, (np.arange(len(kept)) + 1) / len(values), label=label)
        if name in found.goals:
            right.axvline(found.goals[name] * scale, color="grey", linestyle="--", label="goal")
        right.set_xlabel(f"{name}: worst error over poses [{unit}]", fontsize=8)
        right.set_ylabel("share of hands", fontsize=8)
        right.legend(fontsize=7)
