"""CasADi expressions into a graph, and graphs back into CasADi: the only file that looks inside CasADi."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from fractions import Fraction

import casadi as ca

from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Ref

_UNARY = {
    ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan", ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs",
}  # fmt: skip


def lower_casadi(
    builder: Builder, expressions: Sequence[ca.SX], leaves: Sequence[tuple[ca.SX, Sequence[Ref]]]
) -> list[list[Ref]]:
    """References to the elements of dense column-major-flattened ``expressions``, one list each.

    ``leaves`` pairs every free symbol vector with the references of its elements.
    """
    function = ca.Function("f", [symbol for symbol, _ in leaves], [ca.densify(e) for e in expressions])
    rules = _rules(builder)
    work: dict[int, Ref] = {}
    results: list[list[Ref]] = [[0] * e.numel() for e in expressions]
    for i in range(function.n_instructions()):
        operation = function.instruction_id(i)
        inputs, outputs = function.instruction_input(i), function.instruction_output(i)
        if operation == ca.OP_CONST:
            work[outputs[0]] = builder.const(Fraction(function.instruction_constant(i)))
        elif operation == ca.OP_INPUT:
            work[outputs[0]] = leaves[inputs[0]][1][inputs[1]]
        elif operation == ca.OP_OUTPUT:
            results[outputs[0]][outputs[1]] = work[inputs[0]]
        else:
            rule = rules.get(operation)
            if rule is None:
                raise TypeError(f"no C for CasADi's instruction {operation}")
            work[outputs[0]] = rule(*(work[k] for k in inputs))
    return results


def _rules(builder: Builder) -> dict[int, Callable[..., Ref]]:
    rules: dict[int, Callable[..., Ref]] = {
        ca.OP_ASSIGN: lambda a: a,
        ca.OP_NEG: lambda a: ~a,
        ca.OP_ADD: lambda a, b: builder.add((a, b)),
        ca.OP_SUB: builder.sub,
        ca.OP_MUL: lambda a, b: builder.mul((a, b)),
        ca.OP_DIV: builder.div,
        ca.OP_INV: builder.inv,
        ca.OP_SQ: lambda a: builder.mul((a, a)),
        ca.OP_TWICE: lambda a: builder.add((a, a)),
        ca.OP_SIGN: builder.sign,
        ca.OP_ATAN2: lambda a, b: builder.call("atan2", a, b),
        ca.OP_HYPOT: lambda a, b: builder.call("sqrt", builder.add((builder.mul((a, a)), builder.mul((b, b))))),
    }
    for operation, name in _UNARY.items():
        rules[operation] = lambda a, name=name: builder.call(name, a)
    return rules


class Expressions:
    """The algebra of CasADi expressions: the interpreter makes an expression that CasADi can differentiate."""

    def const(self, value: Fraction) -> ca.SX:
        """A constant, rounded to double."""
        return ca.SX(value.numerator / value.denominator)

    def call(self, operation: str, *args: ca.SX) -> ca.SX:
        """A function of the graph by its CasADi name."""
        result: ca.SX = getattr(ca, operation)(*args)
        return result

    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    div = staticmethod(operator.truediv)
