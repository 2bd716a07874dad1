"""SymPy expressions into a graph: the only file that looks inside SymPy.

A symbol stands for whatever ``leaves`` says, or, when it carries a ``definition``, for that expression.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

import sympy

from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Ref

FUNCTIONS = {
    sympy.sin: "sin", sympy.cos: "cos", sympy.tan: "tan", sympy.asin: "asin", sympy.acos: "acos",
    sympy.atan: "atan", sympy.atan2: "atan2", sympy.exp: "exp", sympy.log: "log", sympy.Abs: "fabs",
}  # fmt: skip


def lower_sympy(builder: Builder, expressions: Iterable[sympy.Expr], leaves: Mapping[sympy.Symbol, Ref]) -> list[Ref]:
    """References to the given expressions; shared sub-expressions are visited once."""
    memo: dict[sympy.Expr, Ref] = dict(leaves)

    def lower(expression: sympy.Expr) -> Ref:
        found = memo.get(expression)
        if found is None:
            found = memo[expression] = make(expression)
        return found

    def make(expression: sympy.Expr) -> Ref:
        if isinstance(expression, sympy.Symbol):
            definition = getattr(expression, "definition", None)
            if definition is None:
                raise KeyError(f"symbol {expression} is neither an input nor a number of the hand")
            return lower(definition)
        if expression.is_Rational:
            return builder.const(Fraction(int(expression.p), int(expression.q)))
        if expression is sympy.pi:
            raise ValueError("pi has no exact value here: let the hand file or the C side supply the angle")
        if expression.is_Add:
            return builder.add([lower(a) for a in expression.args])
        if expression.is_Mul:
            return builder.mul([lower(a) for a in expression.args])
        if expression.is_Pow:
            return power(lower(expression.base), expression.exp)
        if expression.func is sympy.sign:
            return builder.sign(lower(expression.args[0]))
        name = FUNCTIONS.get(expression.func)
        if name is None:
            raise TypeError(f"no C for {expression.func.__name__} in {expression}")
        return builder.call(name, *(lower(a) for a in expression.args))

    def power(base: Ref, exponent: sympy.Expr) -> Ref:
        if not (exponent.is_Rational and exponent.q in (1, 2)):
            raise TypeError(f"no C for the power {exponent}")
        root = base if exponent.q == 1 else builder.call("sqrt", base)
        return builder.power(root, int(exponent.p))

    return [lower(sympy.sympify(expression)) for expression in expressions]
