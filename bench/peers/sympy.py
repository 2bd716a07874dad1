"""SymPy: the same recursions, `cse` of everything together, the C printer; powers printed as products.

Its expressions are trees, so the recursions name their steps, as one does who wants to see the end of `cse`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import sympy
from sympy.codegen.rewriting import create_expand_pow_optimization

from bench.peers.formulas import outputs
from bench.peers.kit import Contender, make_all, names, port_call, straight_line
from bench.peers.recursion import Algebra
from bench.quantities import Quantity


class Naming:
    """Symbols for subexpressions, equal ones once."""

    def __init__(self) -> None:
        self.meaning: dict[Any, Any] = {}
        self.symbols: dict[Any, Any] = {}

    def __call__(self, x: Any) -> Any:
        """A symbol for an expression; what is no sum or product stays."""
        if getattr(x, "is_Atom", True) or (-x).is_Atom:
            return x
        if x not in self.symbols:
            self.symbols[x] = sympy.Symbol(f"n{len(self.symbols)}")
            self.meaning[self.symbols[x]] = x
        return self.symbols[x]


def generate(quantity: Quantity, finger: dict[str, Any]) -> tuple[str, str]:
    """C of one quantity."""
    naming = Naming()
    algebra = Algebra(sympy.cos, sympy.sin, name=naming)
    x = {port: list(map(sympy.Symbol, all_)) for port, all_ in names(quantity).items()}
    ports = outputs(quantity.name, finger, x, algebra)
    entries = [sympy.sympify(entry) for port in ports.values() for entry in port]
    shared, reduced = sympy.cse([*naming.meaning.values(), *entries], symbols=sympy.numbered_symbols("t"))
    meaning = dict(shared) | dict(zip(naming.meaning, reduced[: len(naming.meaning)], strict=True))
    results = reduced[len(naming.meaning) :]
    products = create_expand_pow_optimization(4)

    def text(expression: Any) -> str:
        return str(sympy.ccode(products(sympy.sympify(expression))))

    steps = [(str(symbol), text(meaning[symbol])) for symbol in _ordered(meaning, results)]
    function = f"sympy_{quantity.name}_program"
    return straight_line(quantity, steps, [text(e) for e in results], function), port_call(quantity, function)


def _ordered(meaning: dict[Any, Any], results: list[Any]) -> list[Any]:
    """The symbols that the results need, each after those it is made of."""
    order: dict[Any, None] = {}

    def visit(expression: Any) -> None:
        for symbol in sorted(expression.free_symbols, key=str):
            if symbol in meaning and symbol not in order:
                visit(meaning[symbol])
                order[symbol] = None

    for result in results:
        visit(result)
    return list(order)


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities."""
    make_all(Contender("sympy", sympy.__version__, directory), finger, generate)
