"""Compares one compiled kernel with its reference and states the verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from awiwi_gen.ir.algebras import UNIT_ROUNDOFF, Bounded, Floats
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.kernel import GUARDS
from awiwi_gen.units import Unit
from awiwi_gen.verify.reference import Reference

Array = np.ndarray[Any, Any]


NEAR_ZERO = 1e-3
REFERENCE = 2.0**-200  # relative error of a reference at 256 bits, after operations that may cancel 50 of them
STATUS = "status"  # output of a reference: the status that the kernel must return, if not always 0


@dataclass(frozen=True)
class Verdict:
    """The result of verification for one kernel; ``passed`` only if every level passed.

    ``bit_exact`` (level 1): the C equals the float interpreter in every bit. ``passes`` (level 2) and
    ``agreement`` (level 4): worst relative difference at 256 bits between the graphs before and after a
    pass, and between the routes. Level 3: ``worst_ulp`` in units in the last place, over the values that
    reach a thousandth of the output's largest (nearer to zero an ulp says nothing), ``worst_scaled_error``
    relative to the largest value of the output, ``bound_use`` the largest error relative to its rounding error
    bound; above 1 the C computes something else.
    """

    name: str
    passed: bool
    bit_exact: bool
    worst_ulp: float
    worst_scaled_error: float
    bound_use: float
    agreement: float
    passes: float
    samples: int
    seed: int
    reasons: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)

    def joined(self, other: Verdict, when: str) -> Verdict:
        """The worse of two examinations; ``when`` says what was different in the other one."""
        return replace(
            self,
            passed=self.passed and other.passed,
            bit_exact=self.bit_exact and other.bit_exact,
            worst_ulp=max(self.worst_ulp, other.worst_ulp),
            worst_scaled_error=max(self.worst_scaled_error, other.worst_scaled_error),
            bound_use=max(self.bound_use, other.bound_use),
            reasons=(*self.reasons, *(f"{when}, {reason}" for reason in other.reasons)),
        )

    def refused(self, reason: str) -> Verdict:
        """The same verdict with one more reason for failure."""
        return replace(self, passed=False, reasons=(*self.reasons, reason))


def float_values(
    graph: Graph,
    inputs: Mapping[str, Array],
    params: Mapping[str, Any],
    algebra: Any,
    derivation: Graph | None = None,
) -> dict[str, Any]:
    """Values of a graph in an algebra on arrays: per output a list of columns (samples,), or of pairs of columns.

    ``derivation`` is the graph of derived numbers, which depend on ``params`` alone.
    """
    samples = len(next(iter(inputs.values())))
    derived = derived_values(derivation, params, algebra) if derivation else {}

    def leaf(node: Node) -> Any:
        if node[0] == "param":
            return derived[node[1]] if node[1] in derived else algebra.const(params[node[1]])
        column = inputs[node[1]][:, node[2]]
        return (column.astype(np.float64), np.zeros(samples)) if isinstance(algebra, Bounded) else column

    with np.errstate(all="ignore"):
        return evaluate(graph, algebra, leaf)


def derived_values(derivation: Graph, params: Mapping[str, Any], algebra: Any) -> dict[str, Any]:
    """Derived numbers in an algebra, by path, in the order of operations of the C."""
    with np.errstate(all="ignore"):
        found = evaluate(derivation, algebra, lambda node: algebra.const(params[node[1]]))
    return {path: elements[0] for path, elements in found.items()}


def stack(columns: list[Any], samples: int) -> Array:
    """Columns (or constants) as an array (samples, size)."""
    return np.stack([np.broadcast_to(np.asarray(c), (samples,)) for c in columns], axis=1)


def same_bits(a: Array, b: Array) -> bool:
    """Whether two arrays of floats are equal in every bit."""
    return bool(np.array_equal(a.view(f"u{a.itemsize}"), b.view(f"u{b.itemsize}")))


def judge_solver(
    name: str,
    reference: Reference,
    mirror: Mapping[str, Array],
    observed: Callable[[Any], Mapping[str, Array]],
    other: Callable[[Any, Reference], tuple[Reference, list[str]]],
    inputs: Mapping[str, Array],
    run: Callable[[Mapping[str, Array]], Any],
    tolerance: float,
    seed: int,
    units: Mapping[str, Sequence[Unit]] | None = None,
) -> Verdict:
    """Level 3 for a kernel that iterates: every sample converges to the exact solution within the tolerance.

    Level 1 for the outputs in ``mirror``, whose bits are known. ``observed`` computes from the result what the
    reference contains: outputs, or quantities that follow from them. ``other`` is asked after a miss: for the reference
    of another right answer, and for what is wrong with it. Elements of an output in ``units`` are compared with the
    largest one of their own unit.
    """
    raw = run(inputs)
    samples, reasons = len(raw.status), []
    wrong = raw.status != reference.high.get(STATUS, np.zeros((samples, 1)))[:, 0]
    if np.any(wrong):
        reasons.append(f"it returns a wrong status at {np.count_nonzero(wrong)} samples")
    found = observed(raw)
    worst_ulp, worst_scaled = _misses(reference, found, samples, units or {})
    if not worst_scaled <= tolerance:
        reference, faults = other(raw, reference)
        worst_ulp, worst_scaled = _misses(reference, found, samples, units or {})
        reasons += faults
    bits = bool(mirror) and all(same_bits(getattr(raw, port), known) for port, known in mirror.items())
    if mirror and not bits:
        reasons.append("the C differs from its mirror in some bits")
    if not worst_scaled <= tolerance:
        reasons.append(f"it misses the exact solution by {worst_scaled:.1e} of the largest value")
    return Verdict(
        name, not reasons, bits, worst_ulp, worst_scaled, worst_scaled / tolerance, 0.0, 0.0, samples, seed,
        tuple(reasons),
    )  # fmt: skip


def scales(exact: Array, units: Sequence[Unit] = ()) -> Array:
    """For each element (size,) of exact values (samples, size), the largest magnitude of all in its unit."""
    largest = np.max(np.abs(exact), axis=0)
    alike = [[a.label == b.label for b in units] for a in units] or np.ones((len(largest), len(largest)), bool)
    found: Array = np.array([np.max(largest, where=np.array(row), initial=0.0) for row in alike])
    return found


def _misses(
    reference: Reference, found: Mapping[str, Array], samples: int, units: Mapping[str, Sequence[Unit]]
) -> tuple[float, float]:
    """The worst error of all outputs in units in the last place, and relative to the scale of its elements."""
    worst_ulp = worst_scaled = 0.0
    for port, exact in reference.high.items():
        if port == STATUS:
            continue
        values = found[port].reshape(samples, -1)
        error = reference.error(port, values)
        scale = scales(exact, units.get(port, ()))
        scale = np.where(scale > 0, scale, 1.0)
        spacing = np.spacing(np.maximum(np.abs(exact), NEAR_ZERO * scale).astype(values.dtype))
        worst_ulp = max(worst_ulp, float(np.max(error / spacing)))
        worst_scaled = max(worst_scaled, float(np.max(error / scale)))
    return worst_ulp, worst_scaled


def judge(
    name: str,
    graph: Graph,
    reference: Reference,
    inputs: Mapping[str, Array],
    params: Mapping[str, Any],
    call: Callable[..., Any],
    shapes: Mapping[str, tuple[int, ...]],
    agreement: float,
    passes: float,
    seed: int,
    dtype: type,
    own: bool,
    derivation: Graph | None = None,
) -> Verdict:
    """Levels 1 and 3 for one compiled kernel, with the results of levels 2 and 4 for its graphs.

    ``derivation`` is the graph of the derived numbers that the kernel reads.
    """
    samples = len(next(iter(inputs.values())))
    arrays = {port: a.reshape(samples, *shapes[port]) for port, a in inputs.items()}
    raw = call(**arrays)
    outputs = [o.name for o in graph.outputs if o.name != GUARDS]
    guarded = len(outputs) < len(graph.outputs)
    computed = dict(zip(outputs, raw if len(outputs) + guarded > 1 else (raw,), strict=False))
    computed = {port: np.asarray(a).reshape(samples, -1) for port, a in computed.items()}
    mirrored = float_values(graph, inputs, params, Floats(dtype, own), derivation)
    bounds = float_values(graph, inputs, params, Bounded(dtype, own), derivation)
    exact = True
    worst_ulp = worst_scaled = bound_use = 0.0
    reasons = []
    for port, values in computed.items():
        mirror: Array = stack(mirrored[port], samples).astype(dtype)
        exact &= same_bits(values, mirror)
        error = reference.error(port, values)
        limit = stack([b[1] for b in bounds[port]], samples)
        if not np.isfinite(values).all():
            reasons.append(f"{port} is not finite inside the documented range")
            error = np.where(np.isfinite(error), error, np.inf)
        scale = float(np.max(np.abs(reference.high[port]), initial=0.0))
        if scale == 0:  # the output is zero everywhere: the rounding bound gives the size of its terms
            scale = float(np.max(limit, initial=0.0)) / UNIT_ROUNDOFF[dtype]
        spacing = np.spacing(np.abs(reference.high[port]).astype(dtype)).astype(np.float64)
        sizeable = np.abs(reference.high[port]) >= NEAR_ZERO * scale
        with np.errstate(over="ignore"):  # of errors near zero, which do not count
            worst_ulp = max(worst_ulp, float(np.max(error / spacing, initial=0.0, where=sizeable)))
        worst_scaled = max(worst_scaled, float(np.max(error, initial=0.0)) / scale)
        wrong = error > REFERENCE * np.abs(reference.high[port])  # of what is exact in floats, as its bound is zero
        share = np.divide(error, limit, out=np.where(wrong, np.inf, 0.0), where=limit > 0)
        bound_use = max(bound_use, float(np.max(share, initial=0.0)))
    if guarded and np.any(raw.status):
        reasons.append(f"it leaves its domain at {np.count_nonzero(raw.status)} samples of its documented range")
    if not exact:
        reasons.append("the C differs from the interpreter in some bits")
    if not bound_use <= 1:
        reasons.append(f"its error is {bound_use:.3g} times what rounding explains")
    return Verdict(
        name, not reasons, exact, worst_ulp, worst_scaled, bound_use, agreement, passes, samples, seed, tuple(reasons)
    )
