"""C of the kernels that iterate: a solver of csrc bound to generated kernels."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from awiwi_gen.emit.c import CFunction, identifier, signature
from awiwi_gen.emit.files import banner, describe, render
from awiwi_gen.emit.names import function_name, input_name
from awiwi_gen.emit.options import Options
from awiwi_gen.emit.pairs import straight_line
from awiwi_gen.ir.cost import Cost
from awiwi_gen.ir.graph import Graph
from awiwi_gen.kernel import Kernel, Solver


def solver_function(
    kernel: Kernel,
    solver: Solver,
    prefix: str,
    options: Options,
    used: Mapping[str, CFunction],
    graphs: Mapping[str, Graph],
    runtime: bool,
) -> tuple[CFunction, str]:
    """The function and the C file of a kernel with a solver; ``used`` are the kernels it calls, and ``graphs`` theirs.

    The cost is that of all calls in the worst case, without the solver's own work, which nobody counts.
    """
    prototype, definition = signature(
        f"int {function_name(prefix, kernel.name)}",
        {name: port.shape for name, port in kernel.inputs.items()},
        {name: port.shape for name, port in kernel.outputs.items()},
        options,
        runtime and prefix,
    )
    straight = straight_line(solver, graphs, options) if solver.pairs else None
    known = {"coupling"} if straight and straight.coupling else set()  # printed as numbers, not called
    calls = {family: solver.calls.get(family, solver.iterations) for family in used if family not in known}
    listed = [f"{count} of {used[family].name}" for family, count in calls.items()]
    comment = describe(
        kernel, f"Cost: the solver's own work{' and calls, at most: ' * bool(listed)}{', '.join(listed)}."
    )
    text = render(
        solver.template,
        banner=banner(*comment),
        definition=definition,
        kernels={family: function_name(prefix, function.name) for family, function in used.items()},
        contexts={
            family: f"(const {prefix}_params *)context, " if "_params *" in function.prototype else ""
            for family, function in used.items()
        },
        refusing=[family for family, function in used.items() if function.prototype.startswith("int ")],
        given="params" if runtime else "0",
        n=len(solver.unknowns),
        m=len(solver.equations),
        equations=", ".join(map(str, solver.equations)),
        unknowns=", ".join(map(str, solver.unknowns)),
        checked=_checked(kernel),
        arrays=[
            _array(name, values, options, kernel.path, solver.limits.get(name, ()) if runtime else ())
            for name, values in solver.arrays.items()
        ],
        straight=straight,
        params=f"const {prefix}_params *",
        tolerance=options.literal(Fraction(solver.stop[options.scalar])),
        **solver.strings,
    )
    total = sum((used[family].cost * count for family, count in calls.items()), Cost())
    function = CFunction(kernel.name, prototype, definition, comment, (), total, ())
    return function, text


def _checked(kernel: Kernel) -> str:
    """The status, unless it is AWIWI_OK although an input is not finite."""
    finite = [f"awiwi_all_finite({input_name(name)}, {port.size})" for name, port in kernel.inputs.items()]
    return f"status == AWIWI_OK && !({' && '.join(finite)}) ? AWIWI_NOT_FINITE : status"


def _array(name: str, values: tuple[float, ...], options: Options, part: str, paths: tuple[str, ...]) -> str:
    """Constants, or the numbers of the hand at these paths."""
    numbers = ", ".join(
        f"params->numbers.{identifier(f'{part}.{path}')}" if path else options.literal(Fraction(value))
        for value, path in zip(values, paths or ("",) * len(values), strict=True)
    )
    return f"{'' if paths else 'static '}const awiwi_real {name}[{len(values)}] = {{{numbers}}};"
