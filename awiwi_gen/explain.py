"""The explanation of a kernel: meaning, ports, source, cost, and mathematics."""

from __future__ import annotations

from typing import Any

from awiwi_gen.emit.c import Printer
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import unknown
from awiwi_gen.ir.cost import operations_text
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.passes import optimise
from awiwi_gen.kernel import Port
from awiwi_gen.pipeline import Job
from awiwi_gen.records import load_graphs

MOST_LINES = 60


def explanation(job: Job, name: str) -> dict[str, Any]:
    """A kernel's documentation, ports, cost, numbers and mathematics. Raises InputError for an unknown name."""
    known = {kernel.name: kernel for kernel in job.kernels}
    if name not in known:
        raise unknown("kernel", name, known)
    kernel = known[name]
    alone = Job(job.hand, job.options, name, job.store, job.progress)
    record = alone.records[name]
    definition = next(iter(load_graphs(kernel, job.store).values()), None)
    return {
        "name": name,
        "doc": kernel.doc,
        "source": kernel.source,
        "part": kernel.path,
        "inputs": {n: _port(p) for n, p in kernel.inputs.items()},
        "outputs": {n: _port(p) for n, p in kernel.outputs.items()},
        "guards": list(kernel.guards),
        "route": record.route,
        "cost": record.function.cost.as_dict(),
        "numbers": {p: str(kernel.part.quantities()[p]) for p in (definition.params if definition else ())},
        "mathematics": mathematics(definition) if definition else [f"{kernel.solver.problem}, by iteration"],
    }


def mathematics(definition: Graph) -> list[str]:
    """The definition with the hand's numbers by name, as assignments; long ones end in an ellipsis."""
    graph = optimise(definition)[-1][1]
    lines = [
        line.removeprefix("const double ").rstrip(";") for line in Names(graph, Options(math="libm"), "").statements()
    ]
    return lines if len(lines) <= MOST_LINES else [*lines[:MOST_LINES], f"... and {len(lines) - MOST_LINES} more lines"]


class Names(Printer):
    """Prints numbers of the hand by their path in the hand file, and ports by their own names."""

    def input_element(self, port: str, element: int) -> str:
        """``q[2]``."""
        return f"{port}[{element}]"

    output_element = input_element

    def parameter(self, path: str) -> str:
        """``links[1].mass`` as in the file."""
        return path


def _port(port: Port) -> dict[str, Any]:
    shown: dict[str, Any] = {"shape": list(port.shape), "unit": port.unit_text}
    return shown if port.low is None else shown | {"range": port.bounds()}


def explanation_lines(shown: dict[str, Any]) -> list[str]:
    """The same as text."""
    lines = [shown["name"], f"  {shown['doc']}", "", f"  source     {shown['source']}"]
    for side in ("inputs", "outputs"):
        for name, port in shown[side].items():
            shape = "".join(f"[{n}]" for n in port["shape"])
            lines.append(f"  {side[:-1]:9}  {name}{shape} in {port['unit']}")
    counts = ", ".join(f"{n} {what}" for what, n in shown["cost"].items() if n and what != "operations")
    lines += [f"  cost       {operations_text(shown)} operations ({counts or 'only moves'}), route {shown['route']}"]
    lines += [f"  returns 1 unless {guard}" for guard in shown["guards"]]
    lines += [
        "",
        f"  definition, with the numbers of {shown['part']}:",
        *(f"    {line}" for line in shown["mathematics"]),
    ]
    lines += ["", "  numbers:", *(f"    {path} = {value}" for path, value in shown["numbers"].items())]
    return lines
