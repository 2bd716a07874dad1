"""Gains that hold on a family of wrong plants, for every joint of a hand that has a pair of tendons: `awiwi-gen tune`.

Each joint is a search of its own (`loops/search.py`), so all cores work; what is found is kept in the cache by the digest
of all that decides it. What is written for a tendon are the gains of its joint, its pretension, and the rates of the
observer and of what it learns. The certificate of the gains, one row for each joint, is kept in the cache and beside the
file: `awiwi-gen check` reads it from there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import awiwi_gen
from awiwi_gen import parallel
from awiwi_gen.cache import Cache, code_digest, key
from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.gains import OPTIONAL, REQUIRED
from awiwi_gen.loops.hand_joint import drives, joint_of, pair_of
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.loops.scenarios import GOALS
from awiwi_gen.loops.search import SEED, TRIES, Found, search
from awiwi_gen.parallel import Progress, silent

LAW = LAWS["backstepping_adaptive"]
NEEDED = (
    "backstepping_ant*,backstepping_adaptive,reference_filter,antagonistic_*,plant_antagonistic,motor_energy,"
    "spring_elongation,spring_stiffness,*_coupling,*_mass_matrix"
)
Tuned = tuple["Pulled", Found]
SEARCHED = ("awiwi_gen/loops", "awiwi_gen/definitions", "awiwi_gen/simulate.py", "csrc")


@dataclass(frozen=True)
class Pulled:
    """A joint with a pair of tendons: finger, joint, and the numbers in the hand of the tendons that are its own."""

    finger: str
    joint: str
    tendons: tuple[int, ...]

    @property
    def name(self) -> str:
        """As messages have it."""
        return f"{self.finger}, {self.joint}"


def pulled_joints(library: Any, hand: Hand) -> tuple[list[Pulled], list[str]]:
    """The joints with a pair, and the reasons why others have no gains. Raises InputError for a hand without motors."""
    if hand.motor is None or hand.spring is None or hand.motor.friction is None:
        raise InputError("gains need a hand with the sections [motor], with friction, and [spring]")
    found, without = [], []
    for name, finger in hand.fingers.items():
        if finger.sliding or not finger.pulled:
            why = f"{finger.sliding[0]} slides" if finger.sliding else "no motor pulls its tendons"
            without.append(f"fingers.{name} has no gains: {why}")
            continue
        driven, first = drives(library, name, float(hand.motor.pulley)), hand.blocks[name][0].start
        for index, joint in enumerate(finger.joints):
            own = tuple(first + each.tendon for each in driven if each.joint == index)
            if pair_of(driven, index) is None:
                without.append(f"fingers.{name}: the joint {joint} has no pair of tendons, one for each direction")
            elif own:
                found.append(Pulled(name, joint, own))
    return found, without


def tune_family(
    hand: Hand, store: Cache, seed: int = SEED, tries: int = TRIES, only: Callable[[str], bool] = lambda _: True,
    progress: Progress = silent,
) -> tuple[list[tuple[Pulled, Found]], list[str]]:  # fmt: skip
    """Gains of every joint, and what has none. Raises InputError with each joint on which no try runs."""
    library = awiwi_gen.build(hand, only=NEEDED)
    joints, without = pulled_joints(library, hand)
    joints = [each for each in joints if only(f"{each.finger}_{each.joint}")]
    if not joints:
        raise InputError("; ".join(without) or "no joint has such a name; awiwi-gen show lists fingers and joints")
    digests = [searched(hand, each, seed, tries) for each in joints]
    missing = set(store.missing("tuned", digests))
    work = [(hand, each, seed, tries, digest, store) for each, digest in zip(joints, digests, strict=True)]
    parallel.run("tune", find, [piece for piece in work if piece[-2] in missing], progress)
    found = [store.get("tuned", digest) for digest in digests]
    faults = [
        Fault(message=f"{each.name}: {why}") for each, why in zip(joints, found, strict=True) if isinstance(why, str)
    ]
    if faults:
        raise InputError(faults)
    return list(zip(joints, found, strict=True)), without  # type: ignore[arg-type]


def searched(hand: Hand, joint: Pulled, seed: int, tries: int) -> str:
    """The digest of all that decides the gains of a joint."""
    return key(hand.digest(), joint.finger, joint.joint, seed, tries, code_digest(*SEARCHED))


def find(piece: tuple[Hand, Pulled, int, int, str, Cache]) -> None:
    """Search the gains of one joint, and keep them, or the reason why there are none."""
    hand, each, seed, tries, digest, store = piece
    library = awiwi_gen.build(hand, only=NEEDED, progress=silent)
    joint = joint_of(library, hand, each.finger, each.joint)
    try:
        found: Found | str = search(library, LAW, joint, seed, tries)
    except InputError as error:
        found = str(error)
    store.put("tuned", digest, found)


def gains_text(found: list[tuple[Pulled, Found]], seed: int, tries: int) -> str:
    """A file of gains, with four digits: a law that holds on the family does not need more."""
    lines = [
        "# Gains of the adaptive law that hold on a family of wrong plants, one table for each tendon.",
        f"# Written by `awiwi-gen tune --seed {seed} --tries {tries}`.",
    ]
    tables = sorted(((tendon, each, result) for each, result in found for tendon in each.tendons), key=lambda t: t[0])
    for tendon, each, result in tables:
        values = {**result.gains, "pretension": result.force}
        lines += ["", "[[gains]]", f"tendon = {tendon}  # {each.name}"]
        lines += [f'{name} = "{values[name]:.4g} {unit}"' for name, unit in {**REQUIRED, **OPTIONAL}.items()]
        lines.append('source = "awiwi-gen tune"')
    return "\n".join(lines) + "\n"


def as_data(found: list[tuple[Pulled, Found]]) -> list[dict[str, Any]]:
    """Plain data for JSON."""
    return [
        {
            **asdict(each), "gains": dict(result.gains), "pretension": result.force, "cost": result.cost,
            "known": asdict(result.worst(plants=False)), "family": asdict(result.worst()),
        }
        for each, result in found
    ]  # fmt: skip


def write(path: Path, text: str) -> None:
    """Write a file. Raises InputError where that is impossible."""
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from None


COLUMNS = ("joint", "fastest", "settling", "family", "overshoot", "family", "stiffness", "family", "slack", "cycle",
           "pretension", "K_p", "goal")  # fmt: skip


def rows(found: list[tuple[Pulled, Found]]) -> list[tuple[str, ...]]:
    """A row for each joint: the plant as known beside the worst of the family."""
    return [_row(each, result) for each, result in found]


def _row(each: Pulled, result: Found) -> tuple[str, ...]:
    known, worst = result.worst(plants=False), result.worst()
    reached = known.within(GOALS[0]), all(score.good for score in result.scores.values())
    return (
        f"{each.finger} {each.joint}",
        f"{result.fastest * 1e3:.0f} ms",
        *(f"{score.settling * 1e3:.1f} ms" for score in (known, worst)),
        *(f"{score.overshoot:.1%}" for score in (known, worst)),
        *(f"{abs(score.stiffness):.2%}" for score in (known, worst)),
        f"{worst.slack * 1e3:.0f} ms",
        f"{worst.cycle * 1e3:.2f} mrad",
        f"{result.force:.1f} N",
        f"{result.gains['K_p']:.3g} N m/rad",
        "reached" if all(reached) else "missed",
    )
