"""Results for people and for programs: tables, lines, JSON."""

from __future__ import annotations

import json
import math
import sys
import textwrap
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.emit.tree import State
from awiwi_gen.errors import AwiwiError, InputError, printable
from awiwi_gen.ir.cost import operations_text
from awiwi_gen.tables import NARROW, print_table

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand
    from awiwi_gen.kernel import Kernel, Port
    from awiwi_gen.pipeline import Proof
    from awiwi_gen.verify.objects import Seal
    from awiwi_gen.verify.verdict import Verdict

SILENCE = 5.0  # s without a word, after which progress is told to a file, too
COLUMNS = ("kernel", "operations", "sincos", "worst ulp", "scaled error", "witnesses agree", "verdict")
NARROW_COLUMNS = ("kernel", "ops", "ulp", "error", "agree", "verdict")  # without sines, to fit 80 characters


def print_json(value: Any) -> None:
    """One JSON document on standard output; NaN and infinity, which JSON does not have, are null."""
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
            operations_text(entries[v.name]) if v.name in entries else "at load",
            str(entries[v.name]["cost"]["sincos"]) if v.name in entries else "at load",
            f"{v.worst_ulp:.3g}",
            f"{v.worst_scaled_error:.1e}",
            f"{v.agreement:.0e}",
            "proved" if v.passed else "; ".join(v.reasons),
        )
        for v in verdicts
    ]


def print_numbers(rows: Sequence[Mapping[str, Any]], file: Path | None, size: int) -> None:
    """The numbers that kernels read at run time, with units and ranges, or the file that they were written to."""
    if file is not None:
        print(f"{file}: {len(rows)} numbers, {size} bytes")
        return
    table = [
        (row["path"], f"{row['value']:.9g}", row["unit"], f"{row['low']:.6g} to {row['high']:.6g}") for row in rows
    ]
    print_table(("number", "value", "unit", "range"), table)


def print_proof(proof: Proof, manifest: Mapping[str, Any]) -> None:
    """The proof sheet: a table of kernels, the laws of physics, a sentence."""
    rows = [
        (name, count.replace(" + solver", "*"), *others)
        for name, count, _, *others in proof_rows(proof.verdicts, manifest)
    ]
    print_table(NARROW_COLUMNS, rows, f"{manifest['hand']}: {len(rows)} kernels, {manifest['c_type']}")
    print("ops: operations, * without a solver's own; ulp, error: the largest, error as a")
    print("share of the output; agree: difference of the two derivations, likewise")
    parts = dict.fromkeys(law.part for law in proof.laws)
    for part in parts:
        laws = [law for law in proof.laws if law.part == part]
        passed = [law for law in laws if law.passed]
        worst = max((law.worst for law in passed), default=0)
        print(f"{part}: {len(passed)} of {len(laws)} laws of physics hold, to {worst:.0e}")
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
    """The findings about the objects of a single-precision build."""
    if seal.skipped:
        return [f"single precision: objects not examined, {seal.skipped}"]
    faults = [f"{name} FAILS: it computes in double: {', '.join(found)}" for name, found in seal.found.items()]
    return faults or [
        f"single precision: {seal.examined} objects compute nothing in double and call no double function"
    ]


def state_lines(state: State, directory: str, fix: str) -> list[str]:
    """How a generated directory differs from what its job generates, and the command that fixes it."""
    if state.fresh:
        return [f"{directory}: fresh"]
    lines = []
    if state.missing:
        lines.append(f"{directory}: nothing generated here yet")
    lines += [f"{directory}/{name}: edited by hand; changes belong in the hand file" for name in state.edited]
    lines += [f"{directory}/{name}: missing" for name in state.lost]
    lines += [f"{directory}/{name}: not generated; it does not belong here" for name in state.foreign]
    lines += [f"{directory}: stale, another {REASONS.get(key, key)} than it was made from" for key in state.stale]
    return [*map(printable, lines), f"to fix it: {'move that away, then ' if state.foreign else ''}{fix}"]


def kernel_entries(hand: Hand, directory: Path) -> list[dict[str, Any]]:
    """The kernels of a hand as plain data, those that its tendons make impossible last, with the reason.

    Costs are known where the directory was generated from this hand, and of the hand that came with this package;
    elsewhere they are None.
    """
    from awiwi_gen.emit.tree import read_manifest
    from awiwi_gen.hand.capability import left_out
    from awiwi_gen.kernels import declared
    from awiwi_gen.shipped import default_manifest

    made = [found for found in (default_manifest(), read_manifest(directory)) if found]  # that of the directory decides
    known = {entry["name"]: entry for found in made if found["digest"] == hand.digest() for entry in found["kernels"]}
    reasons = left_out(hand)
    entries = [
        known.get(kernel.name) or _entry(kernel, reasons.get((kernel.path, kernel.family), ""))
        for kernel in declared(hand)
    ]
    return sorted(entries, key=lambda entry: "left_out" in entry)


def _entry(kernel: Kernel, reason: str) -> dict[str, Any]:
    def port(name: str, spec: Port) -> dict[str, Any]:
        return {"name": name, "shape": list(spec.shape), "unit": spec.unit_text}

    def ranged(name: str, spec: Port) -> dict[str, Any]:
        bounds = spec.bounds()
        return port(name, spec) | {"low": [low for low, _ in bounds], "high": [high for _, high in bounds]}

    entry = {
        "name": kernel.name,
        "doc": kernel.doc,
        "source": kernel.source,
        "part": kernel.path,
        "inputs": [ranged(name, spec) for name, spec in kernel.inputs.items()],
        "outputs": [port(name, spec) for name, spec in kernel.outputs.items()],
        "cost": None,
    }
    return entry | {"left_out": reason} if reason else entry


def print_kernels(entries: Sequence[Mapping[str, Any]]) -> None:
    """Each kernel with its ports, then its operations and source, in lines of at most 80 characters; none is shortened.

    Those that the hand cannot have come last.
    """
    for entry in entries:
        if "left_out" not in entry:
            given, found = (", ".join(port["name"] for port in entry[side]) for side in ("inputs", "outputs"))
            count = f"{operations_text(entry)} operations; " if entry["cost"] else ""
            print(wrapped(f"{entry['name']}({given}) -> {found}", ""))
            print(wrapped(f"{count}{entry['source']}", "    "))
    print_left_out({entry["name"]: entry["left_out"] for entry in entries if "left_out" in entry})


def wrapped(text: str, indent: str) -> str:
    """Text in lines of at most 80 characters, but for words that are longer; the second and later ones are indented."""
    return printable(
        textwrap.fill(
            text, NARROW, initial_indent=indent, subsequent_indent=f"{indent}    ", break_long_words=False,
            break_on_hyphens=False,
        )
    )  # fmt: skip


def list_kernels(hand: Hand, directory: Path, as_json: bool) -> None:
    """Print the kernels of a hand, and in text what estimates use and a tick needs."""
    from awiwi_gen.emit.options import Options
    from awiwi_gen.hand.capability import estimate_lines
    from awiwi_gen.hand.tick import tick_lines
    from awiwi_gen.hand_model import no_tick
    from awiwi_gen.kernels import catalog

    entries = kernel_entries(hand, directory)
    if as_json:
        print_json(entries)
        return
    print_kernels(entries)
    print("".join(f"{line}\n" for line in (*estimate_lines(hand), *tick_lines(hand))), end="")
    reason = no_tick(hand, catalog(hand), Options())
    print(f"tick: none, for {reason}" if reason else "tick: awiwi_hand_step, docs/hand_step.md")


def counted(number: int, noun: str) -> str:
    """A number with its noun: "1 finger", "2 fingers"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def print_left_out(reasons: Mapping[str, str]) -> None:
    """The kernels that the hand cannot have: a line for each reason."""
    for reason in dict.fromkeys(reasons.values()):
        names = [name for name, why in reasons.items() if why == reason]
        print(f"left out: {', '.join(names)}: {reason}")


def error_entry(error: AwiwiError) -> dict[str, Any]:
    """An error as plain data, with the location of each fault."""
    entry: dict[str, Any] = {"error": type(error).__name__, "message": str(error)}
    return entry | {"faults": [fault.as_dict() for fault in error.faults]} if isinstance(error, InputError) else entry


REASONS = {
    "hand": "hand file",
    "tick": "period, current, effort or sensor",
    "generator": "version of awiwi_gen",
    "libraries": "set of libraries",
}


class Progress:
    """Progress on standard error: one line rewritten on a terminal, elsewhere a line every few seconds and at the end."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._said = time.monotonic()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Show how many tasks of a stage are done."""
        if self._terminal:
            end = "\n" if done == total else ""
            print(f"\r{stage} {done}/{total}", end=end, file=sys.stderr, flush=True)
        elif done == total:
            print(f"{stage}: {total} done", file=sys.stderr, flush=True)
        elif time.monotonic() - self._said > SILENCE:
            print(f"{stage}: {done} of {total}", file=sys.stderr, flush=True)
        else:
            return
        self._said = time.monotonic()
