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


@dataclass
class _Angle:
    """An angle's cosine and sine, and the sums that hold terms in them: of first and of second degree."""

    cos: int
    sin: int
    linear: dict[int, Form] = field(default_factory=dict)
    square: dict[int, Square] = field(default_factory=dict)
    taken: dict[int, set[int]] = field(default_factory=dict)  # the places of these terms in each sum


def turn(graph: Graph) -> Graph:
    """The same graph with angles measured from where most terms vanish."""
    parents: list[list[int]] = [[] for _ in graph.nodes]
    for index, node in enumerate(graph.nodes):
        for ref in operands(node):
            parents[node_of(ref)].append(index)
    roots = {node_of(ref) for ref in graph.roots}
    found = {(node[0], node[1]): index for index, node in enumerate(graph.nodes) if node[0] in ("cos", "sin")}
    for (name, argument), cosine in found.items():
        if name == "cos" and ("sin", argument) in found:
            angle = _read(graph, parents, roots, _Angle(cosine, found["sin", argument]))
            phase = _best(angle) if angle else None
            turned = _turned(graph, angle, phase) if angle and phase else graph
            if _operations(turned) < _operations(graph):
                return turn(turned)
    return graph


def _operations(graph: Graph) -> int:
    spent = cost(graph)
    return spent.add + spent.mul


def _read(graph: Graph, parents: list[list[int]], roots: set[int], angle: _Angle) -> _Angle | None:
    """All uses of an angle's cosine and sine as terms of sums; None if there are others."""
    own = {angle.cos: (Fraction(1), Fraction(0)), angle.sin: (Fraction(0), Fraction(1))}
    users = {p for leaf in own for p in parents[leaf]}
    if roots & own.keys():
        return None
    products = {p for p in users if graph.nodes[p][0] == "mul"}
    if any(graph.nodes[p][0] not in ("mul", "add") for p in users) or roots & products:
        return None
    if any(graph.nodes[p][0] != "add" for product in products for p in parents[product]):
        return None
    terms: dict[int, Form | Square] = dict(own)
    pure: dict[int, Form] = {}
    for p in sorted(products):
        form = _linear(graph, p, own)
        if form:
            terms[p] = form
    for index, node in enumerate(graph.nodes):
        if node[0] == "add" and all(len(terms.get(node_of(r), ())) == 2 for r in node[1:]):
            parts = [[(1 if r >= 0 else -1) * x for x in terms[node_of(r)]] for r in node[1:]]
            pure[index] = (sum((p[0] for p in parts), Fraction(0)), sum((p[1] for p in parts), Fraction(0)))
    for p in sorted(products - terms.keys()):
        square = _square(graph, p, own | pure)
        if square is None:
            return None
        terms[p] = square
    inner = {index for index in pure if index not in roots and all(len(terms.get(p, ())) == 3 for p in parents[index])}
    holders = {p for term in terms for p in parents[term] if graph.nodes[p][0] == "add"} - inner
    for index in sorted(holders):
        _collect(index, graph.nodes[index], terms, angle)
    return angle


def _collect(index: int, node: Node, terms: dict[int, Form | Square], angle: _Angle) -> None:
    """The part of a sum that an angle's terms make up."""
    linear, square, taken = [Fraction(0)] * 2, [Fraction(0)] * 3, set()
    for place, ref in enumerate(node[1:]):
        term = terms.get(node_of(ref))
        if term is not None:
            taken.add(place)
            total = linear if len(term) == 2 else square
            total[:] = [a + b if ref >= 0 else a - b for a, b in zip(total, term, strict=True)]
    angle.taken[index] = taken
    if any(linear):
        angle.linear[index] = (linear[0], linear[1])
    if any(square):
        angle.square[index] = (square[0], square[1], square[2])


def _linear(graph: Graph, product: int, own: dict[int, Form]) -> Form | None:
    refs = graph.nodes[product][1:]
    if len(refs) == 2 and graph.nodes[refs[0]][0] == "const" and refs[1] in own:
        factor, (c, s) = graph.nodes[refs[0]][1], own[refs[1]]
        return factor * c, factor * s
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
    forms = {_key(form) for form in (_turn(form, phase) for form in angle.linear.values())}
    slopes = {_key(_slope(_turn_square(square, phase))) for square in angle.square.values()}
    return sum(bool(x) for form in forms | slopes for x in form)


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
    argument = graph.nodes[angle.cos][1]
    with ctx.workprec(BITS):
        c, s = (arb(fmpq(x.numerator, x.denominator)) for x in phase)
        shift = _fraction(arb.atan2(s, c))

    def form(builder: Builder, leaves: tuple[Ref, Ref], one: Form) -> list[Ref]:
        one = shared.setdefault(_key(one), one)
        return [builder.mul((builder.const(x), leaf)) for x, leaf in zip(one, leaves, strict=True) if x]

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        index = position[node]
        if index not in angle.taken:
            return copy_node(builder, node, refs)
        old = renamed[argument]
        turned = builder.add((old, builder.const(shift)))
        leaves = (builder.call("cos", turned), builder.call("sin", turned))
        terms = [ref for place, ref in enumerate(refs) if place not in angle.taken[index]]
        if index in angle.linear:
            terms += form(builder, leaves, _turn(angle.linear[index], phase))
        if index in squares:
            one, other = _slope(squares[index]), _other_slope(squares[index])
            by_sine = slopes[_key(other)] > slopes[_key(one)]
            inner = builder.add(form(builder, leaves, other if by_sine else one))
            terms += [builder.mul((leaves[by_sine], inner)), builder.const(squares[index][0 if by_sine else 2])]
        return builder.add(terms)

    position = {node: index for index, node in enumerate(graph.nodes)}
    renamed: dict[int, Ref] = {}

    def remembering(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        result = rule(builder, node, refs)
        renamed[position[node]] = result
        return result

    return rebuild(graph, remembering)
