"""`awiwi-gen explain`: a kernel's meaning, ports, source, cost and mathematics; a line of its C back to its numbers."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from awiwi_gen.arguments import HandFile, Json, kernel_names
from awiwi_gen.errors import InputError, printable, unknown
from awiwi_gen.ir.cost import operations_text

if TYPE_CHECKING:
    from awiwi_gen.ir.graph import Graph
    from awiwi_gen.kernel import Kernel, Port
    from awiwi_gen.pipeline import Job

MOST_LINES = 60


def explain(
    kernel: Annotated[
        str, typer.Argument(help="Name of a kernel, see list; or a generated C file.", autocompletion=kernel_names)
    ] = "",
    hand: HandFile = None, as_json: Json = False,
    line: Annotated[
        str, typer.Option("--line", metavar="FILE:N", help="A line of generated C: its equation and numbers.")
    ] = "",
    latex: Annotated[bool, typer.Option("--latex", help="Formulas in LaTeX.")] = False,
) -> int:  # fmt: skip
    """Show a kernel's mathematics, source, units and cost, or what decides a line of its C."""
    from awiwi_gen import terminal
    from awiwi_gen.hand import Hand
    from awiwi_gen.pipeline import Job
    from awiwi_gen.report import Progress, print_json

    if line:
        return _explain_line(kernel, line, hand, as_json)
    if not kernel:
        raise InputError("explain: which kernel? name one of awiwi-gen list, or a line of its C with --line FILE:N")
    job = Job(Hand.load(hand), progress=Progress())
    known = [each.name for each in job.catalog]
    if kernel not in known:
        raise terminal.no_kernel(job.hand, hand, kernel, known)
    explained = explanation(job, kernel)
    if as_json:
        print_json(explained)
    else:
        print(printable("\n".join(explanation_lines(explained, latex))))
    return 0


def _explain_line(name: str, line: str, hand: Path | None, as_json: bool) -> int:
    from awiwi_gen.hand import Hand
    from awiwi_gen.hand.file import HandFile
    from awiwi_gen.provenance import Place, provenance, provenance_lines
    from awiwi_gen.report import print_json
    from awiwi_gen.resources import DEFAULT_HAND

    place = Place.parse(line, name)
    found = provenance(Hand.load(hand), place)
    if as_json:
        print_json(found)
    else:
        file = HandFile.read(hand or DEFAULT_HAND, str(hand) if hand else DEFAULT_HAND.name)
        print(printable("\n".join(provenance_lines(found, place, file))))
    return 0


def explanation(job: Job, name: str) -> dict[str, Any]:
    """A kernel's documentation, ports, cost, numbers and mathematics. Raises InputError for an unknown name."""
    from awiwi_gen.pipeline import Job
    from awiwi_gen.records import load_graphs

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
        **(formulas(kernel, definition) if definition else {}),
        "mathematics": mathematics(definition) if definition else [f"{kernel.solver.problem}, by iteration"],
    }


def formulas(kernel: Kernel, definition: Graph) -> dict[str, Any]:
    """The definition as formulas, in Unicode and in LaTeX, and what they call the hand's numbers; empty if too long."""
    from awiwi_gen.mathematics import is_readable, latex, symbols, text

    if not is_readable(definition):
        return {"formulas": [], "latex": [], "symbols": {}}
    return {"formulas": text(kernel, definition), "latex": latex(kernel, definition), "symbols": symbols(definition)}


def mathematics(definition: Graph) -> list[str]:
    """The definition with the hand's numbers by name, as assignments; long ones end in an ellipsis."""
    from awiwi_gen.ir.passes import optimise
    from awiwi_gen.mathematics import assignments

    lines = assignments(optimise(definition)[-1][1])
    return lines if len(lines) <= MOST_LINES else [*lines[:MOST_LINES], f"... and {len(lines) - MOST_LINES} more lines"]


def _port(port: Port) -> dict[str, Any]:
    shown: dict[str, Any] = {"shape": list(port.shape), "unit": port.unit_text}
    return shown if port.low is None else shown | {"range": port.bounds()}


def explanation_lines(shown: dict[str, Any], latex: bool = False) -> list[str]:
    """The same as text: formulas in LaTeX or in Unicode, then the graph as assignments."""
    lines = [shown["name"], *folded(shown["doc"], "  "), "", f"  source     {shown['source']}"]
    for side in ("inputs", "outputs"):
        for name, port in shown[side].items():
            shape = "".join(f"[{n}]" for n in port["shape"])
            lines.append(f"  {side[:-1]:9}  {name}{shape} in {port['unit']}")
    counts = ", ".join(f"{n} {what}" for what, n in shown["cost"].items() if n and what != "operations")
    lines += [f"  cost       {operations_text(shown)} operations ({counts or 'only moves'}), route {shown['route']}"]
    lines += [f"  returns 1 unless {guard}" for guard in shown["guards"]]
    typeset = shown.get("latex" if latex else "formulas", [])
    if typeset:
        lines += ["", "  formulas:", *(f"    {line}" for line in typeset)]
    elif "formulas" in shown:
        lines += ["", f"  formulas: too long to be read as a whole; see {shown['source']}"]
    if "latex" in shown and latex and typeset:
        return lines
    lines += ["", f"  graph, with the numbers of {shown['part'] or 'the hand'}:"]
    lines += [f"    {line}" for line in shown["mathematics"]]
    if shown["numbers"]:
        lines += ["", "  numbers:"]
    called = shown.get("symbols", {})
    for path, value in shown["numbers"].items():
        lines.append(f"    {path} = {value}" + (f" ({called[path]})" if typeset and path in called else ""))
    return lines


def folded(text: str, indent: str) -> list[str]:
    """Text in lines of 80 characters."""
    return textwrap.wrap(text, 80, initial_indent=indent, subsequent_indent=indent, break_long_words=False)
