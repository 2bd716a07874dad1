"""From the derivations of a kernel to its C text: bind numbers, compare routes, optimise, print; pure functions.

The result, a `Record`, is cached by the digest of everything that it depends on. So a changed number only affects the
kernels that use it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from typing import Any

from awiwi_gen.cache import Cache, code_digest, key, libraries
from awiwi_gen.emit.c import CFunction, c_function
from awiwi_gen.emit.files import cost_line, describe, kernel_file
from awiwi_gen.emit.options import Options
from awiwi_gen.emit.solver import solver_function
from awiwi_gen.errors import VerificationError
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.exact import exact_values
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.passes import Memo, optimise
from awiwi_gen.ir.passes.bind import bind, fill
from awiwi_gen.ir.passes.lift import lift, settle
from awiwi_gen.kernel import Kernel, Solver
from awiwi_gen.sources import code_of
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.problems import PROBLEMS
from awiwi_gen.verify.reference import (
    BallArrays,
    Reference,
    ball_values,
    ball_values_together,
    disagreement,
    domain,
    reference,
    term_size,
)
from awiwi_gen.verify.samples import draw, varied

ROUTES_AGREE = 1e-40  # level 4 of docs/verification.md
PASSES_AGREE = 1e-50  # level 2
HOPELESS = 1.3  # passes rarely recover a larger ratio of costs


@dataclass(frozen=True)
class Record:
    """A kernel before it is compiled; ``digest`` is that of everything it was made from.

    ``values`` are the numbers of the hand that its graph reads at run time. ``costs`` has, after each pass, the number
    of operations and their weight. ``inputs`` are the samples of its reference if a problem chose them.

    Where numbers are read at run time, ``derivation`` is the graph of the derived ones, ``zeros`` are paths of numbers
    that stay constants because they are zero, and ``varied`` is a second reference, with other numbers.
    """

    digest: str
    graph: Graph | None
    function: CFunction
    file: str
    route: str
    agreement: float
    passes: float
    reference: Reference
    values: Mapping[str, Fraction] = field(default_factory=dict)
    costs: tuple[tuple[str, int, int], ...] = ()
    inputs: Mapping[str, Any] = field(default_factory=dict)
    derivation: Graph | None = None
    zeros: tuple[str, ...] = ()
    varied: Varied | None = None


@dataclass(frozen=True)
class Varied:
    """The reference of a kernel with other numbers, at those samples (``rows``) that are in its domain then."""

    rows: tuple[int, ...]
    reference: Reference


def derivation_key(kernel: Kernel, route: str) -> str:
    """Key of a derivation: the structure of the part, the ports and the code of the route, but no number."""
    derived = kernel.routes[route]
    code = code_of("awiwi_gen.derive", *derived.modules, type(kernel.part).__module__)
    ports = [(name, port.shape, port.unit) for side in (kernel.inputs, kernel.outputs) for name, port in side.items()]
    return key(kernel.structure, derived.module, derived.function, ports, kernel.guards, code, libraries())


@dataclass(frozen=True)
class Fingerprint:
    """The part of a graph that the key of a record needs; the graph is read only if the record is missing."""

    digest: str
    params: tuple[str, ...]
    size: int


def fingerprints(kernel: Kernel, cache: Cache) -> dict[str, Fingerprint]:
    """Fingerprints of a kernel's derivations, by route."""

    def fingerprint(route: str) -> Fingerprint:
        graph = load_graphs(kernel, cache, route)[route]
        return Fingerprint(graph.digest, graph.params, len(graph.nodes))

    keys = {route: derivation_key(kernel, route) for route in kernel.routes}
    return {route: cache.memo("fingerprints", digest, partial(fingerprint, route)) for route, digest in keys.items()}


def record_key(kernel: Kernel, graphs: Mapping[str, Fingerprint], prefix: str, options: Options) -> str:
    """Key of a record: the derivations, the numbers in them, the ports, the options and the generator's code."""
    values = values_of(kernel)
    used = {path: str(values[path]) for graph in graphs.values() for path in graph.params}
    code = code_of(__name__) + code_digest("templates")
    digests = {route: graph.digest for route, graph in graphs.items()}
    ports = (dict(kernel.inputs), dict(kernel.outputs), kernel.doc, kernel.source, kernel.solver)
    return key(kernel.name, digests, json.dumps(used, sort_keys=True), ports, prefix, options, code, libraries())


def solver_key(kernel: Kernel, used: Mapping[str, str], prefix: str, options: Options) -> str:
    """Key of the record of a kernel with a solver: its own, and those of the records that it uses."""
    return key(record_key(kernel, {}, prefix, options), *used.values())


def load_graphs(kernel: Kernel, cache: Cache, *routes: str) -> dict[str, Graph]:
    """The derivations of a kernel by the given routes, or by all, from the cache. Raises VerificationError if missing."""
    found: dict[str, Graph] = {}
    for route in routes or kernel.routes:
        graph = cache.get("derived", derivation_key(kernel, route))
        if not isinstance(graph, Graph):
            raise VerificationError(f"{kernel.name}: its derivation by {route} is missing from the cache")
        found[route] = graph
    return found


def cheapest(bound: Mapping[str, Graph]) -> tuple[str, list[tuple[str, Graph]]]:
    """The route with the cheapest C, and its stages; a route that is far more expensive at first is not optimised."""
    raw = {route: cost(graph).weight for route, graph in bound.items()}
    promising = [route for route, weight in raw.items() if weight <= HOPELESS * min(raw.values())]
    memo = Memo()  # routes often meet after a few passes
    stages = {route: optimise(bound[route], memo) for route in promising}
    best = min(stages, key=lambda route: cost(stages[route][-1][1]).weight)
    return best, stages[best]


@dataclass(frozen=True)
class Prepared:
    """Graphs with their numbers bound, the cheapest of them optimised, and the graph of derived numbers, if any."""

    bound: Mapping[str, Graph]
    route: str
    stages: Sequence[tuple[str, Graph]]
    derivation: Graph | None = None


def prepare(graphs: Mapping[str, Graph], values: Mapping[str, Fraction], options: Options) -> Prepared:
    """Bind all numbers, or only those that are zero where the others are read at run time, and optimise."""
    if options.params == "baked" or not any(graph.params for graph in graphs.values()):
        bound = {route: bind(graph, values) for route, graph in graphs.items()}
        return Prepared(bound, *cheapest(bound))
    zeros = {path: value for path, value in values.items() if value == 0}
    bound = {route: bind(graph, zeros) for route, graph in graphs.items()}
    lifted = {route: lift(graph, values) for route, graph in bound.items()}
    route, stages = cheapest({route: graph for route, (graph, _) in lifted.items()})
    final, derivation = settle(stages[-1][1], lifted[route][1])
    return Prepared(bound, route, [*stages[:-1], (stages[-1][0], final)], derivation)


@dataclass(frozen=True)
class Candidate(Prepared):
    """A kernel with its graphs prepared, before they are compared; ``values`` are its numbers, derived ones included."""

    kernel: Kernel = field(kw_only=True)
    digest: str = field(kw_only=True)
    inputs: Mapping[str, Any] = field(kw_only=True)

    @property
    def final(self) -> Graph:
        """The graph that is emitted."""
        return self.stages[-1][1]


def make_records(
    tasks: Sequence[tuple[Kernel, Mapping[str, Graph], str]], prefix: str, options: Options
) -> list[Record]:
    """Bind, compare the routes, optimise the cheaper one and print it, for (kernel, graphs, digest) of one part.

    Raises VerificationError where two routes, or the graphs before and after a pass, differ.
    """
    values = values_of(tasks[0][0])
    known: dict[tuple[str, ...], Prepared] = {}
    candidates = []
    for kernel, graphs, digest in tasks:
        digests = tuple(graph.digest for graph in graphs.values())
        if digests not in known:
            known[digests] = prepare(graphs, values, options)
        inputs = draw(kernel.inputs, kernel.path, options.dtype)
        candidates.append(Candidate(**vars(known[digests]), kernel=kernel, digest=digest, inputs=inputs))
    derivations = [c.derivation for c in candidates if c.derivation is not None]
    values = with_derived(values, derivations)
    cases = [(graph, c.inputs) for c in candidates for graph in (*c.bound.values(), c.final)]
    found = iter(ball_values_together(cases, values))
    made = []
    for (_, graphs, _), candidate in zip(tasks, candidates, strict=True):
        exact = {route: next(found) for route in candidate.bound}
        made.append(_record(candidate, graphs, exact, next(found), values, prefix, options))
    if not derivations:
        return made
    first = tasks[0][0]
    others = with_derived(varied(values_of(first), first.path), derivations)
    found = iter(ball_values_together(cases, others))
    for position, candidate in enumerate(candidates):
        exact_there = [next(found) for _ in (*candidate.bound, "final")]
        if candidate.derivation is not None:
            made[position] = replace(made[position], varied=_varied(candidate, exact_there))
    return made


def with_derived(values: Mapping[str, Fraction], derivations: Iterable[Graph]) -> Mapping[str, Fraction]:
    """The numbers of a part, and those derived from them, to 400 bits."""
    return {**values, **{k: v for graph in derivations for k, v in exact_values(graph, values).items()}}


def _varied(candidate: Candidate, exact: Sequence[BallArrays]) -> Varied:
    """The reference with other numbers. Raises VerificationError where the routes or the emitted graph differ."""
    definition = exact[0]
    rows = domain(definition)
    if 2 * len(rows) < len(next(iter(candidate.inputs.values()))):
        raise VerificationError(f"{candidate.kernel.name}: a thousandth more or less leaves its domain at most samples")
    there = [{name: [[column[i] for i in rows] for column in each] for name, each in one.items()} for one in exact]
    worst = max(disagreement(there[0], other, lambda _: 1.0) for other in there[1:])
    if not worst <= ROUTES_AGREE:
        raise VerificationError(f"{candidate.kernel.name}: with other numbers its graphs differ by {worst:.1e}")
    return Varied(tuple(rows), reference(there[0]))


def _record(
    candidate: Candidate,
    graphs: Mapping[str, Graph],
    exact: Mapping[str, BallArrays],
    optimised: BallArrays,
    values: Mapping[str, Fraction],
    prefix: str,
    options: Options,
) -> Record:
    """Compare the routes and the passes, then print the C."""
    kernel, route, final = candidate.kernel, candidate.route, candidate.final
    definition = next(iter(exact.values()))
    graphs_compared = (*candidate.bound.values(), final)

    def size_of_terms(output: str) -> float:
        return max(term_size(graph, candidate.inputs, values, output) for graph in graphs_compared)

    agreement = max(disagreement(definition, other, size_of_terms) for other in exact.values())
    if not agreement <= ROUTES_AGREE:
        raise VerificationError(f"{kernel.name}: its derivations {', '.join(exact)} differ by {agreement:.1e}")
    passes = disagreement(exact[route], optimised, size_of_terms)
    if not passes <= PASSES_AGREE:
        raise VerificationError(f"{kernel.name}: {culprit(exact[route], candidate.stages, candidate.inputs, values)}")
    function = c_function(
        kernel.name,
        prefix,
        final,
        {name: port.shape for name, port in kernel.inputs.items()},
        describe(kernel, cost_line(cost(final).as_dict())),
        options,
        part=kernel.path,
    )
    used = {f"{kernel.path}.{path}": str(values[path]) for graph in graphs.values() for path in graph.params}
    text = kernel_file(function, key(json.dumps(used, sort_keys=True)))
    left = {path: values[path] for path in final.params}
    steps = [(step, cost(graph)) for step, graph in [("derivation", candidate.bound[route]), *candidate.stages]]
    costs = tuple((step, spent.operations, round(spent.weight)) for step, spent in steps)
    zeros = tuple(sorted({path for graph in graphs.values() for path in graph.params if values[path] == 0}))
    return Record(
        candidate.digest, final, function, text, route, agreement, passes, reference(definition), left, costs,
        derivation=candidate.derivation, zeros=zeros if options.params == "runtime" else (),
    )  # fmt: skip


def culprit(
    before: BallArrays, stages: Sequence[tuple[str, Graph]], inputs: Mapping[str, Any], values: Mapping[str, Fraction]
) -> str:
    """The first pass that changes the value, where the final graph is known to differ."""
    for name, graph in stages:
        after = ball_values(graph, inputs, values)
        change = disagreement(before, after, partial(term_size, graph, inputs, values))
        if not change <= PASSES_AGREE:
            return f"pass {name} changes its value by {change:.1e}"
        before = after
    return "the passes together change its value"


def make_solver_record(
    kernel: Kernel, used: Mapping[str, Record], digest: str, prefix: str, options: Options
) -> Record:
    """Bind a solver to the kernels it uses, and find the exact solutions of its samples."""
    solver = solver_of(kernel)
    runtime = any(record.graph is not None and record.graph.params for record in used.values())
    runtime |= options.params == "runtime" and bool(solver.limits)
    functions = {family: record.function for family, record in used.items()}
    graphs = {family: record.graph for family, record in used.items() if record.graph is not None}
    function, text = solver_function(kernel, solver, prefix, options, functions, graphs, runtime)
    problem = problem_of(kernel, used)
    inputs = problem.sample(draw(kernel.inputs, kernel.path, options.dtype))
    costs = (("solver", function.cost.operations, round(function.cost.weight)),)
    return Record(digest, None, function, text, "solver", 0.0, 0.0, problem.solve(inputs), costs=costs, inputs=inputs)


def problem_of(kernel: Kernel, used: Mapping[str, Record], rounded: Mapping[str, Fraction] | None = None) -> Problem:
    """The problem of a kernel with a solver. Kernels that it calls may be of other parts, so their numbers are bound.

    ``rounded`` are derived numbers as the C has computed them, by path, in place of the exact ones.
    """
    solver, own = solver_of(kernel), rounded or {}
    graphs = {
        family: fill(record.graph, {path: own.get(path, value) for path, value in record.values.items()})
        for family, record in used.items()
        if record.graph is not None
    }
    return PROBLEMS[solver.problem](solver, graphs, values_of(kernel))


def solver_of(kernel: Kernel) -> Solver:
    """The solver of a kernel. Raises ValueError if it has none."""
    if kernel.solver is None:
        raise ValueError(f"{kernel.name} has no solver")
    return kernel.solver


def values_of(kernel: Kernel) -> Mapping[str, Fraction]:
    """Exact SI values of the numbers of a kernel's part, by path."""
    part = kernel.part
    if id(part) not in _VALUES:
        _VALUES[id(part)] = part, {path: quantity.value for path, quantity in part.quantities().items()}
    return _VALUES[id(part)][1]


_VALUES: dict[int, tuple[Any, dict[str, Fraction]]] = {}  # by id of the part, which is stored to keep that id valid


def manifest_entry(kernel: Kernel, record: Record) -> dict[str, Any]:
    """A kernel as plain data, for ``list --json`` and for loading a library."""

    def port(name: str, spec: Any, ranged: bool) -> dict[str, Any]:
        entry: dict[str, Any] = {"name": name, "shape": list(spec.shape), "unit": spec.unit_text}
        if ranged:
            bounds = spec.bounds()
            entry |= {"low": [low for low, _ in bounds], "high": [high for _, high in bounds]}
        return entry

    return {
        "name": kernel.name,
        "doc": kernel.doc,
        "source": kernel.source,
        "part": kernel.path,
        "route": record.route,
        "params": "_params *" in record.function.prototype,
        "status": record.function.prototype.startswith("int "),
        "inputs": [port(name, spec, True) for name, spec in kernel.inputs.items()],
        "outputs": [port(name, spec, False) for name, spec in kernel.outputs.items()],
        "cost": record.function.cost.as_dict(),
    }
