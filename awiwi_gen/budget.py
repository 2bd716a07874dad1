"""Cost budgets: operation counts after every pass, committed beside the generated code.

Counts do not drift as clocks do, so a run that makes a kernel more expensive is refused until somebody accepts it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.cache import key
from awiwi_gen.errors import BudgetError

if TYPE_CHECKING:
    from awiwi_gen.kernel import Kernel
    from awiwi_gen.records import Record

BUDGET = "budget.json"
SLACK = 0.02
Steps = Sequence[Sequence[Any]]  # a pass, operations and weight of the graph after it


def budget_text(kernels: Iterable[Kernel], records: Mapping[str, Record], options: Any) -> str:
    """The budget file: for each kernel the digest of its structure, and its operations and weight after each pass."""
    rows = []
    for kernel in kernels:
        kind = key(kernel.structure, options)[:16]
        row = {"part": kind, "steps": [list(step) for step in records[kernel.name].costs]}
        rows.append(f" {json.dumps(kernel.name)}: {json.dumps(row)}")
    return "{\n" + ",\n".join(rows) + "\n}\n"


def require_budget(directory: Path, text: str) -> None:
    """Compare new costs with the budget in a directory, if there is one.

    Kernels are compared where the structure of their part and the options are the same. Raises BudgetError with all
    kernels that cost more.
    """
    try:
        old = json.loads((directory / BUDGET).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return
    excesses = [
        f"{name} {sentence}"
        for name, row in json.loads(text).items()
        if isinstance(old.get(name), dict) and old[name].get("part") == row["part"] and "steps" in old[name]
        for sentence in excess(old[name]["steps"], row["steps"])
    ]
    if excesses:
        fix = (
            f"undo what made them more expensive, or accept it with --accept-cost (the budget is {directory / BUDGET})"
        )
        raise BudgetError("\n".join([*excesses, fix]))


def excess(old: Steps, new: Steps) -> list[str]:
    """A sentence if the last weight is above the budget, with the pass that does worse; else nothing."""
    before, after = old[-1][-1], new[-1][-1]
    if after <= before * (1 + SLACK):
        return []
    removed = removals(old, -1)
    losses = {name: removed.get(name, 0) - weight for name, weight in removals(new, -1).items()}
    worst = max(losses, key=lambda name: losses[name])
    cause = (
        f"pass {worst} removes {losses[worst]} less" if worst != new[0][0] else f"{worst} gives {losses[worst]} more"
    )
    return [f"costs {after}, its budget is {before} (+{100 * (after / before - 1):.1f} %): {cause} than before"]


def removals(steps: Steps, measure: int) -> dict[str, int]:
    """What each pass removes in all its runs: operations (1) or weight (-1).

    The first step is the derivation itself; its entry is negative.
    """
    result = {steps[0][0]: -steps[0][measure]}
    for last, step in pairwise(steps):
        result[step[0]] = result.get(step[0], 0) + last[measure] - step[measure]
    return result
