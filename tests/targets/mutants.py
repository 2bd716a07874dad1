"""`make mutants`: change one operator or constant of csrc/ at a time, and see whether any result changes.

python -m tests.targets.mutants                every mutant
python -m tests.targets.mutants --count 60     a fixed random choice of them

A mutant is found where it does not compile, does not end, crashes, leaves an array, or changes a bit of a result: of
problems*.c, which call every function of csrc/, or of a kernel that iterates, on its golden inputs. One that survives
must have a line in survivors.tsv that says why it changes no result.
Exit codes: 0 done, 1 a mutant survives without a reason, or, where all were tried, one with a reason does not.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import awiwi_gen
from awiwi_gen.emit.files import csrc_headers
from awiwi_gen.pipeline import Job, cached_tree

from .driver import golden_inputs, write_driver
from .programs import CSRC, TargetError, compile_all, run_tool
from .toolchains import HERE, ROOT, Target

Array = np.ndarray[Any, Any]
HOST = Target("x86-64 gcc -O1", "gcc", ("-O1",))
SANITIZERS = "-fsanitize=address,undefined,float-cast-overflow"  # a mutant that leaves an array is found
UNWRITTEN = "-ftrivial-auto-var-init="  # what is read but was never written differs between the builds
BUILDS = (  # most mutants do not survive the first, which costs little
    Target("plain", "gcc", ("-O0", f"{UNWRITTEN}zero")),
    Target("sanitized", "gcc", ("-O0", f"{UNWRITTEN}pattern", SANITIZERS, "-fno-sanitize-recover=all")),
)
SURVIVORS = HERE / "survivors.tsv"
HEADERS = (
    "dense.h",
    "tendon_cost.h",
    "tendon_descent.h",
    "twofold.h",
)  # with code; others are in kernels, which are proved
ROWS = 160  # inputs of every kernel: more branches are taken than by the few that targets run
LONGEST = {"plain": 1, "sanitized": 5}  # seconds of the processor; the unchanged programs take a fifth of it
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


def mutated_files(pattern: str = "*") -> list[Path]:
    """The files of csrc that are changed: C files but the simulator, which is no firmware, and headers with code."""
    files = [*sorted(CSRC.glob("*.c")), *(CSRC / name for name in HEADERS)]
    return [path for path in files if path.match(pattern) and path.name != "simulate.c"]


def compiled_with(path: Path) -> list[Path]:
    """The C files that a file of csrc is compiled in: itself, or those that include it, directly or not."""
    if path.suffix == ".c":
        return [path]
    users = [user for user in CSRC.iterdir() if f'#include "{path.name}"' in user.read_text(encoding="utf-8")]
    return sorted({source for user in users for source in compiled_with(user)})


def mutants(path: Path) -> Iterator[Mutant]:
    """All changes of one operator or one whole number in a file."""
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
    """The two programs, kernels and problems*.c, and what they print with csrc/ unchanged."""

    def __init__(self) -> None:
        job = Job(awiwi_gen.Hand.load())
        generated = cached_tree(job)
        manifest = json.loads((generated / "manifest.json").read_text(encoding="utf-8"))
        solvers = [entry for entry in manifest["kernels"] if entry["route"] == "solver"]
        inputs = {name: _with_degenerate(rows) for name, rows in golden_inputs(job, manifest, ROWS).items()}
        driver = ROOT / "build" / "targets" / "mutants"
        write_driver(driver, {**manifest, "kernels": solvers}, {e["name"]: inputs[e["name"]] for e in solvers})
        roomy = driver / "include"  # problems are larger than any finger of the hand
        roomy.mkdir(parents=True, exist_ok=True)
        for name, text in csrc_headers(job.options).items():
            (roomy / name).write_text(text, encoding="utf-8")
        self.includes = (roomy, generated, CSRC, driver)
        kernels = [*sorted(generated.glob("*.c")), HERE / "run.c", driver / "table.c"]
        problems = sorted(HERE.glob("problems*.c"))
        self.programs = [compile_all(files, self.includes, HOST) for files in (problems, kernels)]
        sources = sorted(CSRC.glob("*.c"))
        made = {build: compile_all(sources, self.includes, build) for build in BUILDS}
        self.objects = {build: dict(zip(sources, objects, strict=True)) for build, objects in made.items()}
        with tempfile.TemporaryDirectory() as scratch:
            printed = [[self._run(build, main, {}, Path(scratch)) for main in self.programs] for build in BUILDS]
        self.expected = printed[0]
        if None in self.expected or any(texts != self.expected for texts in printed):
            raise TargetError("csrc/ crashes, leaves an array or reads what it never wrote, without any change")

    def _run(self, build: Target, main: Sequence[Path], changed: Mapping[Path, Path], scratch: Path) -> str | None:
        """What a program prints with other objects for some files; None where it crashes or does not end."""
        program = scratch / "program"
        run_tool("gcc", *build.flags, *main, *{**self.objects[build], **changed}.values(), "-lm", "-o", program)
        command = ["prlimit", f"--cpu={LONGEST[build.name]}", "--core=0", program]
        try:
            return subprocess.run(command, capture_output=True, text=True, check=True).stdout
        except subprocess.CalledProcessError:
            return None

    def survives(self, mutant: Mutant) -> bool:
        """Whether a mutant compiles and prints the same, in all builds."""
        with tempfile.TemporaryDirectory() as folder:
            scratch = Path(folder)
            shutil.copytree(CSRC, scratch, dirs_exist_ok=True)
            (scratch / mutant.path.name).write_text(mutant.text, encoding="utf-8")
            for build in BUILDS:
                changed = {source: scratch / f"{source.stem}.o" for source in compiled_with(mutant.path)}
                for source, made in changed.items():
                    options = (*build.language, *build.flags, f"-I{self.includes[0]}")
                    if subprocess.run(
                        ["gcc", *options, "-c", scratch / source.name, "-o", made], capture_output=True, check=False
                    ).returncode:
                        return False
                for main, expected in zip(self.programs, self.expected, strict=True):
                    if self._run(build, main, changed, scratch) != expected:
                        return False
        return True


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
    parser.add_argument("--only", default="*", help="pattern of file names")
    chosen = parser.parse_args()
    bench = Bench()
    every = [mutant for path in mutated_files(chosen.only) for mutant in mutants(path)]
    if chosen.count:
        every = random.Random(chosen.count).sample(every, min(chosen.count, len(every)))  # noqa: S311 no secret
    known = {key for key in read_survivors() if (CSRC / key[0]) in mutated_files(chosen.only)}
    alive, faults = [], []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for mutant, survives in zip(every, pool.map(bench.survives, every), strict=True):
            if survives:
                alive.append(mutant.key)
            if survives and mutant.key not in known:
                faults.append(mutant.key)
                print(
                    f"{mutant.path.name}:{mutant.line}\t{mutant.key[1]}\t{mutant.key[2]}", file=sys.stderr, flush=True
                )
    print(f"{len(every)} mutants, {len(alive)} survive, {len(faults)} of them without a reason in survivors.tsv")
    for key in sorted(known.difference(alive)) if not chosen.count else ():
        faults.append(key)
        print("survivors.tsv: no longer survives:", *key, sep="\t", file=sys.stderr)
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
