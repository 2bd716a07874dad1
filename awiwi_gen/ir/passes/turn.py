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
_X = (Fraction(1), Fraction(0))


@dataclass(frozen=True)
class _Pair:
    """Two nodes that turn with an angle as its cosine and sine do.

    These are one pair themselves. With `made` = (a, b) they are a*cos + b*sin and `sign` times a*sin - b*cos.
    """

    first: int
    second: int
    sign: int = 1
    made: tuple[Ref, Ref] | None = None


@dataclass
class _Angle:
    """An angle's cosine and sine, what else turns so, and the sums of terms in them: of first and second degree."""

    pairs: list[_Pair]
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

    def read(self, own: _Pair) -> _Angle | None:
        """All uses of an angle's cosine and sine as terms of sums; None if there are others."""
        graph, parents = self.graph, self.parents
        angle = _Angle([own, *self._companions(own)])
        leaves: Terms = {}
        for number, pair in enumerate(angle.pairs):
            leaves |= {pair.first: (number, _X), pair.second: (number, (Fraction(0), Fraction(pair.sign)))}
        making = {node_of(ref) for pair in angle.pairs[1:] for ref in graph.nodes[pair.first][1:]}
        making |= {node_of(ref) for pair in angle.pairs[1:] for ref in graph.nodes[pair.second][1:]}
        users = {p for leaf in leaves for p in parents[leaf]} - making
        products = {p for p in users if graph.nodes[p][0] == "mul"}
        if self.roots & (leaves.keys() | products) or any(graph.nodes[p][0] not in ("mul", "add") for p in users):
            return None
        if any(graph.nodes[p][0] != "add" for product in products for p in parents[product]):
            return None
        terms: Terms = dict(leaves)
        terms |= {p: form for p in sorted(products) if (form := _linear(graph, p, leaves))}
        pure = {leaf: unit for leaf, (pair, unit) in leaves.items() if pair == 0}
        sums: dict[int, Form] = {}
        for index, node in enumerate(graph.nodes):
            if node[0] == "add" and all(_is_form(terms.get(node_of(r))) for r in node[1:]):
                parts = [[(1 if r >= 0 else -1) * x for x in terms[node_of(r)][1]] for r in node[1:]]
                sums[index] = (sum((p[0] for p in parts), Fraction(0)), sum((p[1] for p in parts), Fraction(0)))
        for p in sorted(products - terms.keys()):
            square = _square(graph, p, pure | sums)
            if square is None:
                return None
            terms[p] = 0, square
        squares = {p for p, (_, term) in terms.items() if len(term) == 3}
        inner = {index for index in sums if index not in self.roots and squares.issuperset(parents[index])}
        holders = {p for term in terms for p in parents[term] if graph.nodes[p][0] == "add"} - inner
        for index in sorted(holders):
            _collect(index, graph.nodes[index], terms, angle)
        return angle

    def _companions(self, own: _Pair) -> list[_Pair]:
        """The other pairs that turn with an angle: sums and differences of its cosine and sine with the same factors."""
        parents = self.parents
        sums = {p for leaf in (own.first, own.second) for product in parents[leaf] for p in parents[product]}
        found = {found: index for index in sorted(sums - self.roots) if (found := self._factors(index, own))}
        pairs: list[_Pair] = []
        for (a, b), first in found.items():
            for sign, factors in ((1, (~b, a)), (-1, (b, ~a))):
                second = found.get(factors)
                if second is not None and first < second:
                    pairs.append(_Pair(first, second, sign, (a, b)))
        return pairs

    def _factors(self, index: int, own: _Pair) -> tuple[Ref, Ref] | None:
        """(a, b) if a node is a*cos + b*sin, where these products are used for such pairs only."""
        node = self.graph.nodes[index]
        found: dict[int, Ref] = {}
        for ref in operands(node):
            product = self.graph.nodes[node_of(ref)]
            if product[0] == "mul" and len(product) == 3 and len(self.parents[node_of(ref)]) == 1:
                for leaf, other in (product[1:], product[:0:-1]):
                    if leaf in (own.first, own.second) and self.graph.nodes[other][0] != "const":
                        found[leaf] = other if ref >= 0 else ~other
        return (found[own.first], found[own.second]) if node[0] == "add" and len(found) == len(node) - 1 == 2 else None


def turn(graph: Graph) -> Graph:
    """The same graph with angles measured from where most terms vanish."""
    reader = _Reader(graph)
    found = {(node[0], node[1]): index for index, node in enumerate(graph.nodes) if node[0] in ("cos", "sin")}
    for (name, argument), cosine in found.items():
        if name == "cos" and ("sin", argument) in found:
            angle = reader.read(_Pair(cosine, found["sin", argument]))
            phase = _best(angle) if angle else None
            turned = _turned(graph, angle, phase) if angle and phase else graph
            if _operations(turned) < _operations(graph):
                return turn(turned)
    return graph


def _operations(graph: Graph) -> int:
    spent = cost(graph)
    return spent.add + spent.mul


def _is_form(term: tuple[int, Form | Square] | None) -> bool:
    """Whether a term is of first degree in cosine and sine."""
    return term is not None and term[0] == 0 and len(term[1]) == 2


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


def _linear(graph: Graph, product: int, leaves: Terms) -> tuple[int, Form] | None:
    refs = graph.nodes[product][1:]
    if len(refs) == 2 and graph.nodes[refs[0]][0] == "const" and refs[1] in leaves:
        factor, (pair, (c, s)) = graph.nodes[refs[0]][1], leaves[refs[1]]
        return pair, (factor * c, factor * s)
    return None


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
    argument = graph.nodes[angle.pairs[0].first][1]
    with ctx.workprec(BITS):
        c, s = (arb(fmpq(x.numerator, x.denominator)) for x in phase)
        shift = _fraction(arb.atan2(s, c))

    def form(builder: Builder, leaves: tuple[Ref, Ref], one: Form) -> list[Ref]:
        one = shared.setdefault(_key(one), one)
        return [builder.mul((builder.const(x), leaf)) for x, leaf in zip(one, leaves, strict=True) if x]

    def leaves(builder: Builder, own: tuple[Ref, Ref], pair: _Pair) -> tuple[Ref, Ref]:
        if pair.made is None:
            return own
        a, b = (renamed[ref] if ref >= 0 else ~renamed[~ref] for ref in pair.made)
        first = builder.add((builder.mul((a, own[0])), builder.mul((b, own[1]))))
        second = builder.sub(builder.mul((a, own[1])), builder.mul((b, own[0])))
        return first, second

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        index = position[node]
        if index not in angle.taken:
            return copy_node(builder, node, refs)
        turned = builder.add((renamed[argument], builder.const(shift)))
        own = (builder.call("cos", turned), builder.call("sin", turned))
        terms = [ref for place, ref in enumerate(refs) if place not in angle.taken[index]]
        for number, pair in enumerate(angle.pairs):
            if (index, number) in angle.linear:
                terms += form(builder, leaves(builder, own, pair), _turn(angle.linear[index, number], phase))
        if index in squares:
            one, other = _slope(squares[index]), _other_slope(squares[index])
            by_sine = slopes[_key(other)] > slopes[_key(one)]
            inner = builder.add(form(builder, own, other if by_sine else one))
            terms += [builder.mul((own[by_sine], inner)), builder.const(squares[index][0 if by_sine else 2])]
        return builder.add(terms)

    position = {node: index for index, node in enumerate(graph.nodes)}
    renamed: dict[int, Ref] = {}

    def remembering(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        result = rule(builder, node, refs)
        renamed[position[node]] = result
        return result

    return rebuild(graph, remembering)
