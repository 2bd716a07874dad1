"""Declaration of kernels: one decorated function each, collected in the family of the parts that have it.

A kernel's argument names choose its input ports, its name (after the part's) is the C symbol, and its docstring is the
documentation. The function has no body: the mathematics is in the function of the same name in the module ``subject``
of both wings, `definitions/` (SymPy) and `witnesses/` (CasADi). They are imported only when a kernel is derived.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from awiwi_gen.kernel import WINGS, Kernel, Port, Route, Solver

Size = TypeVar("Size")
Declaration = Callable[..., Any]


@dataclass(frozen=True)
class Template(Generic[Size]):
    """A kernel declaration, of which each part of the hand makes a kernel."""

    name: str
    outputs: Callable[[Size], dict[str, Port]]
    source: str
    subject: str
    arguments: tuple[str, ...]
    doc: str
    guards: tuple[str, ...]
    solver: Callable[[Any], Solver | None]

    def kernel(
        self, prefix: str, part: Any, path: str, structure: Mapping[str, Any], ports: Mapping[str, Port], size: Size
    ) -> Kernel:
        """The kernel of one part. An argument without a port is left out; the routes need a default for it."""
        solver = self.solver(part)
        routes = {library: Route(f"{wing}.{self.subject}", self.name) for library, wing in WINGS.items()}
        return Kernel(
            name=f"{prefix}_{self.name}" if prefix else self.name,
            doc=self.doc,
            source=self.source,
            inputs={name: ports[name] for name in self.arguments if name in ports},
            outputs=self.outputs(size),
            routes={} if solver else routes,
            part=part,
            path=path,
            structure=json.dumps(structure, sort_keys=True),
            guards=self.guards,
            solver=solver,
        )


def straight_line(part: Any) -> None:
    """No solver: the kernel is one formula for this part."""


class Family(Generic[Size]):
    """The kernels of all parts of one kind. An instance is the decorator that declares a kernel.

    ``subject`` is the module of both wings that derives them, unless a kernel names another.
    """

    def __init__(self, subject: str = "") -> None:
        self.subject = subject
        self.templates: list[Template[Size]] = []

    def __call__(
        self,
        outputs: Callable[[Size], dict[str, Port]],
        source: str,
        subject: str = "",
        guards: tuple[str, ...] = (),
        solver: Callable[[Any], Solver | None] = straight_line,
    ) -> Callable[[Declaration], Declaration]:
        """Declare a kernel: its outputs for the size of a part, its source, and the module that derives it.

        If ``solver`` returns a solver for a part, the kernel iterates and has no derivation.
        """

        def declare(function: Declaration) -> Declaration:
            arguments, doc = tuple(inspect.signature(function).parameters)[1:], inspect.getdoc(function) or ""
            where = subject or self.subject
            self.templates.append(Template(function.__name__, outputs, source, where, arguments, doc, guards, solver))
            return function

        return declare

    def kernels(
        self, prefix: str, part: Any, path: str, structure: Mapping[str, Any], ports: Mapping[str, Port], size: Size
    ) -> list[Kernel]:
        """All kernels of one part, in the order of their declaration."""
        return [template.kernel(prefix, part, path, structure, ports, size) for template in self.templates]


def within(kernel: Kernel, subject: str, function: str, guards: tuple[str, ...]) -> Kernel:
    """A kernel that returns a status: its domain is the function ``function`` of the module ``subject`` in both wings."""
    routes = {
        library: replace(route, domain=Route(f"{WINGS[library]}.{subject}", function))
        for library, route in kernel.routes.items()
    }
    return replace(kernel, routes=routes, guards=guards)


class Parameterless:
    """The part of kernels whose parameters are all inputs: it has no numbers."""

    def quantities(self) -> dict[str, Any]:
        """No numbers."""
        return {}

    def structure(self) -> dict[str, Any]:
        """The same for all such parts."""
        return {}

    def symbolic(self, leaf: Callable[..., Any]) -> Parameterless:
        """The part itself, as it has no numbers."""
        return self
