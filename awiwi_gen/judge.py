"""Verdicts on compiled kernels (levels 1 and 3) and on the physics of a part (level 5 of docs/verification.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from awiwi_gen.cache import code_digest, key
from awiwi_gen.emit.options import Options
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.records import Record, problem_of, solver_of, values_of
from awiwi_gen.sources import code_of
from awiwi_gen.verify.physics import Law, obey
from awiwi_gen.verify.samples import SEED, draw
from awiwi_gen.verify.verdict import Verdict, judge, judge_solver


def verdict_key(record: Record, compiled: str) -> str:
    """Key of a verdict: the record, the compiled text, the code that compiles and judges it."""
    return key(record.digest, compiled, code_of(__name__, "awiwi_gen.build"), code_digest("csrc"))


def laws_key(records: Sequence[Record]) -> str:
    """Key of the laws of physics of a part: its records, and the code of the laws."""
    return key(*(record.digest for record in records), code_of("awiwi_gen.verify.physics"))


def judge_record(
    kernel: Kernel, record: Record, used: Mapping[str, Record], function: Callable[..., Any], options: Options
) -> Verdict:
    """Levels 1 and 3 for one compiled kernel, with levels 2 and 4 from its record."""
    if record.graph is None:
        problem, tolerance = problem_of(kernel, used), solver_of(kernel).tolerance[options.scalar]
        mirror = problem.mirror(record.inputs, options.math == "own")
        observed = partial(problem.observed, record.inputs)
        return judge_solver(kernel.name, record.reference, mirror, observed, record.inputs, function, tolerance, SEED)
    return judge(
        kernel.name,
        record.graph,
        record.reference,
        draw(kernel.inputs, kernel.path, options.dtype),
        values_of(kernel),
        function,
        {name: port.shape for name, port in kernel.inputs.items()},
        record.agreement,
        record.passes,
        SEED,
        options.dtype,
        options.math == "own",
    )


def physics(members: Sequence[tuple[Kernel, Record]], ports: Mapping[str, Port], options: Options) -> list[Law]:
    """Level 5 for the kernels of one part."""
    first = members[0][0]
    graphs = {kernel.family: record.graph for kernel, record in members if record.graph is not None}
    return obey(first.path or "hand", graphs, draw(ports, first.path, options.dtype), values_of(first))
