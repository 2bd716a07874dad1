"""The proof of derived numbers: the C that computes them at load, for the numbers of the hand file and for others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from awiwi_gen.ir.algebras import Bounded, Floats
from awiwi_gen.ir.exact import exact_values
from awiwi_gen.ir.graph import Graph
from awiwi_gen.verify.samples import SEED
from awiwi_gen.verify.verdict import Verdict, derived_values, same_bits

Values = Mapping[str, Fraction]


def judge_derived(
    name: str, cases: Sequence[tuple[Graph, Values, Callable[[str], Any]]], dtype: type, own: bool
) -> Verdict:
    """Levels 1 and 3 for (derivation, numbers, what the C has computed by path): equal bits, errors within their bounds."""
    exact = True
    worst_ulp = worst_scaled = bound_use = 0.0
    reasons = []
    for graph, values, computed in cases:
        mirror = derived_values(graph, values, Floats(dtype, own))
        bounds = derived_values(graph, values, Bounded(dtype, own))
        truth = exact_values(graph, values)
        for path, value in truth.items():
            found: np.ndarray[Any, Any] = np.array([computed(path)], dtype)
            exact &= same_bits(found, np.array([mirror[path]], dtype))
            error = float(abs(Fraction(float(found[0])) - value)) if np.isfinite(found[0]) else np.inf
            limit = float(bounds[path][1])
            bound_use = max(bound_use, error / limit if limit > 0 else np.inf * bool(error))
            if value:
                worst_scaled = max(worst_scaled, error / abs(float(value)))
                worst_ulp = max(worst_ulp, error / float(np.spacing(dtype(abs(float(value))))))
            if not np.isfinite(limit):
                reasons.append(f"the rounding error of {path} has no bound")
    if not exact:
        reasons.append("the C differs from the interpreter in some bits")
    if not bound_use <= 1:
        reasons.append(f"its error is {bound_use:.3g} times what rounding explains")
    return Verdict(
        name, not reasons, exact, worst_ulp, worst_scaled, bound_use, 0.0, 0.0, len(cases), SEED,
        tuple(dict.fromkeys(reasons)),
    )  # fmt: skip
