"""The numbers that kernels read at run time: which they are, and the flat file that holds those of a hand."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from pathlib import Path
from typing import Any

from awiwi_gen.emit.options import Options
from awiwi_gen.emit.params import Numbers, paths_read
from awiwi_gen.emit.params_file import pack
from awiwi_gen.errors import InputError, OutputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.ranges import ranges
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.passes.lift import merge
from awiwi_gen.kernel import Kernel
from awiwi_gen.kernels import catalog
from awiwi_gen.records import Record


def derivations(kernels: Sequence[Kernel], records: Mapping[str, Record]) -> dict[str, Graph]:
    """The graph of the derived numbers of every part that has any, by path; equal ones of several kernels are one."""
    parts: dict[str, list[Graph]] = {}
    for kernel in kernels:
        derivation = records[kernel.name].derivation
        if derivation is not None and derivation.outputs:
            parts.setdefault(kernel.path, []).append(derivation)
    return {part: merge(graphs) for part, graphs in parts.items()}


def of_part(part: str, values: Mapping[str, Fraction]) -> dict[str, Fraction]:
    """The numbers of a part, by their paths relative to it."""
    start = f"{part}." if part else ""
    return {path.removeprefix(start): value for path, value in values.items() if path.startswith(start)}


def numbers_of(hand: Hand, kernels: Sequence[Kernel], records: Mapping[str, Record]) -> Numbers | None:
    """The numbers that kernels or their callers read, in the order of the hand file; None if there are none."""
    derived, paths, zeros = derivations(kernels, records), set[str](), set[str]()
    for kernel in kernels:
        record = records[kernel.name]
        paths |= paths_read(kernel.path, [graph for graph in (record.graph, record.derivation) if graph])
        zeros |= {f"{kernel.path}.{path}".lstrip(".") for path in record.zeros}
        if kernel.solver is not None:
            paths |= {f"{kernel.path}.{path}" for each in kernel.solver.limits.values() for path in each if path}
    # Gains are inputs of the laws: the firmware reads them and passes them on.
    quantities = {path: each for path, each in hand.quantities().items() if path in paths or path.startswith("gains[")}
    if not quantities:
        return None
    permitted = ranges(hand)
    digest = structure_digest(list(quantities), sorted(zeros), kernels)
    return Numbers(quantities, {path: permitted[path] for path in quantities}, derived, sorted(zeros), digest)


def structure_digest(paths: Sequence[str], zeros: Sequence[str], kernels: Sequence[Kernel]) -> str:
    """What a file of numbers must agree with: the numbers in their order, those that are zero, and the kernels' parts."""
    structures = sorted({(kernel.path, kernel.structure) for kernel in kernels})
    return sha256(json.dumps([list(paths), list(zeros), structures]).encode()).hexdigest()


@dataclass(frozen=True)
class NumbersFile:
    """The numbers of a hand for kernels that were generated before, as rows for people and as bytes for C."""

    rows: list[dict[str, Any]]
    data: bytes

    def write(self, path: Path) -> None:
        """Write the bytes, all or nothing. Raises OutputError where the system refuses."""
        unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
        try:
            unfinished.write_bytes(self.data)
            os.replace(unfinished, path)
        except OSError as error:
            raise OutputError(f"{path} cannot be written: {error.strerror}") from None
        finally:
            unfinished.unlink(missing_ok=True)


def numbers_file(hand: Hand, manifest: Mapping[str, Any], directory: str) -> NumbersFile:
    """The numbers of a hand that generated kernels read.

    Raises InputError where the kernels read no numbers at run time, or were made from a hand with another structure.
    """
    layout = manifest.get("params")
    if not layout:
        raise InputError(
            f"{directory}: its kernels read no numbers at run time; expected a directory that was made with "
            "awiwi-gen generate --params runtime"
        )
    again = f"generate again: awiwi-gen generate --params runtime -o {directory}"
    paths = [entry["path"] for entry in layout["numbers"]]
    given = hand.quantities()
    faults = [f"{path} is missing from the hand file; {again}" for path in paths if path not in given]
    faults += [
        f"{path} = {given[path].text} is zero in the hand that {directory} was made from, and so a constant of its code; "
        f"{again}"
        for path in layout["zeros"]
        if path in given and given[path].value
    ]
    names = {entry["name"] for entry in manifest["kernels"]}
    kernels = [kernel for kernel in catalog(hand) if kernel.name in names]
    if not faults and structure_digest(paths, layout["zeros"], kernels) != layout["digest"]:
        faults = [f"{directory} was made from a hand with another structure (joints, tendons, springs); {again}"]
    if faults:
        raise InputError("\n".join(faults))
    options = Options(**{key: value for key, value in manifest["inputs"]["options"].items() if key != "only"})
    values: list[Fraction] = [given[path].value for path in paths]
    rows = [{**entry, "value": float(value)} for entry, value in zip(layout["numbers"], values, strict=True)]
    return NumbersFile(rows, pack(values, layout["digest"], options))
