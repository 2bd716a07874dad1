"""Laws on one joint, each with gains of its own search, all by the same number of tries: `awiwi-gen simulate --tries`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import awiwi_gen
from awiwi_gen import parallel
from awiwi_gen.cache import Cache, code_digest, key
from awiwi_gen.compare.shown import Shown
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.loops.hand_joint import joint_of
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.loops.scenarios import GOALS, Score
from awiwi_gen.loops.search import SEED, Found, require_tries, search
from awiwi_gen.parallel import Progress, silent
from awiwi_gen.results import Table, milliseconds

BASELINES = ("motor_pd", "cascade", "inverse_dynamics", "backstepping_adaptive")
COLUMNS = (
    "law", "settling", "family", "overshoot", "family", "stiffness", "family", "slack", "cycle", "steady", "pretension",
    "goal",
)  # fmt: skip
SEARCHED = ("awiwi_gen/loops", "awiwi_gen/definitions", "awiwi_gen/simulate.py", "csrc")
Where = tuple[str, str]


def by_budget(hand: Hand, names: Iterable[str], where: Where, tries: int, progress: Progress = silent) -> Shown:
    """The best gains of each law of so many tries on the family of plants. Raises InputError for too few or too many."""
    require_tries(tries)
    found, reasons = tuned(hand, list(names), where, tries, Cache(), progress)
    return Shown(
        {
            "joint": "_".join(where), "tries": tries, "without": reasons,
            "laws": [
                {
                    "law": each.law, "gains": dict(each.gains), "pretension": each.force, "cost": each.cost,
                    "known": asdict(each.worst(plants=False)), "family": asdict(each.worst()),
                }
                for each in found
            ],
        },
        [Table(f"{'_'.join(where)}: gains of {tries} tries for each law, seed {SEED}", COLUMNS, [*map(row, found)])],
        reasons,
    )  # fmt: skip


def tuned(
    hand: Hand, names: list[str], where: Where, tries: int, store: Cache, progress: Progress = silent
) -> tuple[list[Found], list[str]]:
    """What a search finds for each law, and the reasons why some have nothing."""
    digests = [key(hand.digest(), name, *where, SEED, tries, code_digest(*SEARCHED)) for name in names]
    missing = set(store.missing("budgets", digests))
    work = [(hand, name, where, tries, digest, store) for name, digest in zip(names, digests, strict=True)]
    parallel.run("tune", _find, [piece for piece in work if piece[-2] in missing], progress)
    found: list[Any] = [store.get("budgets", digest) for digest in digests]
    return [each for each in found if isinstance(each, Found)], [each for each in found if isinstance(each, str)]


def _find(piece: tuple[Hand, str, Where, int, str, Cache]) -> None:
    """Search the gains of a law, and keep them, or the reason why there are none."""
    hand, name, where, tries, digest, store = piece
    library = awiwi_gen.build(hand, progress=silent)
    try:
        found: Found | str = search(library, LAWS[name], joint_of(library, hand, *where), SEED, tries)
    except InputError as error:
        found = str(error)
    store.put("budgets", digest, found)


def row(found: Found) -> tuple[str, ...]:
    """A law as a row of text: the plant as known beside the worst of the family."""
    known, worst = found.worst(plants=False), found.worst()
    reached = known.within(GOALS[0]) and all(score.good for score in found.scores.values())
    return (
        found.law,
        *(milliseconds(score.settling, 1) for score in (known, worst)),
        *(f"{score.overshoot:.1%}" for score in (known, worst)),
        *(_stiffness(score) for score in (known, worst)),
        f"{worst.slack * 1e3:.0f} ms",
        f"{worst.cycle * 1e3:.2f} mrad",
        f"{worst.steady * 1e3:.2f} mrad",
        f"{found.force:.1f} N",
        "reached" if reached else "missed",
    )


def _stiffness(score: Score) -> str:
    return f"{abs(score.stiffness):.1%}" if abs(score.stiffness) < 1 else "none"
