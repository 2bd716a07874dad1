"""What `awiwi-gen simulate` does and shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import awiwi_gen
from awiwi_gen.compare import compare
from awiwi_gen.compare.clock import require_clocked
from awiwi_gen.compare.laws import LAWS, law_of
from awiwi_gen.compare.scenarios import BEFORE, FORCES, PLANTS, run
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.hand import Hand
from awiwi_gen.loops.hand_joint import joint_of
from awiwi_gen.report import print_json, print_table
from awiwi_gen.results import Table
from awiwi_gen.simulate import PERIOD

SHOWN = 30  # ticks from one shown line of a run to the next


@dataclass(frozen=True)
class Shown:
    """A result for programs, and as tables for people."""

    data: Any
    tables: Sequence[Table]

    def show(self, as_json: bool) -> None:
        """Print one or the other."""
        if as_json:
            print_json(self.data)
            return
        for table in self.tables:
            print_table(table.columns, table.rows, table.title)


def read_gains(text: str) -> dict[str, float]:
    """``K_p=0.5,K_d=0.003`` as numbers by their names. Raises InputError for anything else."""
    found = {}
    for part in filter(None, text.split(",")):
        name, _, number = part.partition("=")
        try:
            found[name.strip()] = float(number)
        except ValueError:
            raise InputError(f"--gains: {part!r} is not name=number, such as K_p=0.5,K_d=0.003") from None
    return found


def benchmark(hand_file: Path | None, name: str, gains: str) -> Shown:
    """One law, or all, on all plants, after its gains were found to run. Raises InputError for such that cannot."""
    chosen = read_gains(gains)
    if chosen and not name:
        raise InputError("--gains are for one law; name it: awiwi-gen simulate LAW --gains ...")
    laws = [law_of(name)] if name else list(LAWS.values())
    for law in laws:
        law.gains_with(chosen)  # told before anything is compiled
    hand = Hand.load(hand_file)
    library = awiwi_gen.build(hand)
    if chosen:
        joint, own = joint_of(library, hand), laws[0].gains_with(chosen)
        clocked = [(force, require_clocked(library, laws[0], own, joint, force)) for force in FORCES]
    else:
        clocked = compare.clocks(library, hand, laws)
    rows = compare.compare(library, hand, laws, chosen)
    return Shown(
        {
            "clock": [{"force": force, **found.as_dict()} for force, found in clocked],
            "benchmark": [row.as_dict() for row in rows],
        },
        compare.tables(clocked, rows),
    )


def one_run(hand_file: Path | None, name: str, gains: str, scenario: str, force: float, plant: str) -> Shown:
    """One run of one law, sample by sample for programs. Raises InputError for what there is not."""
    law = law_of(name)
    own = law.gains_with(read_gains(gains))
    if plant not in PLANTS:
        raise unknown("plant", plant, PLANTS, f"there are {'; '.join(PLANTS)}")
    if not 0 < force <= FORCES[-1] * 2:
        raise InputError(f"--force {force:g}: a pretension is more than 0 and at most {FORCES[-1] * 2:g} N")
    hand = Hand.load(hand_file)
    library = awiwi_gen.build(hand)
    joint = joint_of(library, hand)
    require_clocked(library, law, own, joint, force)
    trace = run(library, law, own, joint.perturbed(**PLANTS[plant]), joint.believed(), force, [scenario])[scenario]
    time = trace.time - BEFORE * PERIOD
    columns = {"q": trace["x"][:, 0], "tau_1": trace["tau"][:, 0], "tau_2": trace["tau"][:, 1]}
    columns |= {"u_1": trace["u"][:, 0], "u_2": trace["u"][:, 1]}
    rows = [(f"{time[i]:.3f}", *(f"{c[i]:.4f}" for c in columns.values())) for i in range(0, len(time), SHOWN)]
    head = ("t [s]", "q [rad]", *(f"{name} [N m]" for name in list(columns)[1:]))
    return Shown(
        {
            "law": name, "scenario": scenario, "plant": plant, "force": force, "gains": own, "refused": trace.refused,
            "status": trace.status, "time": time.tolist(), **{name: c.tolist() for name, c in columns.items()},
        },
        [Table(f"{name}: {scenario}, {plant}", head, rows)],
    )  # fmt: skip
