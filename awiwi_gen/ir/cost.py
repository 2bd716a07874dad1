"""What a graph costs: counts of operations, which do not drift as clocks do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass
from typing import Any

from awiwi_gen.ir.graph import LEAVES, Graph

SINCOS = 60  # operations that one sine and cosine take


@dataclass(frozen=True)
class Cost:
    """Operations of one call. A subtraction is an addition; a sine and a cosine of one angle are one sincos."""

    add: int = 0
    mul: int = 0
    div: int = 0
    neg: int = 0
    sqrt: int = 0
    sincos: int = 0
    calls: int = 0

    def __add__(self, other: Cost) -> Cost:
        return Cost(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def __mul__(self, times: int) -> Cost:
        return Cost(*(a * times for a in astuple(self)))

    @property
    def operations(self) -> int:
        """Additions, multiplications and divisions; negations counted with them."""
        return self.add + self.mul + self.div + self.neg

    @property
    def weight(self) -> float:
        """One number to compare routes by: rough latencies relative to a multiplication."""
        return self.operations + 4 * self.div + 6 * self.sqrt + 15 * self.sincos + 20 * self.calls

    def as_dict(self) -> dict[str, int]:
        """Plain data for JSON."""
        return {**asdict(self), "operations": self.operations}


def operations_text(entry: Mapping[str, Any]) -> str:
    """The operations of a kernel (an entry of the manifest) in a table; a solver's own work is not counted."""
    count = entry["cost"]["operations"]
    if entry["route"] != "solver":
        return str(count)
    return f"{count} + solver" if count else "solver"


def cost(graph: Graph) -> Cost:
    """Count the operations of a graph."""
    nodes, angles = graph.nodes, set()
    add = mul = div = neg = sqrt = calls = 0
    for node in nodes:
        operation = node[0]
        if operation == "add":
            add += len(node) - 2
            neg += node[1] < 0
            continue
        if operation in LEAVES:
            continue
        if operation == "mul":
            mul += len(node) - 2
        elif operation in ("div", "inv"):
            div += 1
        elif operation in ("sin", "cos"):
            angles.add(node[1])
        elif operation == "sqrt":
            sqrt += 1
        else:
            calls += 1
        for ref in node[1:]:
            neg += ref < 0 and nodes[~ref][0] != "const"
    neg += sum(ref < 0 and nodes[~ref][0] != "const" for ref in graph.roots)
    return Cost(add, mul, div, neg, sqrt, len(angles), calls)
