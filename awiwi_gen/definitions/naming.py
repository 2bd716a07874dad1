"""Named subexpressions, and derivatives through them.

SymPy writes expressions as trees: a rotation used nine times is written nine times, and its derivative many times
more. A `Named` symbol stands for a subexpression and holds its definition, so a derivation stays as small as its graph.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import sympy
from sympy import Expr


class Named(sympy.Dummy):  # type: ignore[misc]
    """A real symbol that stands for its `definition`; lowering to a graph replaces it."""

    __slots__ = ("definition",)
    definition: Expr

    def __new__(cls, name: str, definition: Expr) -> "Named":
        """A new symbol, different from all others, even of the same name."""
        named: Named = super().__new__(cls, name, real=True)
        named.definition = definition
        return named


class Held(Named):
    """A named subexpression that counts as constant in derivatives."""

    __slots__ = ()


class Derivation:
    """The names and the derivatives of one derivation.

    Names are numbered from zero and SymPy sorts symbols by name. So the same derivation always gives the same
    expressions, whatever was derived before it.
    """

    def __init__(self, prefix: str = "t") -> None:
        self._prefix = prefix
        self._names: dict[Expr, Named] = {}
        self._known: dict[frozenset[tuple[Expr, Expr]], dict[Expr, Expr]] = {}

    def name(self, expr: Expr) -> Expr:
        """A symbol that stands for `expr`; atoms and negative atoms are returned as they are."""
        if expr.is_Atom or (expr.is_Mul and len(expr.args) == 2 and expr.args[0] == -1 and expr.args[1].is_Atom):
            return expr
        if expr not in self._names:
            self._names[expr] = Named(f"{self._prefix}{len(self._names):05d}", expr)
        return self._names[expr]

    def hold(self, expr: Expr) -> Expr:
        """A symbol that stands for `expr` and counts as constant in derivatives."""
        key = sympy.Function("held")(expr)
        if key not in self._names:
            self._names[key] = Held(f"{self._prefix}{len(self._names):05d}", expr)
        return self._names[key]

    def name_all(self, matrix: sympy.Matrix) -> sympy.Matrix:
        """`name` applied to each entry of a matrix."""
        return matrix.applyfunc(self.name)

    def partial(self, expr: Expr, symbol: Expr) -> Expr:
        """Derivative of `expr` with respect to a symbol, through all names."""
        return self.along(expr, {symbol: sympy.S.One})

    def along(self, expr: Expr, rates: Mapping[Expr, Expr]) -> Expr:
        """Rate of `expr` where symbols have the given rates and all others are constant, through all names."""
        return self._rate(expr, self._known.setdefault(frozenset(rates.items()), dict(rates)))

    def _rate(self, expr: Expr, known: dict[Expr, Expr]) -> Expr:
        """The chain rule, once for each shared subexpression; `known` starts with the rates of the symbols."""
        if expr not in known:
            known[expr] = self._chain_rule(expr, known)
        return known[expr]

    def _chain_rule(self, expr: Expr, known: dict[Expr, Expr]) -> Expr:
        if isinstance(expr, Held):
            return sympy.S.Zero
        if isinstance(expr, Named):
            return self.name(self._rate(expr.definition, known))
        rates = [self._rate(arg, known) for arg in expr.args]
        if not any(rates):
            return sympy.S.Zero
        if expr.is_Add:
            return _sum(rates)
        if expr.is_Mul:
            factors = expr.args
            return _sum([_product(*factors[:i], rate, *factors[i + 1 :]) for i, rate in enumerate(rates) if rate])
        slopes = self._power_slope(expr) if expr.is_Pow else self._function_slopes(expr)
        return _sum([_product(slope, rate) for slope, rate in zip(slopes, rates, strict=True) if slope and rate])

    def _function_slopes(self, call: Expr) -> tuple[Expr, ...]:
        if call.func not in _SLOPES:
            raise ValueError(f"{call} has no derivative here")
        return _SLOPES[call.func](*call.args)

    def _power_slope(self, power: Expr) -> tuple[Expr, Expr]:
        base, exponent = power.args
        if not exponent.is_Number:
            raise ValueError(f"{power} has an exponent that is not a number")
        # Derivatives of roots and reciprocals use the root or reciprocal itself.
        if exponent is sympy.S.Half:
            return self.name(1 / self.name(power)) / 2, sympy.S.Zero
        if exponent is sympy.S.NegativeOne:
            return -(self.name(power) ** 2), sympy.S.Zero
        return exponent * base ** (exponent - 1), sympy.S.Zero


def _sum(terms: list[Expr]) -> Expr:
    """A sum without simplification: the graph has its own canonical form, and SymPy would need ten times as long."""
    parts = [part for term in terms if term for part in (term.args if term.is_Add else (term,))]
    return sympy.Add._from_args(parts, is_commutative=True) if len(parts) > 1 else parts[0] if parts else sympy.S.Zero


def _product(*factors: Expr) -> Expr:
    """A product without simplification but for its numbers, which become one first factor, as in SymPy's own products."""
    number, others = sympy.S.One, []
    for factor in factors:
        for part in factor.args if factor.is_Mul else (factor,):
            if part.is_Number:
                number *= part
            else:
                others.append(part)
    if number is not sympy.S.One:
        others.insert(0, number)
    return (
        sympy.Mul._from_args(others, is_commutative=True) if len(others) > 1 else others[0] if others else sympy.S.One
    )


# Partial derivatives of functions by each of their arguments.
_SLOPES: dict[Any, Callable[..., tuple[Expr, ...]]] = {
    sympy.sin: lambda x: (sympy.cos(x),),
    sympy.cos: lambda x: (-sympy.sin(x),),
    sympy.tan: lambda x: (1 + sympy.tan(x) ** 2,),
    sympy.asin: lambda x: (1 / sympy.sqrt(1 - x**2),),
    sympy.acos: lambda x: (-1 / sympy.sqrt(1 - x**2),),
    sympy.atan: lambda x: (1 / (1 + x**2),),
    sympy.atan2: lambda y, x: (x / (x**2 + y**2), -y / (x**2 + y**2)),
    sympy.exp: lambda x: (sympy.exp(x),),
    sympy.log: lambda x: (1 / x,),
    sympy.sign: lambda x: (sympy.S.Zero,),
}


def definitions(expressions: Iterable[Expr]) -> list[tuple[Named, Expr]]:
    """All names in `expressions`, direct or not, with their definitions; each after the names that it uses."""
    found: dict[Named, Expr] = {}

    def visit(expr: Expr) -> None:
        for named in sorted(expr.atoms(Named), key=lambda symbol: (symbol.name, symbol.dummy_index)):
            if named not in found:
                visit(named.definition)
                found[named] = named.definition

    for expression in expressions:
        visit(expression)
    return list(found.items())


def jacobian(vector: Iterable[Expr], symbols: Iterable[Expr]) -> sympy.Matrix:
    """Partial derivatives (len(vector) x len(symbols)) through all names."""
    chain, columns = Derivation(), list(symbols)
    return sympy.Matrix([[chain.partial(element, symbol) for symbol in columns] for element in vector])
