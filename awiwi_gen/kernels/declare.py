"""How kernels are declared: one decorated function each, collected in the family of the parts that have it.

A kernel's argument names choose its input ports, its name (after the part's) is the C symbol, its docstring the
documentation. The function is the definition, in SymPy; the ``witness`` is another road to the same numbers, in CasADi.
Both receive the part with symbols for numbers.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from awiwi_gen.kernel import Kernel, Port, Route, Solver

Size = TypeVar("Size")


@dataclass(frozen=True)
class Template(Generic[Size]):
    """A kernel before it knows its part."""

    name: str
    outputs: Callable[[Size], dict[str, Port]]
    source: str
    definition: Route
    witness: Route | None
    guards: tuple[str, ...]
    solver: Callable[[Any], Solver | None]

    def kernel(
        self, prefix: str, part: Any, path: str, structure: Mapping[str, Any], ports: Mapping[str, Port], size: Size
    ) -> Kernel:
        """The kernel of one part. An argument that the part has no port for is left out, so it needs a default."""
        arguments = [*inspect.signature(self.definition).parameters][1:]
        solver = self.solver(part)
        return Kernel(
            name=f"{prefix}_{self.name}" if prefix else self.name,
            doc=inspect.getdoc(self.definition) or "",
            source=self.source,
            inputs={name: ports[name] for name in arguments if name in ports},
            outputs=self.outputs(size),
            routes={} if solver or not self.witness else {"sympy": self.definition, "casadi": self.witness},
            part=part,
            path=path,
            structure=json.dumps(structure, sort_keys=True),
            guards=self.guards,
            solver=solver,
        )


def straight_line(part: Any) -> None:
    """No solver: the kernel is one formula for this part."""


class Family(Generic[Size]):
    """The kernels that all parts of one kind have; an instance is the decorator that declares one more."""

    def __init__(self) -> None:
        self.templates: list[Template[Size]] = []

    def __call__(
        self,
        outputs: Callable[[Size], dict[str, Port]],
        source: str,
        witness: Route | None = None,
        guards: tuple[str, ...] = (),
        solver: Callable[[Any], Solver | None] = straight_line,
    ) -> Callable[[Route], Route]:
        """Declare a kernel: its outputs for a part of some size, where it comes from, and the other road to it.

        For parts that ``solver`` answers for, it iterates instead; what always iterates needs no witness.
        """

        def declare(definition: Route) -> Route:
            self.templates.append(Template(definition.__name__, outputs, source, definition, witness, guards, solver))
            return definition

        return declare

    def kernels(
        self, prefix: str, part: Any, path: str, structure: Mapping[str, Any], ports: Mapping[str, Port], size: Size
    ) -> list[Kernel]:
        """All kernels of one part, in the order of their declaration."""
        return [template.kernel(prefix, part, path, structure, ports, size) for template in self.templates]


class Parameterless:
    """The part of kernels that read no number of the hand: all their parameters are inputs."""

    def quantities(self) -> dict[str, Any]:
        """None."""
        return {}

    def structure(self) -> dict[str, Any]:
        """All such parts are alike."""
        return {}

    def symbolic(self, leaf: Callable[..., Any]) -> Parameterless:
        """Itself: there is nothing to name."""
        return self
