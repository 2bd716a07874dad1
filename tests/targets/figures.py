"""What every kernel costs on every target: code, constants, executed instructions, worst-case stack; and their table.

The table names its compilers. With the same compiler a figure may grow by 2 %; with another, changes are printed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path

from .programs import CSRC, Run, run_tool
from .toolchains import HERE

TABLE = HERE / "figures.tsv"
TOLERANCE = 0.02
LIBRARY_STACK = 128  # bytes that memcpy, sqrt and software arithmetic may use; no compiler prints theirs
CODE, CONSTANTS = re.compile(r"^\.text\S* +(\d+)", re.M), re.compile(r"^\.s?rodata\S* +(\d+)", re.M)
NODE = re.compile(r'^node: \{ title: "([^"]+)" label: "[^"]*?\\n(\d+) bytes \(', re.M)
EDGE = re.compile(r'^edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', re.M)
INDIRECT = "__indirect_call"


@dataclass(frozen=True)
class Figures:
    """Bytes of code and of constants in a kernel's own object, executed instructions, bytes of stack."""

    code: int
    constants: int
    instructions: int
    stack: int

    def __str__(self) -> str:
        return " ".join(map(str, astuple(self)))


class CallGraph:
    """Frames and calls of all functions of a program, from the .ci files that gcc writes."""

    def __init__(self, objects: Iterable[Path]) -> None:
        self.frames: dict[str, int] = {}
        self.calls: dict[str, set[str]] = {}
        self.members: dict[str, list[str]] = {}  # by the stem of the C file
        for path in objects:
            text = path.with_suffix(".ci").read_text()
            for name, frame in NODE.findall(text):
                self.frames[name] = int(frame)
                self.members.setdefault(path.stem.rsplit("-", 1)[0], []).append(name)
            for caller, callee in EDGE.findall(text):
                self.calls.setdefault(caller, set()).add(callee)

    def stack(self, kernel: str, function: str) -> int:
        """Most bytes of stack below a kernel's call: the deepest path, and what library functions may use.

        A pointer can lead to any other function of the kernel's own file: solvers call back what it handed to them.
        """
        members = self.members[kernel]

        @cache
        def deepest(name: str, inside: tuple[str, ...]) -> int:
            if name in inside:
                raise ValueError(f"{kernel}: {name} calls itself")
            targets = (
                [other for other in members if other not in inside] if name == INDIRECT else self.calls.get(name, ())
            )
            return self.frames.get(name, 0) + max(
                (deepest(other, (*inside, name)) for other in sorted(targets)), default=0
            )

        return deepest(function, ()) + LIBRARY_STACK


def measure(
    prefix: str, runs: Mapping[str, Run], objects: Sequence[Path], size: str
) -> tuple[dict[str, Figures], list[str]]:
    """Figures by kernel, by hand-written file as ``csrc/riccati``, and of the self-test; and what used more stack than
    that.

    ``size`` is the binutils program of the target.
    """
    graph = CallGraph(objects)
    figures, faults = {}, []
    for path, (code, constants) in zip(objects, _sizes(objects, size), strict=True):
        name = path.stem.rsplit("-", 1)[0]
        if name in runs:
            stack = graph.stack(name, f"{prefix}_{name}")
            figures[name] = Figures(code, constants, runs[name].instructions, stack)
            if runs[name].stack > stack:
                faults.append(f"{name} used {runs[name].stack} bytes of stack; its call graph has {stack}")
        elif code + constants:
            figures[f"csrc/{name}" if (CSRC / f"{name}.c").exists() else name] = Figures(code, constants, 0, 0)
    return figures, faults


def _sizes(objects: Sequence[Path], size: str) -> list[tuple[int, int]]:
    parts = run_tool(size, "-A", *objects).split("\n\n")
    texts = [part for part in parts if "section" in part]
    return [(sum(map(int, CODE.findall(text))), sum(map(int, CONSTANTS.findall(text)))) for text in texts]


Table = dict[str, dict[str, Figures]]  # by column, then by kernel


def read_table(path: Path = TABLE) -> tuple[dict[str, str], Table]:
    """The compilers by column, and the figures."""
    if not path.exists():
        return {}, {}
    compilers, table, columns = {}, {}, []
    for line in path.read_text(encoding="utf-8").splitlines():
        cells = line.split("\t")
        if line.startswith("# "):
            if len(cells) == 2:
                compilers[cells[0][2:]] = cells[1]
        elif cells[0] == "kernel":
            columns = cells[1:]
            table = {column: {} for column in columns}
        else:
            for column, cell in zip(columns, cells[1:], strict=True):
                if cell:
                    table[column][cells[0]] = Figures(*map(int, cell.split()))
    return compilers, table


def write_table(compilers: Mapping[str, str], table: Table, path: Path = TABLE) -> None:
    """Write the table, one line per kernel."""
    lines = [
        "# Cells: bytes of code, bytes of constants, executed instructions (0: not counted), bytes of stack.",
        "# Written by `make firmware ACCEPT=1`; see docs/firmware.md.",
    ]
    lines += [f"# {column}\t{compilers[column]}" for column in table]
    lines.append("\t".join(["kernel", *table]))
    for kernel in dict.fromkeys(name for column in table.values() for name in column):
        lines.append("\t".join([kernel, *(str(column.get(kernel, "")) for column in table.values())]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def compare(old: Mapping[str, Figures], new: Mapping[str, Figures]) -> list[str]:
    """Every figure that grew by more than 2 %, and kernels that the table lacks."""
    found = []
    for kernel, figures in new.items():
        if kernel not in old:
            found.append(f"{kernel} is not in the table")
            continue
        for name, value in vars(figures).items():
            before = getattr(old[kernel], name)
            if value > before * (1 + TOLERANCE):
                found.append(f"{kernel}: {name} {before} -> {value}")
    return found
