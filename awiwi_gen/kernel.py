"""The types `Port`, `Solver` and `Kernel`: typed ports, and two routes to the outputs, one in each wing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from math import prod
from typing import Any

from awiwi_gen.units import Unit

GUARDS = "guards"
WINGS = {
    "sympy": "awiwi_gen.definitions",
    "casadi": "awiwi_gen.witnesses",
}  # by the library that each wing derives with


@dataclass(frozen=True)
class Route:
    """A function of a wing, by name; its module is imported at the first call.

    ``domain`` is another function of the wing with the same arguments, which gives guards only.
    """

    module: str
    function: str
    domain: Route | None = None

    def __call__(self, part: Any, *arguments: Any) -> Any:
        """Outputs, then guards, from a part with symbols for its numbers and one column of symbols per input port."""
        result = getattr(import_module(self.module), self.function)(part, *arguments)
        if self.domain is None:
            return result
        return *(result if isinstance(result, tuple) else (result,)), self.domain(part, *arguments)

    @property
    def modules(self) -> tuple[str, ...]:
        """The modules that it calls."""
        return (self.module, *(self.domain.modules if self.domain else ()))


@dataclass(frozen=True)
class Port:
    """One array argument of a kernel.

    ``unit`` is one unit for the whole array or one per element, row by row. ``low`` and ``high`` (a number
    or one per element) are the range that the kernel is documented and verified for; outputs have no range.
    """

    shape: tuple[int, ...]
    unit: Unit | tuple[Unit, ...]
    low: float | tuple[float, ...] | None = None
    high: float | tuple[float, ...] | None = None

    @property
    def size(self) -> int:
        """Number of elements; a scalar has one."""
        return prod(self.shape)

    @property
    def units(self) -> tuple[Unit, ...]:
        """The unit of every element."""
        return self.unit if isinstance(self.unit, tuple) else (self.unit,) * self.size

    @property
    def unit_text(self) -> str:
        """The unit as text; arrays of mixed units list each unit once."""
        return ", ".join(dict.fromkeys(str(unit) for unit in self.units))

    def subset(self, elements: Sequence[int]) -> Port:
        """Some elements of a vector, with their ranges."""
        bounds = self.bounds()
        low, high = zip(*(bounds[i] for i in elements), strict=True)
        return Port((len(elements),), tuple(self.units[i] for i in elements), low, high)

    def bounds(self) -> list[tuple[float, float]]:
        """(low, high) of every element."""
        low = self.low if isinstance(self.low, tuple) else (self.low,) * self.size
        high = self.high if isinstance(self.high, tuple) else (self.high,) * self.size
        return [(float(a or 0.0), float(b or 0.0)) for a, b in zip(low, high, strict=True)]


STOP = {"f64": "1e-11", "f32": "1e-6"}


@dataclass(frozen=True)
class Solver:
    """How a kernel iterates: a template that binds a solver of csrc to generated kernels.

    ``uses`` are the families of the kernels of the same part that it calls. ``equations`` and ``unknowns`` are the
    indices of the tendons and joints that take part. ``arrays`` become C constants, ``strings`` go to the template
    unchanged. ``problem`` names an entry of `verify.problems.PROBLEMS`, which draws well-posed inputs and has their exact
    solutions; a compiled result may differ from these by ``tolerance`` of the largest element, per scalar type.
    ``iterations`` is the number of calls of the used kernels in the worst case; ``calls`` has other numbers, by
    family.
    A last step shorter than ``stop``, per scalar type, ends an iteration. Unknowns in ``held`` are inputs, not found.
    ``resting`` are the joints whose angles springs tell beside lengths, and the tendons over them.
    ``limits`` are the paths of the numbers in ``arrays`` that are read at run time where others are. The solver is
    expected to converge from starts up to ``near`` away in each unknown. ``pairs`` are antagonistic tendons (first,
    second, number of the pair that shares joints with it).
    """

    template: str
    problem: str
    uses: tuple[str, ...]
    equations: tuple[int, ...]
    unknowns: tuple[int, ...]
    arrays: Mapping[str, tuple[float, ...]]
    strings: Mapping[str, str]
    iterations: int
    tolerance: Mapping[str, float]
    limits: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    stop: Mapping[str, str] = field(default_factory=lambda: STOP)
    near: tuple[float, ...] = ()
    held: tuple[int, ...] = ()
    resting: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())
    calls: Mapping[str, int] = field(default_factory=dict)
    pairs: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True)
class Kernel:
    """One function of the C interface.

    ``part`` is the part of the hand that the routes receive as their first argument, ``path`` its path in the hand
    file. Kernels of parts with equal ``structure`` share their derivation. The first route is the definition, the
    other is its witness; a kernel with a ``solver`` has none.

    ``guards`` are the conditions, in words, under which the result exists. Routes of a guarded kernel return, after
    their outputs, one expression per guard that is positive where the condition holds; the C returns a status.
    """

    name: str
    doc: str
    source: str
    inputs: Mapping[str, Port]
    outputs: Mapping[str, Port]
    routes: Mapping[str, Route]
    part: Any = field(repr=False)
    path: str = ""
    structure: str = ""
    guards: tuple[str, ...] = ()
    solver: Solver | None = None

    @property
    def results(self) -> dict[str, tuple[int, ...]]:
        """Shapes of what a route returns: the outputs, then the guards if there are any."""
        shapes = {name: port.shape for name, port in self.outputs.items()}
        return {**shapes, GUARDS: (len(self.guards),)} if self.guards else shapes

    @property
    def needs(self) -> dict[str, str]:
        """Names of the kernels its solver calls, by family."""
        if self.solver is None:
            return {}
        return {family: self.name.removesuffix(self.family) + family for family in self.solver.uses}

    @property
    def family(self) -> str:
        """The kernel's name without its part, as for all fingers: "mass_matrix" of "index_mass_matrix"."""
        return self.name.removeprefix(self.path.partition(".")[2] + "_")
