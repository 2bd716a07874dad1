"""What proofs share: columns of symbols, expressions without names, rates along a flow, and what is zero."""

from __future__ import annotations

import itertools

import sympy
from sympy import Matrix, symbols

from awiwi_gen.definitions.naming import definitions


def column(names: str) -> Matrix:
    return Matrix(symbols(names, real=True))


def spelled_out(expr):
    """An expression without the names of its derivation."""
    for name, meaning in reversed(definitions([expr])):
        expr = expr.xreplace({name: meaning})
    return expr


def vanishes(expr) -> bool:
    """Whether an expression is zero as a rational function."""
    return sympy.expand(sympy.fraction(sympy.together(spelled_out(expr)))[0]) == 0


def rate(expr, flow):
    """The rate of an expression while its symbols change as given."""
    expr = spelled_out(expr)
    return sum(expr.diff(symbol) * velocity for symbol, velocity in flow.items())


def shifts(*signals):
    """Each derivative of a signal is the rate of the one before it."""
    return {a: b for signal in signals for a, b in itertools.pairwise(signal)}
