"""Turn the axes in which an angle is measured: ``a*cos(x) + b*sin(x)`` is ``hypot(a, b)*cos(x + phase)``.

A body's moments are pairs of such sums, (a, b) and (-b, a), so one added constant saves two products and two sums. All
else that reads this sine and cosine must be of first or second degree in them with constant coefficients, for then it
keeps its form in other axes; angles of which this is not so are left alone.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from fractions import Fraction

from flint import arb, ctx, fmpq

from awiwi_gen.ir.builder import Builder, copy_node, rebuild, shorten
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import Graph, Node, Ref, node_of, operands

BITS = 400
EXACT = Fraction(1, 1 << 300)  # what is smaller than this part of its form is zero but for rounding
Form = tuple[Fraction, Fraction]  # of cosine and sine
Square = tuple[Fraction, Fraction, Fraction]  # of their squares and product: cos^2, cos*sin, sin^2
Part = tuple[int, tuple[int, ...]]  # a sign and factors
Swing = tuple[Form, Fraction, tuple[int, ...]]  # cosine or sine, a constant and other factors
_X, _Y = (Fraction(1), Fraction(0)), (Fraction(0), Fraction(1))


@dataclass(frozen=True)
class _Pair:
    """Two values that turn with an angle as its cosine and sine do: a*cos + b*sin and a*sin - b*cos.

    Of a and b signs and factors are given; there is no b where it is zero.
    """

    a: Part
    b: Part | None = None


@dataclass
class _Angle:
    """An angle's cosine and sine, what else turns so, and the sums of terms in them: of first and second degree."""

    argument: Ref
    pairs: list[_Pair] = field(default_factory=lambda: [_Pair((1, ()))])
    linear: dict[tuple[int, int], Form] = field(default_factory=dict)  # by sum, and by pair
    square: dict[int, Square] = field(default_factory=dict)  # of cosine and sine
    taken: dict[int, set[int]] = field(default_factory=dict)  # the places of these terms in each sum


Terms = dict[int, tuple[int, Form | Square]]  # for a node, of which pair it is a form, and which


class _Reader:
    """Reads of a graph what turns with an angle."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.roots = {node_of(ref) for ref in graph.roots}
        self.parents: list[list[int]] = [[] for _ in graph.nodes]
        for index, node in enumerate(graph.nodes):
            for ref in operands(node):
                self.parents[node_of(ref)].append(index)

    def read(self, cosine: int, sine: int) -> _Angle | None:
        """All uses of an angle's cosine and sine as terms of sums; None if there are others."""
        graph, units = self.graph, {cosine: _X, sine: _Y}
        users = {p for leaf in units for p in self.parents[leaf]}
        products = sorted(p for p in users if graph.nodes[p][0] == "mul")
        if self.roots & units.keys() or not self._terms_only(products):
            return None
        if any(graph.nodes[p][0] not in ("mul", "add") for p in users):
            return None
        angle = _Angle(graph.nodes[cosine][1])
        terms: Terms = {leaf: (0, unit) for leaf, unit in units.items()}
        terms |= {p: (0, form) for p in products if (form := _linear(graph, p, units))}
        sums = self._sums(terms)
        terms |= {p: (0, form) for p in products if p not in terms and (form := _square(graph, p, units | sums))}
        squares = {p for p, (_, form) in terms.items() if len(form) == 3}
        inner = {index for index in sums if index not in self.roots and squares.issuperset(self.parents[index])}
        swings = {p: _swing(graph, p, units) for p in products if p not in terms}
        if None in swings.values():
            return None
        self._companions(angle, terms, swings)
        holders = {p for term in terms for p in self.parents[term] if graph.nodes[p][0] == "add"} - inner
        for index in sorted(holders):
            _collect(index, graph.nodes[index], terms, angle)
        return angle

    def _terms_only(self, products: Iterable[int]) -> bool:
        """Whether nodes are used as terms of sums only."""
        nodes = self.graph.nodes
        return all(p not in self.roots and all(nodes[q][0] == "add" for q in self.parents[p]) for p in products)

    def _sums(self, terms: Terms) -> dict[int, Form]:
        """The sums of nothing but terms of first degree."""
        sums: dict[int, Form] = {}
        for index, node in enumerate(self.graph.nodes):
            if node[0] == "add" and all(node_of(r) in terms for r in node[1:]):
                parts = [[(1 if r >= 0 else -1) * x for x in terms[node_of(r)][1]] for r in node[1:]]
                sums[index] = (sum((p[0] for p in parts), Fraction(0)), sum((p[1] for p in parts), Fraction(0)))
        return sums

    def _companions(self, angle: _Angle, terms: Terms, swings: dict[int, Swing]) -> None:
        """What else turns with the angle: sums a*cos + b*sin beside a*sin - b*cos, and products a*cos, a*sin."""
        vectors = {}
        for index in sorted({p for product in swings for p in self.parents[product]}):
            if vector := self._vector(index, swings):
                vectors[vector] = index
        for ((plus, a), (minus, b)), index in vectors.items():
            for sign in (1, -1):
                other = vectors.get(((-sign * minus, b), (sign * plus, a)))
                if other is not None and index < other:
                    angle.pairs.append(_Pair((plus, a), (minus, b)))
                    for one, unit in ((index, _X), (other, _scaled(_Y, sign))):
                        terms[one] = len(angle.pairs) - 1, unit
                        terms |= {q: (len(angle.pairs) - 1, _linear(self.graph, q, {one: unit})) for q in self.parents[one] if self.graph.nodes[q][0] == "mul"}
                        for ref in self.graph.nodes[one][1:]:
                            del swings[node_of(ref)]
        numbers: dict[tuple[int, ...], int] = {}
        for product, (unit, factor, others) in swings.items():
            if others not in numbers:
                numbers[others] = len(angle.pairs)
                angle.pairs.append(_Pair((1, others)))
            terms[product] = numbers[others], _scaled(unit, factor)

    def _vector(self, index: int, swings: dict[int, Swing]) -> tuple[Part, Part] | None:
        """(a, b) if a node is a*cos + b*sin and its multiples are terms of sums only."""
        nodes, parts = self.graph.nodes, {}
        for ref in nodes[index][1:]:
            unit, factor, others = swings.get(node_of(ref), (_X, Fraction(0), ()))
            if factor != 1 or len(self.parents[node_of(ref)]) > 1:
                return None
            parts[unit] = (1 if ref >= 0 else -1, others)
        multiples = [q for q in self.parents[index] if nodes[q][0] != "add"]
        constant = all(nodes[q][0] == "mul" and len(nodes[q]) == 3 and nodes[nodes[q][1]][0] == "const" for q in multiples)
        if len(nodes[index]) != 3 or len(parts) != 2 or index in self.roots or not constant or not self._terms_only(multiples):
            return None
        return parts[_X], parts[_Y]


def turn(graph: Graph) -> Graph:
    """The same graph with angles measured from where most terms vanish."""
    reader = _Reader(graph)
    found = {(node[0], node[1]): index for index, node in enumerate(graph.nodes) if node[0] in ("cos", "sin")}
    for (name, argument), cosine in found.items():
        if name == "cos" and ("sin", argument) in found:
            angle = reader.read(cosine, found["sin", argument])
            phase = _best(angle) if angle else None
            turned = _turned(graph, angle, phase) if angle and phase else graph
            if _operations(turned) < _operations(graph):
                return turn(turned)
    return graph


def _operations(graph: Graph) -> int:
    spent = cost(graph)
    return spent.add + spent.mul


def _collect(index: int, node: Node, terms: Terms, angle: _Angle) -> None:
    """The part of a sum that an angle's terms make up."""
    totals: dict[tuple[int, int], list[Fraction]] = {}
    angle.taken[index] = set()
    for place, ref in enumerate(node[1:]):
        if node_of(ref) in terms:
            pair, term = terms[node_of(ref)]
            angle.taken[index].add(place)
            total = totals.setdefault((pair, len(term)), [Fraction(0)] * len(term))
            total[:] = [a + b if ref >= 0 else a - b for a, b in zip(total, term, strict=True)]
    for (pair, degree), total in totals.items():
        if any(total) and degree == 2:
            angle.linear[index, pair] = (total[0], total[1])
        elif any(total):
            angle.square[index] = (total[0], total[1], total[2])


def _linear(graph: Graph, product: int, units: dict[int, Form]) -> Form | None:
    refs = graph.nodes[product][1:]
    if len(refs) == 2 and graph.nodes[refs[0]][0] == "const" and refs[1] in units:
        return _scaled(units[refs[1]], graph.nodes[refs[0]][1])
    return None


def _swing(graph: Graph, product: int, units: dict[int, Form]) -> Swing | None:
    """A product with cosine or sine among its factors once: which, the constant, and the other factors."""
    refs = list(graph.nodes[product][1:])
    factor = graph.nodes[refs.pop(0)][1] if graph.nodes[refs[0]][0] == "const" else Fraction(1)
    others = tuple(ref for ref in refs if ref not in units)
    if len(others) != len(refs) - 1:
        return None
    return next(units[ref] for ref in refs if ref in units), factor, others


def _scaled(form: Form, factor: Fraction | int) -> Form:
    return factor * form[0], factor * form[1]


def _square(graph: Graph, product: int, forms: dict[int, Form]) -> Square | None:
    refs = list(graph.nodes[product][1:])
    factor = graph.nodes[refs.pop(0)][1] if graph.nodes[refs[0]][0] == "const" else Fraction(1)
    if len(refs) != 2 or any(r not in forms for r in refs):
        return None
    (a, b), (c, d) = forms[refs[0]], forms[refs[1]]
    return factor * a * c, factor * (a * d + b * c), factor * b * d


def _best(angle: _Angle) -> Form | None:
    """Cosine and sine of the phase at which most terms vanish, if they are worth one addition."""
    candidates = [unit for form in angle.linear.values() if all(form) for unit in [_direction(form)]]
    here = _terms(angle, (Fraction(1), Fraction(0)))
    best = min(candidates, key=lambda unit: _terms(angle, unit), default=None)
    return best if best and _terms(angle, best) < here else None


def _direction(form: Form) -> Form:
    """The phase (cosine, sine) at which a form has no sine."""
    with ctx.workprec(BITS):
        a, b = (arb(fmpq(x.numerator, x.denominator)) for x in form)
        length = (a * a + b * b).sqrt()
        return _fraction(a / length), _fraction(-b / length)


def _fraction(x: arb) -> Fraction:
    mantissa, exponent = x.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def _terms(angle: _Angle, phase: Form) -> int:
    """Number of terms that are left at a phase."""
    forms = {(pair, *_key(_turn(form, phase))) for (_, pair), form in angle.linear.items()}
    forms |= {(0, *_key(_slope(_turn_square(square, phase)))) for square in angle.square.values()}
    return sum(bool(x) for _, *form in forms for x in form)


def _key(form: Form) -> tuple[int, int]:
    """Equal for forms that differ by rounding only."""
    return tuple(round(x * (1 << 250)) for x in form)  # type: ignore[return-value]


def _turn(form: Form, phase: Form) -> Form:
    (a, b), (c, s) = form, phase
    return _clean((a * c - b * s, a * s + b * c))


def _clean(form: Form) -> Form:
    size = max(map(abs, form))
    a, b = (Fraction(0) if abs(x) <= size * EXACT else shorten(x) for x in form)
    return a, b


def _turn_square(square: Square, phase: Form) -> Square:
    """cos = c*cos' + s*sin' and sin = c*sin' - s*cos', put in."""
    (xx, xy, yy), (c, s) = square, phase
    return (
        xx * c * c - xy * c * s + yy * s * s,
        2 * (xx - yy) * c * s + xy * (c * c - s * s),
        xx * s * s + xy * c * s + yy * c * c,
    )


def _slope(square: Square) -> Form:
    """cos times this form and a constant are the square form."""
    xx, xy, yy = square
    return _clean((xx - yy, xy))


def _other_slope(square: Square) -> Form:
    """sin times this form and another constant are the same."""
    xx, xy, yy = square
    return _clean((xy, yy - xx))


def _turned(graph: Graph, angle: _Angle, phase: Form) -> Graph:
    squares = {index: _turn_square(square, phase) for index, square in angle.square.items()}
    slopes: Counter[tuple[int, int]] = Counter()
    for square in squares.values():
        slopes.update({_key(_slope(square)), _key(_other_slope(square))})
    shared: dict[tuple[int, int], Form] = {}
    with ctx.workprec(BITS):
        c, s = (arb(fmpq(x.numerator, x.denominator)) for x in phase)
        shift = _fraction(arb.atan2(s, c))

    def form(builder: Builder, leaves: tuple[tuple[Ref, ...], tuple[Ref, ...]], one: Form) -> list[Ref]:
        one = shared.setdefault(_key(one), one)
        return [builder.mul((builder.const(x), *leaf)) for x, leaf in zip(one, leaves, strict=True) if x]

    def part(builder: Builder, factors: Part) -> Ref:
        product = builder.mul([renamed[ref] for ref in factors[1]])
        return product if factors[0] > 0 else ~product

    def leaves(builder: Builder, own: tuple[Ref, Ref], pair: _Pair) -> tuple[tuple[Ref, ...], tuple[Ref, ...]]:
        if pair.b is None:
            factors = [renamed[ref] for ref in pair.a[1]]
            return (*factors, own[0]), (*factors, own[1])
        a, b = part(builder, pair.a), part(builder, pair.b)
        first = builder.add((builder.mul((a, own[0])), builder.mul((b, own[1]))))
        return (first,), (builder.sub(builder.mul((a, own[1])), builder.mul((b, own[0]))),)

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        index = position[node]
        if index not in angle.taken:
            return copy_node(builder, node, refs)
        turned = builder.add((renamed[angle.argument], builder.const(shift)))
        own = (builder.call("cos", turned), builder.call("sin", turned))
        terms = [ref for place, ref in enumerate(refs) if place not in angle.taken[index]]
        for number, pair in enumerate(angle.pairs):
            if (index, number) in angle.linear:
                terms += form(builder, leaves(builder, own, pair), _turn(angle.linear[index, number], phase))
        if index in squares:
            one, other = _slope(squares[index]), _other_slope(squares[index])
            by_sine = slopes[_key(other)] > slopes[_key(one)]
            inner = builder.add(form(builder, ((own[0],), (own[1],)), other if by_sine else one))
            terms += [builder.mul((own[by_sine], inner)), builder.const(squares[index][0 if by_sine else 2])]
        return builder.add(terms)

    position = {node: index for index, node in enumerate(graph.nodes)}
    renamed: dict[int, Ref] = {}

    def remembering(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        result = rule(builder, node, refs)
        renamed[position[node]] = result
        return result

    return rebuild(graph, remembering)
