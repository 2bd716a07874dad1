"""`make mutants`: change one operator or constant of csrc/ at a time, and see whether any result changes.

python -m tests.targets.mutants                every mutant
python -m tests.targets.mutants --count 60     a fixed random choice of them

A mutant is found where it does not compile, does not end, crashes, or changes a bit of an output of a kernel that
iterates, on its golden inputs, or of a solver or reader on those of problems.c. One that survives must have a line in
survivors.tsv that says why it changes no result.
Exit codes: 0 done, 1 a mutant survives without a reason.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import awiwi_gen
from awiwi_gen.pipeline import Job, cached_tree

from .driver import golden_inputs, write_driver
from .programs import CSRC, compile_all, run_tool
from .toolchains import HERE, ROOT, STRICT, Target

Array = np.ndarray[Any, Any]
HOST = Target("x86-64 gcc -O1", "gcc", ("-O1",))
SANITIZERS = "-fsanitize=address,undefined,float-cast-overflow"  # a mutant that leaves an array is found
SURVIVORS = HERE / "survivors.tsv"
ROWS = 160  # inputs of every kernel: more branches are taken than by the few that targets run
LONGEST = 20  # seconds; the unchanged program takes about one
SKIPPED = re.compile(r'/\*.*?\*/|"[^"\n]*"|^#[^\n]*|\b(?:static|extern) [^;{]*\{', re.S | re.M)
CHANGES = {
    " + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " < ": " <= ", " <= ": " < ", " > ": " >= ", " >= ": " > ",
    " == ": " != ", " != ": " == ", " && ": " || ", " || ": " && ", " += ": " -= ", " -= ": " += ", "++": "--",
}  # fmt: skip
PLACE = re.compile(
    "|".join(re.escape(old) for old in sorted(CHANGES, key=len, reverse=True)) + r"|(?<![\w.])\d+(?![\w.])"
)


@dataclass(frozen=True)
class Mutant:
    """One change: which file, which line (counted from 1), what the line was and what it is."""

    path: Path
    line: int
    before: str
    after: str
    text: str

    @property
    def key(self) -> tuple[str, str, str]:
        """What survivors.tsv names it by: no line number, so that other edits do not matter."""
        return self.path.name, self.before.strip(), self.after.strip()


def mutated_files(pattern: str = "*.c") -> list[Path]:
    """The C files of csrc that are changed: all but the simulator, which is no firmware."""
    return [path for path in sorted(CSRC.glob(pattern)) if path.name != "simulate.c"]


def mutants(path: Path) -> Iterator[Mutant]:
    """All changes of one operator or one whole number in a C file."""
    text = path.read_text(encoding="utf-8")
    hidden = SKIPPED.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    for match in PLACE.finditer(hidden):
        new = CHANGES.get(match[0]) or str(int(match[0]) + 1)
        changed = text[: match.start()] + new + text[match.end() :]
        line = text.count("\n", 0, match.start())
        yield Mutant(path, line + 1, text.split("\n")[line], changed.split("\n")[line], changed)


def _with_degenerate(rows: Array) -> Array:
    """Inputs, and the same with elements set to zero or of the other sign: problems that solvers refuse."""
    chance = np.random.default_rng(len(rows)).random(rows.shape)
    return np.concatenate([rows, np.where(chance < 0.4, 0.0, np.where(chance < 0.5, -rows, rows))])


class Bench:
    """The two unchanged programs, kernels and problems.c, and the objects that a mutant is linked with."""

    def __init__(self) -> None:
        job = Job(awiwi_gen.Hand.load())
        self.generated = cached_tree(job)
        manifest = json.loads((self.generated / "manifest.json").read_text(encoding="utf-8"))
        solvers = [entry for entry in manifest["kernels"] if entry["route"] == "solver"]
        inputs = {name: _with_degenerate(rows) for name, rows in golden_inputs(job, manifest, ROWS).items()}
        self.driver = ROOT / "build" / "targets" / "mutants"
        write_driver(self.driver, {**manifest, "kernels": solvers}, {e["name"]: inputs[e["name"]] for e in solvers})
        self.includes = (self.generated, CSRC, self.driver)
        needed = [*sorted(self.generated.glob("*.c")), HERE / "run.c", self.driver / "table.c"]
        self.sources = sorted(CSRC.glob("*.c"))
        self.kernels = compile_all(needed, self.includes, HOST)
        self.problems = compile_all([HERE / "problems.c"], self.includes, HOST)
        self.objects = dict(zip(self.sources, compile_all(self.sources, self.includes, HOST), strict=True))
        self.expected = self.run(self.sources[0], self.objects[self.sources[0]])

    def run(self, path: Path, changed: Path) -> str | None:
        """What both programs print with another object for one file; None where one crashes or does not end."""
        others = [made for source, made in self.objects.items() if source != path]
        program, printed = changed.with_suffix(".elf"), ""
        for main in (self.problems, self.kernels):
            run_tool("gcc", SANITIZERS, *main, *others, changed, "-lm", "-o", program)
            try:
                done = subprocess.run([program], capture_output=True, text=True, check=True, timeout=LONGEST)
            except subprocess.SubprocessError:
                return None
            printed += done.stdout
        return printed

    def survives(self, mutant: Mutant) -> bool:
        """Whether a mutant compiles and prints the same."""
        with tempfile.TemporaryDirectory() as scratch:
            source, made = Path(scratch) / mutant.path.name, Path(scratch) / "mutant.o"
            source.write_text(mutant.text, encoding="utf-8")
            options = ("-O1", SANITIZERS, "-fno-sanitize-recover=all")
            command = ["gcc", *STRICT, *options, *(f"-I{folder}" for folder in self.includes), "-c", source, "-o", made]
            if subprocess.run(command, capture_output=True, check=False).returncode:
                return False
            return self.run(mutant.path, made) == self.expected


def read_survivors() -> set[tuple[str, ...]]:
    """Mutants that are known to change no result; each line ends with the reason."""
    if not SURVIVORS.exists():
        return set()
    lines = [line.split("\t") for line in SURVIVORS.read_text(encoding="utf-8").splitlines()]
    return {tuple(cells[:3]) for cells in lines if len(cells) == 4 and cells[3] and not cells[0].startswith("#")}


def main() -> int:
    """Try mutants; 0 if all that survive are known."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=0, help="how many mutants; all of them if left out")
    parser.add_argument("--only", default="*.c", help="pattern of file names")
    chosen = parser.parse_args()
    bench = Bench()
    every = [mutant for path in mutated_files(chosen.only) for mutant in mutants(path)]
    if chosen.count:
        every = random.Random(chosen.count).sample(every, min(chosen.count, len(every)))  # noqa: S311 no secret
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        survived = [m for m, alive in zip(every, pool.map(bench.survives, every), strict=True) if alive]
    new = [mutant for mutant in survived if mutant.key not in read_survivors()]
    print(f"{len(every)} mutants, {len(survived)} survive, {len(new)} of them without a reason in survivors.tsv")
    for mutant in new:
        print(f"{mutant.path.name}:{mutant.line}\t{mutant.key[1]}\t{mutant.key[2]}", file=sys.stderr)
    return bool(new)


if __name__ == "__main__":
    sys.exit(main())
