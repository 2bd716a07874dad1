"""CasADi: SX graph, its own `cse`, and the C it generates."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import casadi as ca

from bench.peers.formulas import outputs
from bench.peers.kit import BEGIN, END, Contender, make_all
from bench.peers.recursion import Algebra
from bench.quantities import SIZES, Quantity

ALGEBRA = Algebra(ca.cos, ca.sin, lambda ys, x: ca.vertsplit(ca.jacobian(ca.vertcat(*ys), x)))


def generate(quantity: Quantity, finger: dict[str, Any]) -> tuple[str, str]:
    """C of one quantity."""
    inputs = {port: ca.SX.sym(port, SIZES[port]) for port in quantity.inputs}
    x = {port: ca.vertsplit(symbol) for port, symbol in inputs.items()}
    results = [ca.vertcat(*map(ca.SX, entries)) for entries in outputs(quantity.name, finger, x, ALGEBRA).values()]
    dense = [ca.densify(entries) for entries in ca.cse(results)]
    return program(ca.Function(f"casadi_{quantity.name}_program", [*inputs.values()], dense), quantity)


def program(function: Any, quantity: Quantity) -> tuple[str, str]:
    """C text of a CasADi function, and a call of it."""
    with tempfile.TemporaryDirectory() as scratch:
        name = f"{function.name()}.c"  # prefixes the helpers, too
        made = ca.CodeGenerator(name, {"with_header": False})
        made.add(function)
        made.generate(f"{scratch}/")
        text = (Path(scratch) / name).read_text(encoding="utf-8")
    (body,) = re.findall(r"static int casadi_f0\(.*?\n}\n", text, flags=re.DOTALL)
    text = text.replace(body, f"{BEGIN}\n{body}{END}\n")
    call = (
        f"    const double *arg[] = {{{', '.join(quantity.inputs)}}};\n"
        f"    double *res[] = {{{', '.join(quantity.outputs)}}};\n"
        f"    {function.name()}(arg, res, 0, 0, 0);"
    )
    return text, call


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities."""
    # Its functions are exported unless told otherwise; static ones are inlined.
    flags = ["-DCASADI_SYMBOL_EXPORT=static"]
    make_all(Contender("casadi", ca.__version__, directory, flags=flags), finger, generate)
