"""Whole fingers under a law of the tick: `awiwi-gen simulate LAW --finger NAME`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import awiwi_gen
from awiwi_gen.compare.shown import Shown
from awiwi_gen.errors import unknown
from awiwi_gen.hand import Hand
from awiwi_gen.loops.scenarios import GOALS
from awiwi_gen.results import Table, milliseconds
from awiwi_gen.tick.finger_scores import (
    FLING,
    OVERSHOOT,
    SETTLING,
    STIFFNESS,
    FingerScore,
    force_limit,
    scores,
    worst_of,
)
from awiwi_gen.tick.status import LAWS
from awiwi_gen.tick.structs import require_tick
from awiwi_gen.tick.whole_finger import PLANTS

ALL, LAW = "all", "backstepping"
COLUMNS = (
    "finger", "plant", "settling", "overshoot", "stiffness", "touching", "pressing", "release", "fling", "turning",
    "slack", "force", "goal",
)  # fmt: skip
Found = Mapping[str, Mapping[str, FingerScore]]


def whole_fingers(hand_file: Path | None, law: str, finger: str) -> Shown:
    """One finger, or all, on all plants. Raises InputError for an unknown law or finger, or a hand without a tick."""
    law = law or LAW
    if law not in LAWS:
        raise unknown("law of whole fingers", law, LAWS, f"there are {', '.join(LAWS)}")
    hand = Hand.load(hand_file)
    if finger != ALL and finger not in hand.fingers:
        raise unknown("finger", finger, hand.fingers, f"there are {', '.join(hand.fingers)}, or {ALL}")
    library = awiwi_gen.build(hand)
    require_tick(library)
    by_plant = {name: scores(library, hand, LAWS.index(law), plant) for name, plant in PLANTS.items()}
    chosen = [name for name in hand.fingers if finger in (ALL, name)]
    found = {name: {plant: each[name] for plant, each in by_plant.items()} for name in chosen}
    most = force_limit(library)
    return Shown(
        {"law": law, "force_limit": most, "fingers": {name: _data(each, most) for name, each in found.items()}},
        [Table(f"{law}: whole fingers, forces by the levers", COLUMNS, list(_rows(found, most)))],
        [
            f"The goal is that of one joint: settling, in contact and after it too, by {SETTLING:g}, overshoot by "
            f"{OVERSHOOT:g}, stiffness and force in",
            f"contact by {STIFFNESS:g}; a fling of {FLING:.0%} of the deflexion; no slack tendon, none above {most:.1f} N.",
            "Heavier links may be slower by the root of their inertia, and a palm that turns deflects them so much more.",
        ],
    )


def reached(plant: str, score: FingerScore, most: float) -> bool:
    """Whether a finger reaches its goal on a plant."""
    return score.within(GOALS[plant != "as known"], most, PLANTS[plant].links)


def _data(found: Mapping[str, FingerScore], most: float) -> dict[str, Any]:
    return {plant: {**score.as_dict(), "goal": reached(plant, score, most)} for plant, score in found.items()}


def _rows(found: Found, most: float) -> Iterator[tuple[str, ...]]:
    for finger, each in found.items():
        for plant, score in each.items():
            yield finger, plant, *cells(score), "reached" if reached(plant, score, most) else "missed"
    calibrated = [score for each in found.values() for plant, score in each.items() if PLANTS[plant].springs == 1]
    yield "worst", "springs as known", *cells(worst_of(calibrated)), ""


def cells(score: FingerScore) -> tuple[str, ...]:
    """The numbers of a score as text."""
    return (
        milliseconds(score.settling),
        f"{score.overshoot:.1%}",
        f"{score.stiffness:.1%}",
        milliseconds(score.touching),
        f"{score.pressing:.1%}",
        milliseconds(score.release),
        f"{score.fling:.0%}",
        f"{score.turning * 1e3:.1f} mrad",
        f"{score.slack * 1e3:.0f} ms",
        f"{score.force:.1f} N",
    )
