"""All laws on one joint: which of them reach the goal on which plants, and the delay margin of each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from awiwi_gen.loops.clock import Clocked, clocked
from awiwi_gen.loops.laws import LAWS, STIFFNESS, Law
from awiwi_gen.compare.printed_gains import COLUMNS as PRINTED_COLUMNS
from awiwi_gen.compare.printed_gains import printed_gains
from awiwi_gen.loops.scenarios import BEFORE, FORCES, PLANTS, Score, run, score
from awiwi_gen.errors import unknown
from awiwi_gen.hand import Hand
from awiwi_gen.loops.hand_joint import joint_of
from awiwi_gen.results import Figure, Table, curves
from awiwi_gen.simulate import Trace

COLUMNS = (
    "law", "pretension", "plant", "settling", "overshoot", "steady error", "stiffness error", "sine error", "slack",
    "energy", "chatter", "goal",
)  # fmt: skip
CLOCK_COLUMNS = ("law", "pretension", "spectral radius", "delay margin", "noise", "verdict")


@dataclass(frozen=True)
class Row:
    """A law on one plant under one pretension [N]: its score, and the trace of the step."""

    law: str
    force: float
    plant: str
    score: Score
    step: Trace = field(compare=False, repr=False)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        head = {"law": self.law, "force": self.force, "plant": self.plant}
        return head | asdict(self.score) | {"goal": self.score.good}

    def cells(self) -> tuple[str, ...]:
        """The row as text; a run that did not end has no numbers."""
        s = self.score
        head = (self.law, f"{self.force:g} N", self.plant)
        if s.settling == s.slack == float("inf"):
            return (*head, *("-",) * 8, "failed")
        return (
            *head,
            f"{s.settling * 1e3:.1f} ms" if s.settling < float("inf") else "never",
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
) -> list[Row]:
    """Every law on every plant under every pretension; ``gains`` replace the laws' own."""
    joint, rows = joint_of(library, hand), []
    for law in laws:
        own = law.gains_with(gains or {})
        for force in forces:
            for name in plants:
                if name not in PLANTS:
                    raise unknown("plant", name, PLANTS, "; ".join(PLANTS))
                traces = run(library, law, own, joint.perturbed(**PLANTS[name]), joint.believed(), force)
                scored = score(traces, own.get("K_p", STIFFNESS["K_p"].value))
                rows.append(Row(law.name, force, name, scored, traces["step"]))
    return rows


def clocks(library: Any, hand: Hand, laws: Iterable[Law] = tuple(LAWS.values())) -> list[tuple[float, Clocked]]:
    """Stability and delay margin of every law with its own gains, with each pretension [N]."""
    joint = joint_of(library, hand)
    return [(force, clocked(library, law, law.gains_with({}), joint, force)) for law in laws for force in FORCES]


def tables(clocked: Iterable[tuple[float, Clocked]], rows: Iterable[Row]) -> list[Table]:
    """Both results as tables."""
    return [
        Table("Laws at 3 kHz with one sample of delay", CLOCK_COLUMNS, [_clock_cells(*each) for each in clocked]),
        Table("Laws on one joint; the goal is 40 ms, 2 % overshoot, 3 % stiffness error, no slack", COLUMNS,
              [row.cells() for row in rows]),
    ]  # fmt: skip


def comparison(library: Any, hand: Hand) -> tuple[list[Figure], list[Table]]:
    """Figure and tables for the report page; none for a hand without motors with friction, or without springs."""
    if hand.motor is None or hand.motor.friction is None or hand.spring is None:
        return [], []
    rows, printed = compare(library, hand), [each.cells() for each in printed_gains(library)]
    printed_table = Table("Printed gains at 3 kHz with one sample of delay", PRINTED_COLUMNS, printed)
    return [step_of_all_laws(rows)], [*tables(clocks(library, hand), rows), printed_table]


def step_of_all_laws(rows: Iterable[Row]) -> Figure:
    """Figure 15.24 with the laws that the source compares to, on the joint as known at the lowest pretension."""
    shown = {row.law: row for row in rows if (row.force, row.plant) == (FORCES[0], next(iter(PLANTS)))}
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
    return (
        found.law, f"{force:g} N", f"{found.radius:.4f}", margin, f"{found.noise:.1%}",
        "runs" if found.runs else "refused",
    )  # fmt: skip
