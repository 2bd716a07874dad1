"""SymEngine: the same recursions, its own `cse` and C printer."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import symengine

from bench.peers.formulas import outputs
from bench.peers.kit import Contender, make_all, names, port_call, straight_line
from bench.peers.recursion import Algebra
from bench.quantities import Quantity

ALGEBRA = Algebra(symengine.cos, symengine.sin, lambda ys, x: [symengine.sympify(y).diff(x) for y in ys])


def generate(quantity: Quantity, finger: dict[str, Any]) -> tuple[str, str]:
    """C of one quantity."""
    x = {port: list(map(symengine.Symbol, all_)) for port, all_ in names(quantity).items()}
    results = outputs(quantity.name, finger, x, ALGEBRA)
    steps, reduced = symengine.cse([symengine.sympify(e) for entries in results.values() for e in entries])
    function = f"symengine_{quantity.name}_program"
    return straight_line(
        quantity, [(str(name), text(e)) for name, e in steps], [text(e) for e in reduced], function
    ), port_call(quantity, function)


def text(expression: Any) -> str:
    """C, squares and cubes as products: `pow` would be a call without -ffast-math."""
    return re.sub(
        r"pow\((\w+), (\d)\)", lambda m: "(" + "*".join([m[1]] * int(m[2])) + ")", symengine.ccode(expression)
    )


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities."""
    make_all(Contender("symengine", symengine.__version__, directory), finger, generate)
