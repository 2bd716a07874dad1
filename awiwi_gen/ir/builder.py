"""Making graphs: expressions brought into canonical form as they are written down."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from math import prod

from awiwi_gen.ir.graph import EVEN, ODD, Graph, Node, Output, Ref, canonical, node_of, operands, reachable

AT_ZERO = {"sin": 0, "cos": 1, "tan": 0, "asin": 0, "atan": 0, "exp": 1, "sqrt": 0, "fabs": 0}

ONE = Fraction(1)

# Sums of numbers that cancel to this many bits are zero: what is left of sin^2 + cos^2 - 1, with sines of 400 bits.
CANCELLED_BITS = 350

# Longer fractions are rounded to this many bits: far beyond the 200 bits at which passes are compared.
FRACTION_BITS = 512


class Builder:
    """Makes nodes in canonical form; equal expressions get equal references."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._index: dict[Node, int] = {}
        self._constants: dict[tuple[int, int], int] = {}

    # -- leaves -------------------------------------------------------------------------------------------

    def const(self, value: Fraction | int) -> Ref:
        """A constant; any sign."""
        if not isinstance(value, Fraction):
            value = Fraction(value)
        if value.denominator.bit_length() > FRACTION_BITS:
            value = shorten(value)
        name = (abs(value.numerator), value.denominator)  # their hash is quicker than that of a fraction
        index = self._constants.get(name)
        if index is None:
            index = self._constants[name] = len(self.nodes)
            self.nodes.append(("const", value if value.numerator >= 0 else -value))
        return index if value.numerator >= 0 else ~index

    def input(self, port: str, element: int) -> Ref:
        """Element number ``element`` (row by row) of an input port."""
        return self._intern(("input", port, element))

    def param(self, path: str) -> Ref:
        """A number of the hand, by its path in the hand file."""
        return self._intern(("param", path))

    def value(self, ref: Ref) -> Fraction | None:
        """The value of a reference to a constant; None for anything else."""
        node = self.nodes[node_of(ref)]
        if node[0] != "const":
            return None
        value: Fraction = node[1]
        return value if ref >= 0 else -value

    # -- arithmetic ---------------------------------------------------------------------------------------

    def add(self, refs: Iterable[Ref]) -> Ref:
        """The sum of any number of references; like terms are collected."""
        refs = list(refs)
        if self._all_unlike(refs):
            refs.sort(key=node_of if min(refs, default=0) < 0 else None)
            return self._sum(refs)
        coefficients: dict[int, Fraction] = {}
        constant = Fraction(0)
        for ref in refs:
            coefficient, base = self.split(ref)
            if base is None:
                constant = _sum(constant, coefficient)
            else:
                coefficients[base] = _sum(coefficients[base], coefficient) if base in coefficients else coefficient
        terms = [self.scaled(c, base) for base, c in coefficients.items() if c]
        terms.sort(key=node_of)
        if constant:
            terms.append(self.const(constant))
        return self._sum(terms)

    def _all_unlike(self, refs: list[Ref]) -> bool:
        """Whether no two terms differ by a rational factor only, and none is a constant: the common case."""
        nodes, seen = self.nodes, set()
        for ref in refs:
            base = ref if ref >= 0 else ~ref
            node = nodes[base]
            if node[0] == "const":
                return False
            if node[0] == "mul" and nodes[node[1]][0] == "const":
                seen.add(node[2:] if len(node) > 3 else node[2])
            else:
                seen.add(node[1:] if node[0] == "mul" else base)
        return len(seen) == len(refs)

    def _sum(self, terms: list[Ref]) -> Ref:
        if not terms:
            return self.const(0)
        if len(terms) == 1:
            return terms[0]
        if terms[0] < 0:
            return ~self._intern(("add", *(~t for t in terms)))
        return self._intern(("add", *terms))

    def mul(self, refs: Sequence[Ref]) -> Ref:
        """The product of any number of references; powers are collected, numbers multiplied."""
        nodes = self.nodes
        signed = min(refs, default=0) < 0
        factors = [ref if ref >= 0 else ~ref for ref in refs] if signed else list(refs)
        kinds = {nodes[factor][0] for factor in factors}
        coefficient = ONE
        if "const" in kinds:
            coefficient, factors = self._numbers(factors)
            if not coefficient:
                return self.const(0)
            kinds = {nodes[factor][0] for factor in factors}
        if "inv" in kinds:
            factors = self._powers(factors)
        product = self._product(coefficient, factors)
        return ~product if signed and sum([ref < 0 for ref in refs]) % 2 else product

    def _numbers(self, factors: list[int]) -> tuple[Fraction, list[int]]:
        """Factors with those that are numbers, or have one of their own, taken apart: their product, and the rest."""
        numbers: list[Fraction] = []
        rest: list[int] = []
        for factor in factors:
            node = self.nodes[factor]
            if node[0] == "const":
                numbers.append(node[1])
            elif node[0] == "mul" and self.nodes[node[1]][0] == "const":
                numbers.append(self.nodes[node[1]][1])
                rest += node[2:]
            else:
                rest.append(factor)
        return (numbers[0] if len(numbers) == 1 else prod(numbers, start=ONE)), rest

    def _powers(self, factors: list[int]) -> list[int]:
        """Factors of which none is the reciprocal of another."""
        powers: dict[int, int] = {}
        for factor in factors:
            node = self.nodes[factor]
            base, power = (node[1], -1) if node[0] == "inv" else (factor, 1)
            powers[base] = powers.get(base, 0) + power
        left: list[int] = []
        for base, power in powers.items():
            left += [base] * power if power > 0 else [self.inv(base)] * -power
        return left

    def inv(self, ref: Ref) -> Ref:
        """The reciprocal."""
        if ref < 0:
            return ~self.inv(~ref)
        node = self.nodes[ref]
        if node[0] == "const" and node[1]:
            return self.const(1 / node[1])
        if node[0] == "inv":
            return int(node[1])
        if node[0] == "mul" and self.value(node[1]) is not None:  # keep numbers out of denominators
            rest = self._product(ONE, list(node[2:]))
            return self._product(1 / self.nodes[node[1]][1], [self.inv(rest)])
        return self._intern(("inv", ref))

    def sub(self, a: Ref, b: Ref) -> Ref:
        """``a - b``."""
        return self.add((a, ~b))

    def div(self, a: Ref, b: Ref) -> Ref:
        """``a / b``, as a product with a reciprocal."""
        return self.mul((a, self.inv(b)))

    def power(self, base: Ref, exponent: int) -> Ref:
        """An integer power."""
        return self.mul([base] * exponent) if exponent >= 0 else self.inv(self.mul([base] * -exponent))

    def call(self, operation: str, *refs: Ref) -> Ref:
        """A function such as ``sin`` or ``atan2``; the signs of odd and even functions are pulled out."""
        if operation in EVEN:
            refs = tuple(node_of(ref) for ref in refs)
        elif operation in ODD and refs[0] < 0:
            return ~self.call(operation, ~refs[0])
        if all(self.value(ref) == 0 for ref in refs) and operation in AT_ZERO:
            return self.const(AT_ZERO[operation])
        if operation == "sqrt" and self.value(refs[0]) == 1:
            return refs[0]
        return self._intern((operation, *refs))

    def sign(self, ref: Ref) -> Ref:
        """1 or -1; not a number at zero."""
        return self.div(ref, self.call("fabs", ref))

    def make(self, operation: str, refs: Sequence[Ref]) -> Ref:
        """Any operation by name: what a pass uses to rebuild a node."""
        if operation == "add":
            return self.add(refs)
        if operation == "mul":
            return self.mul(refs)
        if operation == "inv":
            return self.inv(refs[0])
        if operation == "div":
            return self.div(*refs)
        return self.call(operation, *refs)

    # -- taking terms apart -------------------------------------------------------------------------------

    def split(self, ref: Ref) -> tuple[Fraction, int | None]:
        """A term as (rational coefficient, the rest); the rest of a constant is None."""
        sign = 1 if ref >= 0 else -1
        base = node_of(ref)
        node = self.nodes[base]
        if node[0] == "const":
            return sign * node[1], None
        if node[0] == "mul" and self.nodes[node[1]][0] == "const":
            return sign * self.nodes[node[1]][1], self._product(ONE, list(node[2:]))
        return Fraction(sign), base

    def scaled(self, coefficient: Fraction, base: int) -> Ref:
        """``coefficient * base`` for a base without coefficient of its own."""
        if coefficient == 1:
            return base
        if coefficient == -1:
            return ~base
        node = self.nodes[base]
        return self._product(coefficient, list(node[1:]) if node[0] == "mul" else [base])

    def _product(self, coefficient: Fraction | int, factors: list[Ref]) -> Ref:
        if coefficient.numerator < 0:
            return ~self._product(-coefficient, factors)
        ordered = sorted(factors)
        if coefficient is not ONE and coefficient != 1:
            ordered.insert(0, self.const(coefficient))
        if not ordered:
            return self.const(1)
        return ordered[0] if len(ordered) == 1 else self._intern(("mul", *ordered))

    def _intern(self, node: Node) -> int:
        index = self._index.get(node)
        if index is None:
            index = self._index[node] = len(self.nodes)
            self.nodes.append(node)
        return index

    # -- finishing ----------------------------------------------------------------------------------------

    def graph(self, outputs: Iterable[Output]) -> Graph:
        """The graph of these outputs: unreachable nodes dropped, the rest in canonical order."""
        return canonical(Graph(tuple(self.nodes), tuple(outputs)))


def _sum(a: Fraction, b: Fraction) -> Fraction:
    total = a + b
    return total if _exponent(total) > _exponent(b) - CANCELLED_BITS else Fraction(0)


def _exponent(value: Fraction) -> int:
    """About the binary logarithm."""
    return value.numerator.bit_length() - value.denominator.bit_length()


def shorten(value: Fraction) -> Fraction:
    """The fraction itself, or a dyadic neighbour when exact arithmetic has made it very long."""
    excess = value.denominator.bit_length() - FRACTION_BITS
    if excess <= 0 or value.numerator == 0:
        return value
    scale = FRACTION_BITS + max(0, value.denominator.bit_length() - value.numerator.bit_length())
    return Fraction(round(value * (1 << scale)), 1 << scale)


def rebuild(graph: Graph, rule: Callable[[Builder, Node, tuple[Ref, ...]], Ref]) -> Graph:
    """Replay a graph node by node: ``rule(builder, old node, new operands)`` returns the new reference."""
    builder = Builder()
    renamed: list[Ref] = [0] * len(graph.nodes)
    for index, (node, marked) in enumerate(zip(graph.nodes, reachable(graph), strict=True)):
        if marked:
            refs = [renamed[ref] if ref >= 0 else ~renamed[~ref] for ref in operands(node)]
            renamed[index] = rule(builder, node, tuple(refs))
    return builder.graph(output.renamed(renamed) for output in graph.outputs)


def copy_node(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
    """The rule that changes nothing."""
    if node[0] == "const":
        return builder.const(node[1])
    if node[0] == "input":
        return builder.input(node[1], node[2])
    if node[0] == "param":
        return builder.param(node[1])
    return builder.make(node[0], refs)
