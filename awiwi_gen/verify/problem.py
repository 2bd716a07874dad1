"""What verification knows of a kernel that iterates: well-posed inputs, and the exact solutions to compare with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from awiwi_gen.ir.graph import Graph
from awiwi_gen.kernel import Solver
from awiwi_gen.verify.reference import Reference

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Problem(ABC):
    """What a solver solves; made from the solver, the graphs of the kernels it calls, and the numbers of its part."""

    solver: Solver
    graphs: Mapping[str, Graph]
    values: Mapping[str, Fraction]

    @abstractmethod
    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Well-posed inputs, made from samples of the ports' ranges."""

    @abstractmethod
    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """Exact outputs; `status` is the status that must be returned, which is otherwise 0."""

    def run(self, call: Callable[..., Any], inputs: Mapping[str, Array]) -> Any:
        """The kernel's outputs, at the end of as many calls as it needs: one by default."""
        return call(**inputs)

    def mirror(self, inputs: Mapping[str, Array], own: bool) -> Mapping[str, Array]:
        """What the solver computes in floats, by output, where that is known to the last bit; nothing by default."""
        return {}

    def other_reference(
        self, inputs: Mapping[str, Array], found: Any, reference: Reference
    ) -> tuple[Reference, list[str]]:
        """Exact outputs where a search that missed those of `solve` ended, and why that is not right, if it is not.

        Asked only after a miss. The same reference by default: there is one right answer.
        """
        return reference, []

    def observed(self, inputs: Mapping[str, Array], found: Any) -> Mapping[str, Array]:
        """What is compared with the exact outputs: the outputs found, or what follows from them."""
        return {name: getattr(found, name) for name in found._fields}
