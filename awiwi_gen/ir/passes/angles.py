"""Find the values that rotate with an angle: its cosine and sine, and other pairs that are made of them.

A pair is a*cos + b*sin and a*sin - b*cos for any a and b, such as the components of a rotating vector. A form is a term
of a sum that is a constant times one of a pair. Forms stay forms when a phase is added to the angle.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from fractions import Fraction

from awiwi_gen.ir.graph import Graph, Node, Ref, node_of, operands

Form = tuple[Fraction, Fraction]  # of cosine and sine
Square = tuple[Fraction, Fraction, Fraction]  # of their squares and product: cos^2, cos*sin, sin^2
Term = tuple[int, Form] | tuple[int, Square]  # the number of a pair, and a form in it
Terms = dict[int, Term]
Part = tuple[int, tuple[int, ...]]  # a sign and factors
Multiple = tuple[Form, Fraction, tuple[int, ...]]  # cosine or sine, a constant, and other factors
X, Y = (Fraction(1), Fraction(0)), (Fraction(0), Fraction(1))


@dataclass(frozen=True)
class Pair:
    """The signs and factors of a and b; there is no b where it is zero."""

    a: Part
    b: Part | None = None


@dataclass
class Angle:
    """The pairs that rotate with an angle, and the sums with forms: linear in all pairs, quadratic in the first."""

    argument: Ref
    pairs: list[Pair] = field(default_factory=lambda: [Pair((1, ()))])  # cosine and sine themselves come first
    linear: dict[tuple[int, int], Form] = field(default_factory=dict)  # by sum and pair
    square: dict[int, Square] = field(default_factory=dict)
    taken: dict[int, set[int]] = field(default_factory=dict)  # positions of these terms in each sum


class Reader:
    """Reads angles of one graph."""

    def __init__(self, graph: Graph) -> None:
        self.graph, self.nodes = graph, graph.nodes
        self.roots = {node_of(ref) for ref in graph.roots}
        self.parents: list[list[int]] = [[] for _ in graph.nodes]
        for index, node in enumerate(graph.nodes):
            for ref in operands(node):
                self.parents[node_of(ref)].append(index)

    def read(self, cosine: int, sine: int) -> Angle | None:
        """All uses of an angle's cosine and sine as terms of sums; None if there are others."""
        units = {cosine: X, sine: Y}
        users = {p for leaf in units for p in self.parents[leaf]}
        products = sorted(p for p in users if self.nodes[p][0] == "mul")
        if any(self.nodes[p][0] not in ("mul", "add") for p in users):
            return None
        if self.roots & units.keys() or not self._only_terms(products):
            return None
        angle = Angle(self.nodes[cosine][1])
        sums = self._sums(units | {p: form for p in products if (form := self._linear(p, units))})
        terms: Terms = {leaf: (0, unit) for leaf, unit in units.items()}
        multiples: dict[int, Multiple] = {}
        for p in products:
            if form := self._linear(p, units):
                terms[p] = 0, form
            elif square := self._square(p, units | sums):
                terms[p] = 0, square
            elif multiple := self._multiple(p, units):
                multiples[p] = multiple
            else:
                return None
        squares = {p for p, (_, form) in terms.items() if len(form) == 3}
        inner = {index for index in sums if index not in self.roots and squares.issuperset(self.parents[index])}
        self._vectors(angle, terms, multiples)
        self._multiples(angle, terms, multiples)
        holders = {p for term in terms for p in self.parents[term] if self.nodes[p][0] == "add"} - inner
        for index in sorted(holders):
            _collect(index, self.nodes[index], terms, angle)
        return angle

    def _only_terms(self, products: Iterable[int]) -> bool:
        """Whether nodes are used as terms of sums only."""
        return all(p not in self.roots and all(self.nodes[q][0] == "add" for q in self.parents[p]) for p in products)

    def _sums(self, forms: dict[int, Form]) -> dict[int, Form]:
        """The sums of nothing but terms of first degree."""
        sums: dict[int, Form] = {}
        for index, node in enumerate(self.nodes):
            if node[0] == "add" and all(node_of(ref) in forms for ref in node[1:]):
                parts = [_scaled(forms[node_of(ref)], 1 if ref >= 0 else -1) for ref in node[1:]]
                sums[index] = sum((x for x, _ in parts), Fraction(0)), sum((y for _, y in parts), Fraction(0))
        return sums

    def _vectors(self, angle: Angle, terms: Terms, multiples: dict[int, Multiple]) -> None:
        """Sums a*cos + b*sin and a*sin - b*cos become a pair; their products leave `multiples`."""
        found = {}
        for index in sorted({p for product in multiples for p in self.parents[product]}):
            if vector := self._vector(index, multiples):
                found[vector] = index
        for ((plus, a), (minus, b)), first in found.items():
            for sign in (1, -1):
                second = found.get(((-sign * minus, b), (sign * plus, a)), -1)
                if second > first:
                    angle.pairs.append(Pair((plus, a), (minus, b)))
                    for index, unit in ((first, X), (second, _scaled(Y, sign))):
                        terms[index] = len(angle.pairs) - 1, unit
                        for user in self.parents[index]:
                            if form := self._linear(user, {index: unit}):
                                terms[user] = len(angle.pairs) - 1, form
                        for ref in self.nodes[index][1:]:
                            del multiples[node_of(ref)]

    def _vector(self, index: int, multiples: dict[int, Multiple]) -> tuple[Part, Part] | None:
        """(a, b) if a node is a*cos + b*sin, and is used as a term of sums or with constants only."""
        refs, users = self.nodes[index][1:], self.parents[index]
        if len(refs) != 2 or index in self.roots:
            return None
        parts: dict[Form, Part] = {}
        for ref in refs:
            unit, factor, others = multiples.get(node_of(ref), (X, Fraction(0), ()))
            if factor == 1 and len(self.parents[node_of(ref)]) == 1:
                parts[unit] = (1 if ref >= 0 else -1, others)
        products = [user for user in users if self.nodes[user][0] != "add"]
        scaled = all(self._linear(user, {index: X}) for user in products) and self._only_terms(products)
        return (parts[X], parts[Y]) if len(parts) == 2 and scaled else None

    def _multiples(self, angle: Angle, terms: Terms, multiples: dict[int, Multiple]) -> None:
        """Products a*cos and a*sin are pairs for every a."""
        numbers: dict[tuple[int, ...], int] = {}
        for product, (unit, factor, others) in multiples.items():
            if others not in numbers:
                numbers[others] = len(angle.pairs)
                angle.pairs.append(Pair((1, others)))
            terms[product] = numbers[others], _scaled(unit, factor)

    def _linear(self, product: int, units: dict[int, Form]) -> Form | None:
        """A constant times one of the units."""
        node = self.nodes[product]
        if node[0] == "mul" and len(node) == 3 and self.nodes[node[1]][0] == "const" and node[2] in units:
            return _scaled(units[node[2]], self.nodes[node[1]][1])
        return None

    def _square(self, product: int, forms: dict[int, Form]) -> Square | None:
        """A product of two forms and a constant."""
        factor, refs = self._factors(product)
        if len(refs) != 2 or any(ref not in forms for ref in refs):
            return None
        (a, b), (c, d) = forms[refs[0]], forms[refs[1]]
        return factor * a * c, factor * (a * d + b * c), factor * b * d

    def _multiple(self, product: int, units: dict[int, Form]) -> Multiple | None:
        """A product with one unit among its factors."""
        factor, refs = self._factors(product)
        others = tuple(ref for ref in refs if ref not in units)
        if len(others) != len(refs) - 1:
            return None
        return next(units[ref] for ref in refs if ref in units), factor, others

    def _factors(self, product: int) -> tuple[Fraction, tuple[Ref, ...]]:
        """A product's constant and its other factors."""
        refs = self.nodes[product][1:]
        return (self.nodes[refs[0]][1], refs[1:]) if self.nodes[refs[0]][0] == "const" else (Fraction(1), refs)


def _scaled(form: Form, factor: Fraction | int) -> Form:
    return factor * form[0], factor * form[1]


def _collect(index: int, node: Node, terms: Terms, angle: Angle) -> None:
    """The part of a sum that an angle's terms make up."""
    totals: dict[tuple[int, int], list[Fraction]] = {}
    angle.taken[index] = set()
    for position, ref in enumerate(node[1:]):
        if node_of(ref) in terms:
            pair, term = terms[node_of(ref)]
            angle.taken[index].add(position)
            total = totals.setdefault((pair, len(term)), [Fraction(0)] * len(term))
            total[:] = [a + b if ref >= 0 else a - b for a, b in zip(total, term, strict=True)]
    for (pair, degree), total in totals.items():
        if any(total) and degree == 2:
            angle.linear[index, pair] = (total[0], total[1])
        elif any(total):
            angle.square[index] = (total[0], total[1], total[2])
