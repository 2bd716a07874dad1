"""Derivatives of any kernel's routes: exact in SymPy, automatic in CasADi.

`derivatives_of` turns the routes of a vector into the routes of its Jacobians, so a derivative kernel needs no
mathematics of its own.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import sympy

from awiwi_gen.models.naming import Derivation

Route = Callable[..., Any]


@dataclass(frozen=True)
class Differentiated:
    """A route to the Jacobians of another route's vector; a class, for routes travel between processes."""

    route: Route
    wrt: tuple[str, ...]
    jacobian: Callable[[Any, Any], Any]

    def __call__(self, part: Any, *arguments: Any) -> Any:
        """One matrix (vector x argument) per name, or that matrix alone for a single name."""
        names = list(inspect.signature(self.route).parameters)[1:]
        vector = self.route(part, *arguments)
        matrices = [self.jacobian(vector, arguments[names.index(name)]) for name in self.wrt]
        return matrices[0] if len(matrices) == 1 else tuple(matrices)


def derivatives_of(definition: Route, witness: Route, *wrt: str) -> tuple[Route, Route]:
    """The routes (SymPy, CasADi) to the Jacobians of a vector with respect to the named arguments."""
    return Differentiated(definition, wrt, _by_rules), Differentiated(witness, wrt, ca.jacobian)


def _by_rules(vector: Any, argument: Any) -> sympy.Matrix:
    chain = Derivation()
    return sympy.Matrix([[chain.partial(element, x) for x in argument] for element in vector])
