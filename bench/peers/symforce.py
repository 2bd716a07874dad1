"""SymForce: the same recursions, its C++ code generation with scalar arguments."""

from __future__ import annotations

import importlib.metadata
import tempfile
from pathlib import Path
from typing import Any

import symforce.symbolic as sf
from symforce import codegen
from symforce.values import Values

from bench.peers.formulas import outputs
from bench.peers.kit import Contender, make_all, names, scalar_call
from bench.peers.recursion import Algebra
from bench.quantities import Quantity

ALGEBRA = Algebra(sf.cos, sf.sin, lambda ys, x: [sf.sympify(y).diff(x) for y in ys])


def generate(quantity: Quantity, finger: dict[str, Any]) -> tuple[str, str]:
    """C++ of one quantity."""
    x = {port: [sf.Symbol(name) for name in all_] for port, all_ in names(quantity).items()}
    given, wanted = Values(), Values()
    for port, symbols in x.items():
        for i, symbol in enumerate(symbols):
            given[f"{port}{i}"] = symbol
    for port, entries in outputs(quantity.name, finger, x, ALGEBRA).items():
        for i, entry in enumerate(entries):
            wanted[f"{port}_out{i}"] = sf.sympify(entry)
    made = codegen.Codegen(inputs=given, outputs=wanted, config=codegen.CppConfig(), name=quantity.name)
    with tempfile.TemporaryDirectory() as scratch:
        (file,) = made.generate_function(output_dir=scratch).generated_files
        text = Path(file).read_text(encoding="utf-8")
    function = "sym::" + "".join(word.capitalize() for word in quantity.name.split("_"))
    # Functions of scalars use no matrices, and Eigen's headers take seconds for every file.
    text = text.replace("#pragma once", "#include <cmath>").replace("#include <Eigen/Core>", "")
    return text, scalar_call(quantity, f"{function}<double>", "&")


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities."""
    version = importlib.metadata.version("symforce")
    make_all(Contender("symforce", version, directory, language="c++"), finger, generate)
