"""From a line of a generated C file back to its equation, and to the numbers of the hand file that decide it.

A number decides a line if the line is printed differently where the number is a little larger: the generator is asked,
not the text, so that constants which are made of several numbers lead back to all of them.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

from awiwi_gen.emit.c import Printer, identifier
from awiwi_gen.emit.options import Options
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.hand import Hand
from awiwi_gen.ir.graph import Graph, prune
from awiwi_gen.ir.passes.lift import DERIVED
from awiwi_gen.kernel import Kernel
from awiwi_gen.pipeline import Job
from awiwi_gen.records import Record, load_graphs, prepare, values_of

CHANGE = Fraction(1, 1009)  # by which a number is made larger; a prime, for other numbers are round
LITERAL = re.compile(r"(?<![\w.])\d[\d.]*(?:e[+-]?\d+)?f?")
LOCAL = re.compile(r"\b[ast]\d+\b")


@dataclass(frozen=True)
class Place:
    """A line of a generated file, counted from one."""

    file: Path
    line: int

    @classmethod
    def parse(cls, text: str, file: str = "") -> Place:
        """``FILE:N``, or ``N`` where the file is named apart. Raises InputError for anything else."""
        before, _, number = text.rpartition(":")
        name = before or file
        if not name or not number.isdecimal() or not int(number):
            raise InputError(f"--line {text}: expected FILE:N such as generated/index_gravity.c:20")
        return cls(Path(name), int(number))

    def read(self) -> str:
        """The text of the line. Raises InputError if there is none."""
        try:
            lines = self.file.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError):
            raise InputError(f"{self.file}: cannot be read; expected a generated C file") from None
        if self.line > len(lines):
            raise InputError(f"{self.file}:{self.line}: the file has {len(lines)} lines; name one of them")
        return lines[self.line - 1]

    def options(self) -> Options:
        """The options that its directory was generated with. Raises InputError where nothing was generated."""
        manifest = read_manifest(self.file.parent)
        if manifest is None:
            raise InputError(
                f"{self.file}: is not in a generated directory; expected FILE:N of one, see awiwi-gen generate"
            )
        chosen = manifest["inputs"]["options"]
        return Options(**{name: chosen[name] for name in ("scalar", "params", "math")})


def provenance(hand: Hand, place: Place) -> dict[str, Any]:
    """A line's kernel, equation, statement, and the numbers that decide it, itself and by the lines that it reads.

    Raises InputError where the file is not what this hand generates.
    """
    line, name = place.read(), place.file.stem
    job = Job(hand, place.options(), name)
    known = {kernel.name: kernel for kernel in job.catalog}
    if name not in known:
        raise InputError(f"{place.file}: {unknown('kernel', name, known)}")
    record = job.records[name]
    if place.file.read_text(encoding="utf-8") != record.file:
        raise InputError(
            f"{place.file}: is not what this hand generates; name its hand with --hand, or generate it again"
        )
    kernel = known[name]
    found = {"kernel": name, "doc": kernel.doc, "source": kernel.source, "part": kernel.path, "text": line.strip()}
    statements = record.function.statements
    first = record.file.splitlines().index(f"    {statements[0]}") + 1
    index = place.line - first
    if record.graph is None or not 0 <= index < len(statements):
        return found | {
            "numbers": {},
            "through": {},
            "solver": [*kernel.needs.values()] if record.graph is None else [],
        }
    sought = Sought(kernel, record, job, statements)
    read = sought.read_by(index)
    decided = {path: lines for path, lines in sought.deciders({index, *read}).items() if lines}
    quantities = kernel.part.quantities()
    own = {path: str(quantities[path]) for path, lines in decided.items() if index in lines}
    through = {path: str(quantities[path]) for path in decided if path not in own}
    return found | {"numbers": own, "through": through, "solver": []}


@dataclass(frozen=True)
class Sought:
    """The statements of a kernel, and what makes them other."""

    kernel: Kernel
    record: Record
    job: Job
    statements: Sequence[str]

    def read_by(self, index: int) -> set[int]:
        """The statements whose variables a statement reads, directly or not."""
        made: dict[str, list[int]] = {}
        for number, text in enumerate(self.statements):
            for name in LOCAL.findall(text.partition("=")[0]):
                made.setdefault(name, []).append(number)
        found: set[int] = set()
        waiting = [index]
        while waiting:
            for name in LOCAL.findall(self.statements[waiting.pop()]):
                new = set(made.get(name, ())) - found - {index}
                found |= new
                waiting += new
        return found

    def deciders(self, lines: Collection[int]) -> dict[str, set[int]]:
        """The numbers that decide some of these statements, and which ones."""
        if self.job.options.params == "runtime":
            return {path: self._naming(path) & set(lines) for path in self._values if self._values[path]}
        found: dict[str, set[int]] = {}
        waiting = [[path for path in self._graph.params if self._values[path]]]  # a zero leaves no trace in the C
        while waiting:
            group = waiting.pop()
            changed = self._changed(group) & set(lines) if group else set()
            if changed and len(group) > 1:
                waiting += [group[len(group) // 2 :], group[: len(group) // 2]]
            elif changed:
                found[group[0]] = changed
        return dict(sorted(found.items()))

    @cached_property
    def _values(self) -> Mapping[str, Fraction]:
        return values_of(self.kernel)

    @cached_property
    def _graph(self) -> Graph:
        return load_graphs(self.kernel, self.job.store, self.record.route)[self.record.route]

    def _changed(self, paths: Sequence[str]) -> set[int]:
        """The statements that are others where these numbers are larger, each by another part of itself."""
        larger = {path: self._values[path] * (1 + CHANGE / (2 + at)) for at, path in enumerate(paths)}
        final = prepare({self.record.route: self._graph}, {**self._values, **larger}, self.job.options).stages[-1][1]
        inputs = {name: port.shape for name, port in self.kernel.inputs.items()}
        after = Printer(final, self.job.options, self.kernel.path, inputs).statements()
        before = [each for each in self.statements if not each.startswith("(void)")]
        skipped = len(self.statements) - len(before)
        old, new = ([LITERAL.sub("#", text) for text in texts] for texts in (before, after))
        same: set[int] = set()
        for block in difflib.SequenceMatcher(None, old, new, autojunk=False).get_matching_blocks():
            same |= {block.a + k for k in range(block.size) if before[block.a + k] == after[block.b + k]}
        return {skipped + number for number in range(len(before)) if number not in same}

    def _naming(self, path: str) -> set[int]:
        """The statements that read a number, or one derived from it, from the struct."""
        field = identifier(f"{self.kernel.path}.{path}")
        fields = [rf"numbers\.{field}"] + [
            identifier(f"{self.kernel.path}.{name}") for name in self._derived_from(path)
        ]
        pattern = re.compile(rf"params->(?:{'|'.join(fields)})\b")
        return {number for number, text in enumerate(self.statements) if pattern.search(text)}

    def _derived_from(self, path: str) -> list[str]:
        derivation = self.record.derivation
        if derivation is None:
            return []
        alone = ((output.name, prune(Graph(derivation.nodes, (output,)))) for output in derivation.outputs)
        return [name for name, graph in alone if path in graph.params and name.startswith(DERIVED)]


def provenance_lines(found: Mapping[str, Any], place: Place, file: Any) -> list[str]:
    """The same as text; ``file`` is the hand file, which has the line of each number."""
    from awiwi_gen.editing import keys_of
    from awiwi_gen.explain import folded

    lines = [f"{place.file}:{place.line}", f"  {found['text']}", ""]
    lines += [f"  kernel     {found['kernel']}", *folded(found["doc"], " " * 13), f"  source     {found['source']}"]
    for title, numbers in (("decided by", found["numbers"]), ("decided, through what it reads, by", found["through"])):
        if numbers:
            lines += ["", f"  {title}"]
        for path, value in numbers.items():
            whole = f"{found['part']}.{path}" if found["part"] else path
            at = file.line(keys_of(whole))
            lines.append(f"    {file.name}:{at} {whole} = {value}")
    if found["solver"]:
        lines += [
            "",
            *folded(f"a solver's line; its numbers are in the kernels it calls: {', '.join(found['solver'])}", "  "),
        ]
    elif not found["numbers"] and not found["through"]:
        lines += ["", "  no number of the hand file decides this line"]
    return lines
