"""Verdicts on compiled kernels (levels 1 and 3) and on the physics of a part (level 5 of docs/verification.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from awiwi_gen.cache import code_digest, key
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
from awiwi_gen.verify.physics import Law, obey
from awiwi_gen.verify.samples import SEED, draw, varied
from awiwi_gen.verify.verdict import Verdict, derived_values, judge, judge_solver

if TYPE_CHECKING:
    from awiwi_gen.library import Library


def verdict_key(record: Record, compiled: str) -> str:
    """Key of a verdict: the record, the compiled text, the code that compiles and judges it."""
    return key(record.digest, compiled, code_of(__name__, "awiwi_gen.build"), code_digest("csrc"))


def laws_key(records: Sequence[Record]) -> str:
    """Key of the laws of physics of a part: its records, and the code of the laws."""
    return key(*(record.digest for record in records), code_of("awiwi_gen.verify.physics"))


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


def physics(members: Sequence[tuple[Kernel, Record]], ports: Mapping[str, Port], options: Options) -> list[Law]:
    """Level 5 for the kernels of one part."""
    first = members[0][0]
    graphs = {kernel.family: record.graph for kernel, record in members if record.graph is not None}
    values = {**values_of(first), **{path: v for _, record in members for path, v in record.values.items()}}
    return obey(first.path or "hand", graphs, draw(ports, first.path, options.dtype), values)
