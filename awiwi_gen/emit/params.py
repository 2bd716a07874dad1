"""C of the numbers that kernels read at run time: structs, derived numbers, and the reader of a flat file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from awiwi_gen.emit.c import Printer, headers_of, identifier
from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.names import require_fields
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.algebras import Dimensions
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.ir.passes.lift import DERIVED
from awiwi_gen.units import Quantity, Unit, one

ROW = 8  # numbers in a line of C
Range = tuple[Fraction, Fraction]


@dataclass(frozen=True)
class Numbers:
    """The numbers that kernels read, by path in the hand file, with the ranges that a reader checks.

    ``derivations`` are the graphs of the derived numbers, by the path of the part; paths in them are relative to it.
    ``zeros`` are the paths of those that are constants because they are zero. ``digest`` is that of the structure, 64
    hexadecimal digits.
    """

    quantities: Mapping[str, Quantity]
    ranges: Mapping[str, Range]
    derivations: Mapping[str, Graph]
    zeros: Sequence[str]
    digest: str

    @property
    def derived(self) -> list[tuple[str, str]]:
        """The part and the path of every derived number, in the order of the struct."""
        return [(part, output.name) for part, graph in self.derivations.items() for output in graph.outputs]

    def layout(self) -> dict[str, Any]:
        """What a file of numbers needs, as plain data: path, unit and range of every number."""
        numbers = [
            {"path": path, "unit": str(q.unit), "low": float(self.ranges[path][0]), "high": float(self.ranges[path][1])}
            for path, q in self.quantities.items()
        ]
        return {"digest": self.digest, "zeros": list(self.zeros), "numbers": numbers}


def group_of(path: str) -> str:
    """The part of the hand that a number belongs to: `fingers.index`, or the first key."""
    return ".".join(path.split(".")[: 2 if path.startswith("fingers.") else 1])


def struct_fields(numbers: Numbers, options: Options) -> tuple[list[str], list[str]]:
    """The fields of both structs, with a comment above those of each part."""
    require_fields({path: identifier(path) for path in numbers.quantities})
    given: list[str] = []
    group = ""
    for path, quantity in numbers.quantities.items():
        if group != group_of(path):
            group = group_of(path)
            given.append(f"/* {group} */")
        low, high = (float(end) for end in numbers.ranges[path])
        given.append(f"{options.c_type} {identifier(path)}; /* {path}, {quantity.unit}, {low:.6g} to {high:.6g} */")
    derived = []
    for part, graph in numbers.derivations.items():
        derived.append(f"/* derived from {part or 'the hand'} */")
        units = units_of(part, graph, numbers.quantities)
        derived += [f"{options.c_type} {identifier(f'{part}.{o.name}')}; /* {units[o.name]} */" for o in graph.outputs]
    return given, derived


def units_of(part: str, graph: Graph, quantities: Mapping[str, Quantity]) -> dict[str, Unit]:
    """The units of derived numbers, by path."""
    start = f"{part}." if part else ""
    found = evaluate(graph, Dimensions(), lambda node: quantities[start + node[1]].unit)
    return {path: elements[0] or one for path, elements in found.items()}


def params_files(prefix: str, numbers: Numbers, options: Options) -> dict[str, str]:
    """params.h and params.c."""
    names = {path: identifier(path) for path in numbers.quantities}
    ends = [[options.literal(numbers.ranges[path][end]) for path in names] for end in (0, 1)]
    common = {"prefix": prefix, "count": len(names), "derived": len(numbers.derived)}
    printers = {part: _Derivation(graph, options, part) for part, graph in numbers.derivations.items()}
    includes = {include for graph in numbers.derivations.values() for include in headers_of(graph, options)}
    return {
        "params.h": render(
            "params.h.j2",
            banner=banner(),
            guard=f"{prefix.upper()}_PARAMS_H",
            size=options.bits // 8,
            **common,
        ),
        "params.c": render(
            "params.c.j2",
            banner=banner("The numbers of the hand file, what is derived from them, and the reader of other numbers."),
            includes=sorted(includes, key=lambda name: (name[0] == '"', name)),
            values=[f".{names[p]} = {options.literal(q.value)}, /* {q.text} */" for p, q in numbers.quantities.items()],
            parts=[(identifier(part) or "hand", printer.statements()) for part, printer in printers.items()],
            digest=_rows([f"0x{numbers.digest[i : i + 2]}" for i in range(0, 64, 2)]),
            low=_rows(ends[0]),
            high=_rows(ends[1]),
            **common,
        ),
    }


class _Derivation(Printer):
    """Prints a graph of derived numbers: it reads fields of one struct and writes fields of another."""

    def __init__(self, graph: Graph, options: Options, part: str) -> None:
        self.part = part
        super().__init__(graph, options, part)

    def parameter(self, path: str) -> str:
        """The field of a number of the hand."""
        return f"numbers->{identifier(f'{self.part}.{path}')}"

    def output_element(self, port: str, element: int) -> str:
        """The field of a derived number."""
        return f"params->{identifier(f'{self.part}.{port}')}"


def _rows(literals: Sequence[str]) -> list[str]:
    return [", ".join(literals[i : i + ROW]) + "," for i in range(0, len(literals), ROW)]


def paths_read(part: str, graphs: Iterable[Graph]) -> set[str]:
    """Paths in the hand file of the numbers that graphs of a part read, without the derived ones."""
    return {f"{part}.{path}".lstrip(".") for graph in graphs for path in graph.params if not is_derived(path)}


def is_derived(path: str) -> bool:
    """Whether a path is that of a derived number."""
    return path.startswith(DERIVED)
