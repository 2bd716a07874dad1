"""What a kernel is: typed ports, a definition, and a second route to the same numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import prod
from typing import Any

from awiwi_gen.units import Unit

Route = Callable[..., Any]
GUARDS = "guards"


@dataclass(frozen=True)
class Port:
    """One array argument of a kernel.

    ``unit`` is one unit for the whole array or one per element, row by row. ``low`` and ``high`` (a number
    or one per element) bound the values the kernel is documented and verified for; outputs have none.
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
        """The unit for people; mixed arrays list their distinct units."""
        return ", ".join(dict.fromkeys(str(unit) for unit in self.units))

    def bounds(self) -> list[tuple[float, float]]:
        """(low, high) of every element."""
        low = self.low if isinstance(self.low, tuple) else (self.low,) * self.size
        high = self.high if isinstance(self.high, tuple) else (self.high,) * self.size
        return [(float(a or 0.0), float(b or 0.0)) for a, b in zip(low, high, strict=True)]


@dataclass(frozen=True)
class Solver:
    """What makes a kernel that must iterate: a template that binds a solver of csrc to generated kernels.

    ``uses`` are the families of the kernels of the same part that it calls; ``equations`` and ``unknowns`` tell
    which of their tendons and joints take part. ``arrays`` become C constants, ``strings`` go to the template as
    they are. ``problem`` names what is solved, so that verification knows well-posed inputs and their exact
    solution; a compiled result may differ from that by ``tolerance`` of the largest, per scalar type.
    ``iterations`` counts the calls of the used kernels in the worst case, but for those called ``once``.
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
    once: tuple[str, ...] = ()


@dataclass(frozen=True)
class Kernel:
    """One function of the C interface.

    ``part`` is the piece of the hand the routes receive as their first argument, ``path`` its place in the
    hand file. Kernels of parts with equal ``structure`` share their derivation. The first route is the
    definition, the others are independent ways to the same result.

    ``guards`` say in words what must hold for the result to exist. Routes of a guarded kernel return, after
    their outputs, one expression per guard that is positive where it holds; the C then returns a status.
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
        """Shapes of all that a route returns: the outputs, then the guards if there are any."""
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
        """The kernel's name without its part: what the five fingers' versions have in common."""
        return self.name.removeprefix(self.path.partition(".")[2] + "_")
