"""Formulas for readers: the definition of a kernel, typeset in Unicode for a terminal or in LaTeX for a page."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from math import prod
from typing import Any

import sympy
from sympy.printing.latex import LatexPrinter, greek_letters_set

from awiwi_gen.emit.c import Printer
from awiwi_gen.emit.options import Options
from awiwi_gen.formulas import formulas, numbers
from awiwi_gen.ir.graph import Graph
from awiwi_gen.kernel import GUARDS, Kernel

READABLE = 160  # nodes of a definition that somebody may want to read
UNSHARED = 120  # operations of formulas whose shared parts have no names
COLUMNS = 74  # of text
PAGE = 900  # characters of the LaTeX of a matrix that fits on a page
GREEK = greek_letters_set - {"omicron", "upsilon"}

Equation = tuple[sympy.Symbol, Any]


class _Latex(LatexPrinter):  # type: ignore[misc]
    """Words upright, and all indices of a name below it: k_eff of a second joint is k with eff,1."""

    def _print_Symbol(self, expr: Any, style: str = "plain") -> str:  # noqa: N802 SymPy calls it so
        if "[" in expr.name:  # a path in the hand file
            return rf"\mathrm{{{expr.name}}}"
        name, *below = re.split(r"[_,]", expr.name)
        letters = name.rstrip("0123456789")
        below = [name[len(letters) :]] * (letters != name) + below
        shown = rf"\{letters}" if letters in GREEK else rf"\mathrm{{{letters}}}" if len(letters) > 1 else letters
        indices = ",".join(rf"\mathrm{{{each}}}" if each.isalpha() else each for each in below)
        return f"{shown}_{{{indices}}}" if indices else shown


def is_readable(graph: Graph) -> bool:
    """Whether a definition is short enough to be read as formulas."""
    return len(graph.nodes) <= READABLE


def latex(kernel: Kernel, graph: Graph) -> list[str]:
    """Equations for the named parts, then for the outputs: matrices whole where they fit on a page, else their elements."""
    printer = _Latex()

    def equation(left: sympy.Symbol, right: Any) -> str:
        return f"{printer.doprint(left)} = {printer.doprint(right)}"

    return [
        equation(*each)
        for left, right in equations(kernel, graph)
        for each in ([(left, right)] if len(printer.doprint(right)) <= PAGE else elements(left, right))
    ]


def text(kernel: Kernel, graph: Graph) -> list[str]:
    """The same as lines of Unicode of at most `COLUMNS` characters; wide fractions are written in one line."""
    lines: list[str] = []
    for left, right in equations(kernel, graph):
        drawn = _drawn(left, right)
        if max(map(len, drawn)) > COLUMNS:
            drawn = [line for each in elements(left, right) for line in _narrow(*each)]
        lines += [line.rstrip() for line in drawn]
    return lines


def _narrow(left: sympy.Symbol, right: Any) -> list[str]:
    drawn = _drawn(left, right)
    if max(map(len, drawn)) <= COLUMNS:
        return drawn
    return textwrap.wrap(f"{left} = {right}", COLUMNS, subsequent_indent="    ", break_long_words=False)


def _drawn(left: sympy.Symbol, right: Any) -> list[str]:
    drawn: str = sympy.pretty(sympy.Eq(left, right, evaluate=False), use_unicode=True, wrap_line=False)
    return drawn.splitlines()


def equations(kernel: Kernel, graph: Graph) -> Iterator[Equation]:
    """Names and expressions, parts before the outputs that are made of them; conditions are left out."""
    scalars = [name for name, port in kernel.inputs.items() if port.size == 1]
    shown = Graph(graph.nodes, tuple(output for output in graph.outputs if output.name != GUARDS))
    parts, found = formulas(shown, UNSHARED, scalars)
    yield from parts
    for output in shown.outputs:
        yield from _arrays(output.name, output.shape, found[output.name])


def _arrays(name: str, shape: tuple[int, ...], values: Sequence[Any]) -> Iterator[Equation]:
    """Matrices for the last two axes, elements of everything else."""
    if prod(shape) == 1:
        yield sympy.Symbol(name, real=True), values[0]
        return
    inner = shape[-2:] if len(shape) > 1 else ()
    size = prod(inner)
    for index in range(prod(shape) // size):
        indexed = sympy.Symbol(f"{name}_{index}" if len(shape) != 2 else name, real=True)
        piece = values[index * size : (index + 1) * size]
        yield indexed, sympy.ImmutableMatrix(*inner, piece) if inner else piece[0]


def elements(left: sympy.Symbol, right: Any) -> list[Equation]:
    """The elements of a matrix that are not zero, one by one; anything else as it is."""
    if not isinstance(right, sympy.MatrixBase):
        return [(left, right)]
    separator = "," if "_" in left.name else "_"
    return [
        (sympy.Symbol(f"{left.name}{separator}{row},{column}", real=True), right[row, column])
        for row in range(right.rows)
        for column in range(right.cols)
        if right[row, column] != 0
    ]


def symbols(graph: Graph) -> dict[str, str]:
    """What the numbers of the hand are called in `text`, by their paths."""
    return {path: sympy.pretty(symbol, use_unicode=True) for path, symbol in numbers(graph).items()}


def assignments(graph: Graph) -> list[str]:
    """Lines such as ``t0 = q[0]*pulleys[0].radius``."""
    lines = Names(graph, Options(math="libm"), "").statements()
    return [line.removeprefix("const double ").rstrip(";") for line in lines]


class Names(Printer):
    """Prints numbers of the hand by their path in the hand file, and ports by their own names."""

    def input_element(self, port: str, element: int) -> str:
        """``q[2]``."""
        return f"{port}[{element}]"

    output_element = input_element

    def parameter(self, path: str) -> str:
        """``links[1].mass`` as in the file."""
        return path
