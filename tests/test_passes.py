"""Passes that need sums of sines, or constants, to have anything to do."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st
from test_graph import VALUES, points

from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import Graph, Output, Ref
from awiwi_gen.ir.passes import optimise
from awiwi_gen.ir.passes.factor import factor
from awiwi_gen.ir.passes.finish import orient
from awiwi_gen.ir.passes.flatten import flatten
from awiwi_gen.ir.passes.phase import phase
from awiwi_gen.ir.passes.scale import scale, units
from awiwi_gen.ir.passes.shift import shift
from awiwi_gen.ir.passes.signs import signs
from awiwi_gen.verify.reference import ball_values, disagreement

NUMBERS = st.integers(-9, 9).filter(bool).map(lambda k: Fraction(k, 7))
BODIES = st.lists(st.tuples(st.integers(0, 2), *[NUMBERS] * 4), min_size=1, max_size=5)
USES = st.lists(
    st.tuples(st.sampled_from(["add", "mul", "scaled"]), st.integers(0, 99), st.integers(0, 99)), max_size=12
)


def form(builder: Builder, turned: tuple[Ref, Ref], a: Fraction, b: Fraction) -> Ref:
    """a cos + b sin."""
    return builder.add([builder.mul((builder.const(x), leaf)) for x, leaf in zip((a, b), turned, strict=True)])


def moments(
    bodies: list[tuple[int, Fraction, Fraction, Fraction, Fraction]], uses: list[tuple[str, int, int]]
) -> Graph:
    """First and second moments of bodies that rotate by three angles, and what is made of them."""
    builder = Builder()
    angles = [builder.input("x", 0), builder.add([builder.input("x", i) for i in (0, 1)]), builder.input("x", 2)]
    refs = [builder.input("x", 3)]
    for which, a, b, c, d in bodies:
        cosine, sine = (builder.call(name, angles[which]) for name in ("cos", "sin"))
        slope = form(builder, (cosine, sine), c, d)
        refs += [form(builder, (cosine, sine), a, b), form(builder, (cosine, sine), -b, a)]
        refs.append(builder.add((builder.mul((cosine, slope)), builder.const(c))))
        refs.append(builder.add((builder.mul((sine, slope)), refs[0])))
    for use, i, j in uses:
        pair = (refs[i % len(refs)], refs[j % len(refs)])
        scaled = (builder.const(Fraction(3, 11)), *pair)
        refs.append(builder.mul(scaled) if use == "scaled" else builder.make(use, pair))
    return builder.graph([Output("y", (len(refs) - 1,), tuple(refs[1:]))])


def values_differ(a: Graph, b: Graph) -> float:
    return float(disagreement(*(ball_values(graph, points(), VALUES) for graph in (a, b))))


@settings(deadline=None, max_examples=60)
@given(BODIES, USES)
def test_moments_in_turned_axes_and_scaled_moments_are_the_same_moments(bodies, uses):
    graph = flatten(moments(bodies, uses))
    turned = phase(graph)

    assert values_differ(graph, turned) < 1e-50
    assert values_differ(graph, scale(graph)) < 1e-50
    assert values_differ(graph, scale(turned)) < 1e-50
    assert values_differ(graph, optimise(graph)[-1][1]) < 1e-50


@settings(deadline=None, max_examples=60)
@given(BODIES, USES)
def test_turning_and_scaling_never_cost_products_or_sums(bodies, uses):
    graph = flatten(moments(bodies, uses))

    assert cost(scale(graph)).mul <= cost(graph).mul
    assert cost(phase(graph)).add + cost(phase(graph)).mul <= cost(graph).add + cost(graph).mul


def pair(builder: Builder) -> tuple[Ref, Ref, Ref, Ref]:
    """Cosine and sine of an input, and the two components of a vector that turns with it."""
    cosine, sine = (builder.call(name, builder.input("x", 0)) for name in ("cos", "sin"))
    a, b = Fraction(3, 10), Fraction(-7, 10)
    return cosine, sine, form(builder, (cosine, sine), a, b), form(builder, (cosine, sine), -b, a)


def test_a_vector_that_turns_costs_two_products_and_a_phase():
    builder = Builder()
    _, _, x, y = pair(builder)
    graph = builder.graph([Output("y", (2,), (x, y))])
    before, after = cost(graph), cost(phase(graph))

    assert (before.add, before.mul) == (2, 4)
    assert (after.add, after.mul, after.sincos) == (1, 2, 1)


def test_an_angle_whose_sine_is_itself_a_result_is_left_alone():
    builder = Builder()
    _, sine, x, y = pair(builder)
    graph = builder.graph([Output("y", (3,), (x, y, sine))])

    assert phase(graph) == graph


def test_a_square_of_the_same_angle_turns_with_the_vector_and_stays_as_short():
    builder = Builder()
    cosine, sine, x, y = pair(builder)
    square = builder.mul((cosine, form(builder, (cosine, sine), Fraction(2), Fraction(5))))
    total = builder.add((square, builder.input("x", 1), builder.const(1)))
    graph = builder.graph([Output("y", (3,), (x, y, total))])

    assert cost(phase(graph)).mul == cost(graph).mul - 2
    assert values_differ(graph, phase(graph)) < 1e-50


def test_a_constant_that_can_be_carried_costs_no_product():
    builder = Builder()
    x, y, z = (builder.input("x", i) for i in range(3))
    moment = builder.add((builder.mul((builder.const(2), x)), builder.mul((builder.const(3), y))))
    users = [builder.mul((builder.const(5), moment, other)) for other in (y, z)]
    graph = builder.graph([Output("y", (2,), tuple(users))])

    assert cost(graph).mul == 6
    assert cost(scale(graph)).mul == 4
    assert values_differ(graph, scale(graph)) < 1e-50


def test_results_and_arguments_of_functions_keep_their_scale():
    builder = Builder()
    x, y = (builder.input("x", i) for i in range(2))
    angle = builder.add((builder.mul((builder.const(2), x)), y))
    graph = builder.graph([Output("y", (2,), (builder.call("sin", angle), builder.mul((builder.const(3), angle))))])

    assert scale(graph) == graph


@settings(deadline=None, max_examples=60)
@given(BODIES, USES)
def test_choosing_signs_saves_negations_and_nothing_else_changes(bodies, uses):
    graph = orient(moments(bodies, uses))
    before, after = cost(graph), cost(signs(graph))

    assert values_differ(graph, signs(graph)) < 1e-50
    assert after.neg <= before.neg
    assert (after.add, after.mul, after.sincos) == (before.add, before.mul, before.sincos)


def test_a_level_arm_whose_products_are_all_negative_is_computed_negative():
    builder = Builder()
    x, y, z = (builder.input("x", i) for i in range(3))
    lever = builder.add((builder.mul((builder.const(2), x)), builder.mul((builder.const(3), y))))
    graph = builder.graph([Output("y", (3,), (lever, ~builder.mul((lever, x)), ~builder.mul((lever, z))))])

    assert cost(graph).neg == 2
    assert cost(signs(graph)).neg == 1


@settings(deadline=None, max_examples=60)
@given(BODIES, USES)
def test_completed_brackets_and_inputs_in_other_units_have_the_same_values_and_cost_no_more(bodies, uses):
    graph = factor(flatten(moments(bodies, uses)))
    shifted, measured = shift(graph), units(graph)

    assert values_differ(graph, shifted) < 1e-50
    assert values_differ(graph, measured) < 1e-50
    assert cost(shifted).add + cost(shifted).mul <= cost(graph).add + cost(graph).mul
    assert cost(measured).mul <= cost(graph).mul


def inertia(builder: Builder, by: Fraction) -> Ref:
    """c*(2 c + 3 s + 5 y + 7) + 5 by y + 11 s + 13: y is a moment at a distance from the axis that turns with c."""
    cosine, sine = (builder.call(name, builder.input("x", 0)) for name in ("cos", "sin"))
    inner = [(2, cosine), (3, sine), (5, builder.input("x", 1))]
    bracket = builder.add([builder.const(7), *(builder.mul((builder.const(k), x)) for k, x in inner)])
    outer = [(5 * by, builder.input("x", 1)), (Fraction(11), sine)]
    beside = [builder.const(13), *(builder.mul((builder.const(k), x)) for k, x in outer)]
    return builder.add([builder.mul((cosine, bracket)), *beside])


def test_a_distance_that_turns_takes_the_constant_distance_into_its_bracket():
    builder = Builder()
    graph = builder.graph([Output("y", (1,), (inertia(builder, Fraction(1, 7)),))])
    before, after = cost(graph), cost(shift(graph))

    assert (after.mul, after.add) == (before.mul - 1, before.add)
    assert values_differ(graph, shift(graph)) < 1e-50


def test_a_shift_that_would_cancel_is_not_made():
    builder = Builder()
    graph = builder.graph([Output("y", (1,), (inertia(builder, Fraction(7)),))])

    assert shift(graph) == graph


def test_an_input_is_measured_in_arms_where_more_levers_than_it_has_elements_need_the_arm():
    builder = Builder()
    x, y, z = (builder.input("x", i) for i in range(3))
    gravity, arm = builder.input("g", 0), Fraction(3, 100)
    levers = [builder.mul((builder.const(arm), one)) for one in (x, y, z)]
    products = [builder.mul((builder.add((gravity, lever)), one)) for lever, one in zip(levers, (y, z, x), strict=True)]
    loads = [builder.mul((builder.const(Fraction(k, 7)), one)) for k, one in zip((2, 3, 5), products, strict=True)]
    graph = builder.graph([Output("y", (3,), tuple(loads))])

    assert cost(scale(graph)).mul == cost(graph).mul
    assert cost(units(graph)).mul == cost(graph).mul - 2


def test_an_acceleration_that_turns_with_a_body_turns_with_its_axes():
    builder = Builder()
    cosine, sine, x, y = pair(builder)
    a, b = builder.input("x", 1), builder.input("x", 2)
    first = builder.add((builder.mul((a, cosine)), builder.mul((b, sine))))
    second = builder.sub(builder.mul((a, sine)), builder.mul((b, cosine)))
    c, d = Fraction(3, 10), Fraction(-7, 10)
    forces = form(builder, (first, second), c, d), form(builder, (first, second), -d, c)
    graph = builder.graph([Output("y", (4,), (x, y, *forces))])
    before, after = cost(graph), cost(phase(graph))

    assert (after.add, after.mul) == (before.add - 3, before.mul - 4)
    assert values_differ(graph, phase(graph)) < 1e-50
