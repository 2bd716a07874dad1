"""What every peer hands over: one source file per quantity, all with the same prototype, and `contender.json`.

The file contains the tool's text between two marks, where operations are counted, and one function of C linkage
around it: `PEER_QUANTITY(const double *restrict q, ..., double *restrict M, ...)`. The tool's function is inlined into
that one, so that no peer pays for a calling convention or for arrays that may overlap.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.quantities import QUANTITIES, SIZES, Quantity

INLINED = "__attribute__((flatten, nonnull))"
BEGIN, END = "/* -- counted from here */", "/* -- to here */"


@dataclass
class Contender:
    """A peer's kernels in the making."""

    name: str
    version: str
    directory: Path
    language: str = "c"
    counted: bool = True
    flags: list[str] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    variants: list[str] | None = None
    note: str = ""
    kernels: dict[str, Any] = field(default_factory=dict)

    def add(self, quantity: Quantity, text: str, call: str, seconds: float) -> None:
        """Write one kernel: the tool's text, and a call of it in terms of the ports' names."""
        symbol = f"{self.name}_{quantity.name}"
        head = prototype(quantity, symbol, self.language).replace("void", f"{INLINED} void", 1)
        file = self.directory / f"{quantity.name}.{'c' if self.language == 'c' else 'cpp'}"
        marked = text if BEGIN in text else f"{BEGIN}\n{text}\n{END}"
        file.write_text(f"{marked}\n{head};\n{head}\n{{\n{call}\n}}\n", encoding="utf-8")
        self.kernels[quantity.name] = {"source": file.name, "symbol": symbol, "seconds": seconds}

    def adapt(self, source: str, bodies: dict[str, str]) -> None:
        """One file for all quantities of a library, which has functions rather than texts: a prelude, and bodies."""
        file = self.directory / f"adapter.{'c' if self.language == 'c' else 'cpp'}"
        texts = [source]
        for name, body in bodies.items():
            head = prototype(QUANTITIES[name], f"{self.name}_{name}", self.language)
            texts.append(f"{head};\n{head}\n{{\n{body}\n}}")
            self.kernels[name] = {"source": file.name, "symbol": f"{self.name}_{name}", "seconds": 0.0}
        file.write_text("\n".join(texts) + "\n", encoding="utf-8")
        self.finish()

    def finish(self) -> None:
        """Write `contender.json`."""
        table = {key: value for key, value in vars(self).items() if key != "directory"}
        (self.directory / "contender.json").write_text(json.dumps(table, indent=1), encoding="utf-8")


def prototype(quantity: Quantity, symbol: str, language: str) -> str:
    """The head that every kernel has."""
    restrict, linkage = ("restrict", "") if language == "c" else ("__restrict", 'extern "C" ')
    ports = [f"const double *{restrict} {p}" for p in quantity.inputs]
    ports += [f"double *{restrict} {p}" for p in quantity.outputs]
    return f"{linkage}void {symbol}({', '.join(ports)})"


def make_all(
    contender: Contender, finger: dict[str, Any], generate: Callable[[Quantity, dict[str, Any]], tuple[str, str]]
) -> None:
    """Every quantity by ``generate``, which returns the tool's text and a call of it."""
    for quantity in QUANTITIES.values():
        start = time.perf_counter()
        text, call = generate(quantity, finger)
        contender.add(quantity, text, call, time.perf_counter() - start)
    contender.finish()


def names(quantity: Quantity) -> dict[str, list[str]]:
    """Names of scalar inputs: {"q": ["q0", ...], ...}."""
    return {port: [f"{port}{i}" for i in range(SIZES[port])] for port in quantity.inputs}


def scalar_call(quantity: Quantity, function: str, reference: str) -> str:
    """A call of a function of scalars: inputs by value, outputs by reference or by address."""
    given = [f"{port}[{i}]" for port in quantity.inputs for i in range(SIZES[port])]
    given += [f"{reference}{port}[{i}]" for port, size in quantity.outputs.items() for i in range(size)]
    return f"    {function}({', '.join(given)});"


def straight_line(quantity: Quantity, steps: list[tuple[str, str]], results: list[str], function: str) -> str:
    """A C function of the ports from steps (name, expression) and the text of every output element."""
    ports = [f"const double *restrict {p}" for p in quantity.inputs]
    ports += [f"double *restrict {p}" for p in quantity.outputs]
    places = [f"{port}[{i}]" for port, size in quantity.outputs.items() for i in range(size)]
    lines = [f"    const double {name} = {text};" for name, text in steps]
    lines += [f"    {place} = {text};" for place, text in zip(places, results, strict=True)]
    scalars = {name: f"{port}[{i}]" for port, all_ in names(quantity).items() for i, name in enumerate(all_)}
    loads = [f"    const double {name} = {place};" for name, place in scalars.items()]
    unused = "".join(f" (void){name};" for name in scalars)
    return "\n".join(
        [f"#include <math.h>\nstatic void {function}({', '.join(ports)})", "{", *loads, f"   {unused}", *lines, "}"]
    )


def port_call(quantity: Quantity, function: str) -> str:
    """A call of a function of the ports."""
    return f"    {function}({', '.join([*quantity.inputs, *quantity.outputs])});"
