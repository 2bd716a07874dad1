"""All laws on one joint: which of them reach the goal on which plants, and the delay margin of each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import product
from typing import Any

from awiwi_gen.compare.printed_gains import COLUMNS as PRINTED_COLUMNS
from awiwi_gen.compare.printed_gains import printed_gains
from awiwi_gen.errors import unknown
from awiwi_gen.hand import Hand
from awiwi_gen.loops.clock import KNOWN, Clocked, clocked
from awiwi_gen.loops.hand_joint import FINGER, JOINT, SENSING, Joint, gains_of, joint_of
from awiwi_gen.loops.laws import LAWS, Law
from awiwi_gen.loops.scenarios import BEFORE, FAMILY, FORCES, PLANTS, Score, load_of, run, score
from awiwi_gen.results import Figure, Table, curves, milliseconds
from awiwi_gen.simulate import Trace

Where = tuple[str, str]  # finger and joint
INDEX_PIP = (FINGER, JOINT)
COLUMNS = (
    "law", "sensing", "pretension", "plant", "settling", "overshoot", "steady error", "stiffness error", "sine error",
    "slack", "energy", "chatter", "goal",
)  # fmt: skip
CLOCK_COLUMNS = (
    "law", "plants", "pretension", "spectral radius", "its plant", "delay margin", "cycle", "noise", "verdict",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """A law with one kind of sensing on one plant under one pretension [N]: its score, and the trace of the step."""

    law: str
    sensing: str
    force: float
    plant: str
    score: Score
    step: Trace = field(compare=False, repr=False)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        head = {"law": self.law, "sensing": self.sensing, "force": self.force, "plant": self.plant}
        return head | asdict(self.score) | {"goal": self.score.good}

    def cells(self) -> tuple[str, ...]:
        """The row as text; a run that did not end has no numbers."""
        s = self.score
        head = (self.law, self.sensing, f"{self.force:g} N", self.plant)
        if s.settling == s.slack == float("inf"):
            return (*head, *("-",) * 8, "failed")
        return (
            *head,
            milliseconds(s.settling, 1),
            f"{s.overshoot:.1%}",
            f"{s.steady * 1e3:.3f} mrad",
            f"{s.stiffness:+.1%}",
            f"{s.sine * 1e3:.2f} mrad",
            f"{s.slack * 1e3:.0f} ms",
            f"{s.energy:.2f} J",
            f"{s.chatter:.3f} N m",
            "reached" if s.good else "missed",
        )


def compare(
    library: Any,
    hand: Hand,
    laws: Iterable[Law] = tuple(LAWS.values()),
    gains: Mapping[str, float] | None = None,
    forces: Sequence[float] = FORCES,
    plants: Iterable[str] = PLANTS,
    sensings: Iterable[str] = SENSING,
    where: Where = INDEX_PIP,
) -> list[Row]:
    """Every law on every plant, with every sensing and pretension; ``gains`` replace the laws' own.

    Gains of the hand file and their pretension are those of the adaptive law.
    """
    joint, rows = joint_of(library, hand, *where), []
    load = load_of(joint)
    for law in laws:
        own, held = own_gains(library, hand, law, where, gains or {}, forces)
        for sensing, force, name in product(sensings, held, plants):
            if name not in PLANTS:
                raise unknown("plant", name, PLANTS, "; ".join(PLANTS))
            true = joint.perturbed(**PLANTS[name])
            traces = run(library, law, own, true, joint.believed(), force, sensing=sensing)
            scored = score(traces, own.get("K_p", wanted_stiffness(joint)), load)
            rows.append(Row(law.name, sensing, force, name, scored, traces["step"]))
    return rows


def wanted_stiffness(joint: Joint) -> float:
    """The stiffness [N m/rad] that a law without an impedance is measured by: that of the laws that have one."""
    return LAWS["backstepping_antagonistic"].gains_for(joint)["K_p"]


def own_gains(
    library: Any, hand: Hand, law: Law, where: Where, chosen: Mapping[str, float], forces: Sequence[float]
) -> tuple[dict[str, float], Sequence[float]]:
    """Gains of a law on a joint, and pretensions [N]: for the adaptive law those of the hand file, if it has some."""
    joint, tendon = joint_of(library, hand, *where), gains_of(library, hand, *where)
    if law.name != "backstepping_adaptive" or chosen or tendon is None:
        return law.gains_with(chosen, joint), forces
    return law.gains_from(joint, tendon), forces if tendon.pretension is None else (float(tendon.pretension),)


def clocks(
    library: Any, hand: Hand, laws: Iterable[Law] = tuple(LAWS.values()), where: Where = INDEX_PIP,
    plants: Mapping[str, Mapping[str, Any]] = KNOWN,
) -> list[tuple[float, Clocked]]:  # fmt: skip
    """Stability and delay margin of every law with its own gains, with each pretension [N], the worst of some plants."""
    joint = joint_of(library, hand, *where)
    found = []
    for law in laws:
        gains, forces = own_gains(library, hand, law, where, {}, FORCES)
        found += [(force, clocked(library, law, gains, joint, force, plants)) for force in forces]
    return found


SUMMARY_COLUMNS = ("law", "sensing", "pretension", "goal", "settling", "of all", "overshoot", "of all")


def summary(rows: Iterable[Row]) -> Table:
    """One row for each law, sensing and pretension: plants on which the goal is reached, results as known and the worst."""
    groups: dict[tuple[str, str, float], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.law, row.sensing, row.force), []).append(row)

    cells: list[tuple[str, ...]] = []
    for (law, sensing, force), members in groups.items():
        scores = [row.score for row in members]
        reached = f"{sum(each.good for each in scores)} of {len(scores)}"
        settling = milliseconds(scores[0].settling), milliseconds(max(each.settling for each in scores))
        overshoot = f"{scores[0].overshoot:.0%}", f"{max(each.overshoot for each in scores):.0%}"
        cells.append((law, sensing, f"{force:g} N", reached, *settling, *overshoot))
    return Table("Summary: plants that reach the goal; results as known, and the worst of all", SUMMARY_COLUMNS, cells)


def tables(clocked: Iterable[tuple[float, Clocked]], rows: Iterable[Row]) -> list[Table]:
    """Both results as tables."""
    return [
        Table("Laws at 3 kHz with one sample of delay", CLOCK_COLUMNS, [_clock_cells(*each) for each in clocked]),
        Table("Laws on one joint; the goal is 45 ms, 4 % overshoot, 4 % stiffness error, no slack or cycle", COLUMNS,
              [row.cells() for row in rows]),
    ]  # fmt: skip


def comparison(library: Any, hand: Hand) -> tuple[list[Figure], list[Table]]:
    """Figure and tables for the report page; none for a hand without motors with friction, or without springs."""
    if hand.motor is None or hand.motor.friction is None or hand.spring is None:
        return [], []
    rows, printed = compare(library, hand), [each.cells() for each in printed_gains(library)]
    printed_table = Table("Printed gains at 3 kHz with one sample of delay", PRINTED_COLUMNS, printed)
    both = [*clocks(library, hand), *clocks(library, hand, plants=FAMILY)]
    return [step_of_all_laws(rows)], [*tables(both, rows), printed_table]


def step_of_all_laws(rows: Iterable[Row]) -> Figure:
    """Figure 15.24 with the laws that the source compares to, on the joint as known at the lowest pretension."""
    known = [row for row in rows if (row.sensing, row.plant) == (SENSING[0], next(iter(PLANTS)))]
    shown = {row.law: row for row in reversed(known)}  # each with its lowest pretension
    exact, cascade, adaptive = (
        shown[name].score for name in ("backstepping_antagonistic", "cascade", "backstepping_adaptive")
    )
    lines = {
        name: ((row.step.time - BEFORE * row.step.time[1]) * 1e3, row.step["x"][:, 0]) for name, row in shown.items()
    }
    return Figure(
        "15.24 (all laws)", "One step under all laws, on a joint of the hand",
        "The antagonistic law settles faster than the cascade, and overshoots less.",
        f"The exact law settles in {exact.settling * 1e3:.0f} ms, the cascade in {cascade.settling * 1e3:.0f} ms "
        f"with {cascade.overshoot:.0%} of overshoot; with springs and friction estimated by an observer, the law "
        f"settles in {adaptive.settling * 1e3:.0f} ms.",
        exact.settling < cascade.settling and exact.overshoot < cascade.overshoot,
        curves(None, lines, "t [ms]", "q [rad]", xlim=(-5, 150)),
    )  # fmt: skip


def _clock_cells(force: float, found: Clocked) -> tuple[str, ...]:
    """A row of the table of clocks as text."""
    margin = f"{found.margin * 1e6:.0f} us" if found.margin < float("inf") else "beyond 2 ms"
    cycle = f"{found.cycle * 1e3:.2f} mrad" if found.cycle < float("inf") else "runs away"
    return (
        found.law, str(found.plants), f"{force:g} N", f"{found.radius:.4f}", found.at["radius"], margin, cycle,
        f"{found.noise:.1%}",
        "runs" if found.runs else "refused",
    )  # fmt: skip
