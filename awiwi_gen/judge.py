"""Verdicts on compiled kernels (levels 1 and 3) and on the physics of a part (level 5 of docs/verification.md)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from awiwi_gen.cache import key
from awiwi_gen.compiler import machine
from awiwi_gen.emit.c import identifier
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.algebras import Floats
from awiwi_gen.ir.graph import Graph
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.parameters import of_part
from awiwi_gen.records import Record, problem_of, solver_of, values_of
from awiwi_gen.sources import code_of
from awiwi_gen.units import Quantity
from awiwi_gen.verify.derived import judge_derived
from awiwi_gen.verify.motion import Motion
from awiwi_gen.verify.physics import Law, Scope, obey, scopes
from awiwi_gen.verify.samples import SEED, draw, varied
from awiwi_gen.verify.verdict import Verdict, derived_values, judge, judge_solver

if TYPE_CHECKING:
    from awiwi_gen.library import Library


def verdict_key(record: Record, objects: Iterable[str], numbers: str) -> str:
    """Key of a verdict: the record, the objects that run, the numbers they read, the code that calls and judges them.

    ``objects`` are the keys of those objects, ``numbers`` is the digest of the derived numbers of the kernel's part.
    """
    return key(record.digest, *objects, numbers, code_of(__name__, "awiwi_gen.build"), machine())


class Loaded:
    """A compiled directory, and the numbers that its kernels read at run time: those of the hand file, and others."""

    def __init__(self, library: Library, quantities: Mapping[str, Quantity], derivations: Mapping[str, Graph]) -> None:
        self.library, self.derivations = library, derivations
        self.values = {path: quantity.value for path, quantity in quantities.items()}
        self.others = varied(self.values)

    @cached_property
    def with_others(self) -> Library:
        """The kernels with other numbers."""
        paths = [entry["path"] for entry in self.library.manifest["params"]["numbers"]]
        return self.library.with_numbers(float(self.others[path]) for path in paths)


def judge_record(
    kernel: Kernel, record: Record, used: Mapping[str, Record], loaded: Loaded, options: Options
) -> Verdict:
    """Levels 1 and 3 for one compiled kernel, with levels 2 and 4 from its record."""
    function, own = loaded.library[kernel.name], options.math == "own"
    if record.graph is None:
        problem, tolerance = problem_of(kernel, used), solver_of(kernel).tolerance[options.scalar]
        as_computed = problem_of(kernel, used, _rounded(loaded, options))
        mirror = as_computed.mirror(record.inputs, own)
        observed = partial(problem.observed, record.inputs)
        other = partial(problem.other_reference, record.inputs)
        units = {name: port.units for name, port in kernel.outputs.items()}
        run = partial(problem.run, function)
        return judge_solver(
            kernel.name, record.reference, mirror, observed, other, record.inputs, run, tolerance, SEED, units
        )
    inputs = draw(kernel.inputs, kernel.path, options.dtype)
    examine = partial(
        judge,
        kernel.name,
        record.graph,
        shapes={name: port.shape for name, port in kernel.inputs.items()},
        agreement=record.agreement,
        passes=record.passes,
        seed=SEED,
        dtype=options.dtype,
        own=own,
        derivation=loaded.derivations.get(kernel.path),
    )
    verdict = examine(record.reference, inputs, of_part(kernel.path, loaded.values), function)
    if record.varied is None:
        return verdict
    there = {port: column[list(record.varied.rows)] for port, column in inputs.items()}
    numbers = of_part(kernel.path, loaded.others)
    others = examine(record.varied.reference, there, numbers, loaded.with_others[kernel.name])
    return verdict.joined(others, "with other numbers")


def _rounded(loaded: Loaded, options: Options) -> dict[str, Fraction]:
    """Derived numbers as the C has them, by path."""
    floats, found = Floats(options.dtype, options.math == "own"), dict[str, Any]()
    for part, graph in loaded.derivations.items():
        found |= derived_values(graph, of_part(part, loaded.values), floats)
    return {path: Fraction(float(value)) for path, value in found.items()}


def _field(library: Library, part: str, path: str) -> Any:
    """A derived number that the C has computed."""
    return getattr(library.params, identifier(f"{part}.{path}"))


def judge_derivation(loaded: Loaded, options: Options) -> Verdict:
    """Levels 1 and 3 for the derived numbers."""
    cases = []
    for library, values in ((loaded.library, loaded.values), (loaded.with_others, loaded.others)):
        for part, graph in loaded.derivations.items():
            cases.append((graph, of_part(part, values), partial(_field, library, part)))
    return judge_derived("params_derive", cases, options.dtype, options.math == "own")


@dataclass(frozen=True)
class PartLaws:
    """Level 5 for the kernels of one part; ``ports`` are all inputs that kernels of this part take, asked for or not."""

    members: Sequence[tuple[Kernel, Record]]
    ports: Mapping[str, Port]
    options: Options

    @cached_property
    def scopes(self) -> dict[str, Scope]:
        """What each law reads, by its name."""
        inputs = {kernel.family: tuple(kernel.inputs) for kernel, record in self.members if record.graph is not None}
        return scopes(inputs, self._numbers)

    @cached_property
    def keys(self) -> dict[str, str]:
        """Key of each law, by its name: all that its scope has, and the code that checks it."""
        digests = {kernel.family: record.digest for kernel, record in self.members}
        code = code_of(__name__)
        found = {}
        for name, scope in self.scopes.items():
            records = [digests[family] for family in scope.families]
            inputs = [(port, self.ports[port]) for port in scope.inputs if port in self.ports]
            numbers = sorted(self._numbers.items()) if scope.numbers else ()
            found[name] = key(name, self._path, records, inputs, numbers, code)
        return found

    def check(self, names: Collection[str]) -> dict[str, Law]:
        """The results of these laws, by name."""
        graphs = {kernel.family: record.graph for kernel, record in self.members if record.graph is not None}
        derived = {path: value for _, record in self.members for path, value in record.values.items()}
        motion = Motion(graphs, draw(self.ports, self._path, self.options.dtype), {**self._numbers, **derived})
        chosen = {name: self.scopes[name] for name in names}
        return obey(self._path or "hand", chosen, motion, self._numbers)

    @property
    def _path(self) -> str:
        return self.members[0][0].path

    @property
    def _numbers(self) -> Mapping[str, Fraction]:
        return values_of(self.members[0][0])
