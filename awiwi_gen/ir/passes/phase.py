"""Add a phase to an angle so that most terms vanish: ``a*cos(x) + b*sin(x)`` is ``hypot(a, b)*cos(x + phase)``.

The moments of a body are pairs of such sums, (a, b) and (-b, a), so one added constant saves two products and two sums.
Every other use of the sine and cosine must be a term of a sum: of first degree, or of second with constant factors. Such
terms keep their form when the phase changes (`angles`). Angles with other uses stay as they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from fractions import Fraction
from math import hypot

from flint import arb, ctx, fmpq

from awiwi_gen.ir.builder import Builder, copy_node, rebuild, shorten
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import Graph, Node, Ref
from awiwi_gen.ir.passes.angles import Angle, Form, Pair, Part, Reader, Square
from awiwi_gen.ir.traced import computed, hypotenuse

BITS = 400
EXACT = Fraction(1, 1 << 300)  # a coefficient smaller than this part of its form is a rounded zero
Leaves = tuple[tuple[Ref, ...], tuple[Ref, ...]]  # the factors of the two values of a pair


def phase(graph: Graph) -> Graph:
    """The same graph with the best phase added to every angle."""
    reader = Reader(graph)
    found = {(node[0], node[1]): index for index, node in enumerate(graph.nodes) if node[0] in ("cos", "sin")}
    for (name, argument), cosine in found.items():
        if name == "cos" and ("sin", argument) in found:
            angle = reader.read(cosine, found["sin", argument])
            best = _best_phase(angle) if angle else None
            changed = _with_phase(graph, angle, best) if angle and best else graph
            if _operations(changed) < _operations(graph):
                return phase(changed)
    return graph


def _operations(graph: Graph) -> int:
    spent = cost(graph)
    return spent.add + spent.mul


def _best_phase(angle: Angle) -> Form | None:
    """Cosine and sine of the phase at which most terms vanish, if that saves more than one addition."""
    forms = [(pair, float(a), float(b)) for (_, pair), (a, b) in angle.linear.items()]
    squares = [(float(xx - yy), float(xy)) for xx, xy, yy in angle.square.values()]
    best, least = None, _terms(forms, squares, 1.0, 0.0)
    for form in angle.linear.values():
        if all(form):
            a, b = map(float, form)
            terms = _terms(forms, squares, a / hypot(a, b), -b / hypot(a, b))
            if terms < least:
                best, least = form, terms
    return _direction(best) if best else None


def _terms(
    forms: Iterable[tuple[int, float, float]], squares: Iterable[tuple[float, float]], c: float, s: float
) -> int:
    """Number of terms left at a phase with cosine c and sine s; equal forms count once."""
    rotated = [(pair, a * c - b * s, a * s + b * c) for pair, a, b in forms]
    rotated += [(0, a * (c * c - s * s) - 2 * b * c * s, 2 * a * c * s + b * (c * c - s * s)) for a, b in squares]
    left = {(pair, *(f"{x:.9e}" if abs(x) > 1e-12 * hypot(a, b) else "" for x in (a, b))) for pair, a, b in rotated}
    return sum(bool(x) for _, *form in left for x in form)


def _direction(form: Form) -> Form:
    """The phase (cosine, sine) at which a form has no sine."""
    with ctx.workprec(BITS):
        a, b = (arb(fmpq(x.numerator, x.denominator)) for x in form)
        length = (a * a + b * b).sqrt()
        cosine, sine = _fraction(a / length), _fraction(-b / length)
    return (
        computed(cosine, form, lambda numbers, a, b: numbers.div(a, hypotenuse(numbers, a, b))),
        computed(sine, form, lambda numbers, a, b: ~numbers.div(b, hypotenuse(numbers, a, b))),
    )


def _fraction(x: arb) -> Fraction:
    mantissa, exponent = x.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def _key(form: Form) -> tuple[int, int]:
    """Equal for forms that differ by rounding only."""
    return tuple(round(x * (1 << 250)) for x in form)  # type: ignore[return-value]


def _rotated(form: Form, phase: Form) -> Form:
    (a, b), (c, s) = form, phase
    return _clean((a * c - b * s, a * s + b * c))


def _clean(form: Form) -> Form:
    size = max(map(abs, form))
    a, b = (Fraction(0) if abs(x) <= size * EXACT else shorten(x) for x in form)
    return a, b


def _rotated_square(square: Square, phase: Form) -> Square:
    """Substitute cos = c*cos' + s*sin' and sin = c*sin' - s*cos'."""
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


def _with_phase(graph: Graph, angle: Angle, phase: Form) -> Graph:
    squares = {index: _rotated_square(square, phase) for index, square in angle.square.items()}
    slopes: Counter[tuple[int, int]] = Counter()
    for square in squares.values():
        slopes.update({_key(_slope(square)), _key(_other_slope(square))})
    shared: dict[tuple[int, int], Form] = {}
    with ctx.workprec(BITS):
        c, s = (arb(fmpq(x.numerator, x.denominator)) for x in phase)
        value = _fraction(arb.atan2(s, c))
    shift = computed(value, phase, lambda numbers, c, s: numbers.call("atan2", s, c))

    def form(builder: Builder, leaves: Leaves, one: Form) -> list[Ref]:
        one = shared.setdefault(_key(one), one)
        return [builder.mul((builder.const(x), *leaf)) for x, leaf in zip(one, leaves, strict=True) if x]

    def part(builder: Builder, factors: Part) -> Ref:
        product = builder.mul([renamed[ref] for ref in factors[1]])
        return product if factors[0] > 0 else ~product

    def leaves(builder: Builder, own: tuple[Ref, Ref], pair: Pair) -> Leaves:
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
        shifted = builder.add((renamed[angle.argument], builder.const(shift)))
        own = (builder.call("cos", shifted), builder.call("sin", shifted))
        terms = [ref for place, ref in enumerate(refs) if place not in angle.taken[index]]
        for number, pair in enumerate(angle.pairs):
            if (index, number) in angle.linear:
                terms += form(builder, leaves(builder, own, pair), _rotated(angle.linear[index, number], phase))
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
