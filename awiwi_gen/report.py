"""Results for people and for programs: tables, lines, JSON."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from awiwi_gen.emit.tree import State
from awiwi_gen.ir.cost import operations_text

if TYPE_CHECKING:
    from awiwi_gen.pipeline import Proof
    from awiwi_gen.verify.objects import Seal
    from awiwi_gen.verify.verdict import Verdict

COLUMNS = ("kernel", "operations", "sincos", "worst ulp", "scaled error", "witnesses agree", "verdict")


def print_json(value: Any) -> None:
    """One JSON document on standard output; what is not a number is null, for JSON has no word for it."""
    json.dump(_finite(value), sys.stdout, indent=1, ensure_ascii=False, allow_nan=False)
    sys.stdout.write("\n")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def proof_rows(verdicts: Iterable[Verdict], manifest: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """The table of the proof sheet, one row per kernel."""
    entries = {entry["name"]: entry for entry in manifest["kernels"]}
    return [
        (
            v.name,
            operations_text(entries[v.name]),
            str(entries[v.name]["cost"]["sincos"]),
            f"{v.worst_ulp:.3g}",
            f"{v.worst_scaled_error:.1e}",
            f"{v.agreement:.0e}",
            "proved" if v.passed else "; ".join(v.reasons),
        )
        for v in verdicts
    ]


def print_proof(proof: Proof, manifest: Mapping[str, Any]) -> None:
    """The proof sheet: a table of kernels, the laws of physics, a sentence."""
    rows = proof_rows(proof.verdicts, manifest)
    print_table(COLUMNS, rows, f"{manifest['hand']}: {len(rows)} kernels, {manifest['c_type']}")
    parts = dict.fromkeys(law.part for law in proof.laws)
    for part in parts:
        laws = [law for law in proof.laws if law.part == part]
        kept = [law for law in laws if law.passed]
        print(
            f"{part}: {len(kept)} of {len(laws)} laws of physics hold, to {max((k.worst for k in kept), default=0):.0e}"
        )
    for law in proof.laws:
        if not law.passed:
            print(f"{law.part} FAILS: {law.statement} (by {law.worst:.1e})")
    if proof.seal is not None:
        print("\n".join(seal_lines(proof.seal)))
    v = proof.verdicts
    failed = [x.name for x in v if not x.passed]
    print(
        f"{len(v) - len(failed)} of {len(v)} kernels proved at {v[0].samples} samples each (seed {v[0].seed})"
        + (f"; FAILED: {', '.join(failed)}" if failed else "")
    )


def seal_lines(seal: Seal) -> list[str]:
    """What is said of the objects of a single-precision build."""
    if seal.skipped:
        return [f"single precision: objects not examined, {seal.skipped}"]
    faults = [f"{name} FAILS: it computes in double: {', '.join(found)}" for name, found in seal.found.items()]
    return faults or [
        f"single precision: {seal.examined} objects compute nothing in double and call no double function"
    ]


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], title: str = "") -> None:
    """Aligned columns: drawn with rich on a terminal, plain lines elsewhere."""
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table

        table = Table(title=title or None, title_justify="left")
        for i, column in enumerate(columns):
            table.add_column(column, justify="left" if i in (0, len(columns) - 1) else "right")
        for row in rows:
            table.add_row(*row, style="red" if row[-1] not in ("proved", "") else None)
        Console().print(table)
        return
    if title:
        print(title)
    widths = [max(len(str(r[i])) for r in [columns, *rows]) for i in range(len(columns))]
    for row in [columns, *rows]:
        cells = [
            c.ljust(w) if i in (0, len(columns) - 1) else c.rjust(w)
            for i, (c, w) in enumerate(zip(row, widths, strict=True))
        ]
        print("  ".join(cells).rstrip())


def state_lines(state: State, directory: str, mend: str) -> list[str]:
    """What is the matter with a generated directory, and how to mend it."""
    if state.fresh:
        return [f"{directory}: fresh"]
    lines = []
    if state.missing:
        lines.append(f"{directory}: nothing generated here yet")
    lines += [f"{directory}/{name}: edited by hand; changes belong in the hand file" for name in state.edited]
    lines += [f"{directory}/{name}: missing" for name in state.lost]
    lines += [f"{directory}/{name}: not generated; it does not belong here" for name in state.foreign]
    lines += [f"{directory}: stale, another {REASONS.get(key, key)} than it was made from" for key in state.stale]
    return [*lines, f"to mend it: {'move that away, then ' if state.foreign else ''}{mend}"]


REASONS = {"hand": "hand file", "generator": "version of awiwi_gen", "libraries": "set of libraries"}


class Progress:
    """Progress on standard error: one line rewritten on a terminal, one line per stage elsewhere."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Tell how far a stage has come."""
        if self._terminal:
            end = "\n" if done == total else ""
            print(f"\r{stage} {done}/{total}", end=end, file=sys.stderr, flush=True)
        elif done == total:
            print(f"{stage}: {total} done", file=sys.stderr, flush=True)
