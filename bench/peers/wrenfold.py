"""wrenfold: the same recursions, its C++ code generation with scalar arguments."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path
from typing import Any

from wrenfold import code_generation, sym
from wrenfold.type_annotations import FloatScalar

from bench.peers.formulas import outputs
from bench.peers.kit import Contender, make_all, names, scalar_call
from bench.peers.recursion import Algebra
from bench.quantities import Quantity


def partial(entries: list[Any], x: Any) -> list[Any]:
    """Derivatives; entries may be plain numbers."""
    return [y.diff(x) if isinstance(y, sym.Expr) else 0 for y in entries]


def keep(entry: Any) -> Any:
    """A step that is not combined with what it is used in; without that, products are multiplied out."""
    return sym.unevaluated(entry) if isinstance(entry, sym.Expr) else entry


STEPWISE = Algebra(sym.cos, sym.sin, name=keep)
WHOLE = Algebra(sym.cos, sym.sin, partial)  # fewer operations for what is differentiated


def generate(quantity: Quantity, finger: dict[str, Any]) -> tuple[str, str]:
    """C++ of one quantity."""
    ports = names(quantity)

    def kernel(**given: Any) -> list[Any]:
        x = {port: [given[name] for name in all_] for port, all_ in ports.items()}
        results = outputs(quantity.name, finger, x, WHOLE if quantity.name == "dynamics" else STEPWISE)
        return [
            code_generation.OutputArg(expression=expression(entry), name=f"{port}_out{i}")
            for port, entries in results.items()
            for i, entry in enumerate(entries)
        ]

    text = code_generation.generate_function(_annotated(kernel, ports), code_generation.CppGenerator())
    return f"#include <cmath>\n{text}", scalar_call(quantity, "kernel<double>", "")


def expression(entry: Any) -> Any:
    """An entry as an expression, numbers too."""
    return entry if isinstance(entry, sym.Expr) else sym.float_constant(float(entry))


def _annotated(kernel: Any, ports: dict[str, list[str]]) -> Any:
    """The kernel with one named and annotated argument per scalar: wrenfold reads signatures."""
    arguments = [name for all_ in ports.values() for name in all_]
    scope = {"kernel": kernel, "FloatScalar": FloatScalar}
    code = f"def made({', '.join(f'{a}: FloatScalar' for a in arguments)}):\n"
    code += f"    return kernel({', '.join(f'{a}={a}' for a in arguments)})\n"
    exec(code, scope)  # noqa: S102 - our own text
    made: Any = scope["made"]
    made.__name__ = "kernel"
    return made


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities."""
    make_all(Contender("wrenfold", importlib.metadata.version("wrenfold"), directory, language="c++"), finger, generate)
