"""The expression graph and its passes, on random graphs."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import SIGNLESS, Graph, Node, Output, canonical, node_of, operands
from awiwi_gen.ir.passes import FINAL, ORDERS, REPEATED, optimise, stages
from awiwi_gen.ir.passes.bind import bind
from awiwi_gen.ir.passes.factor import factor
from awiwi_gen.ir.passes.finish import orient, quotients
from awiwi_gen.ir.passes.flatten import flatten
from awiwi_gen.ir.passes.phase import phase
from awiwi_gen.ir.passes.scale import scale
from awiwi_gen.ir.passes.schedule import schedule
from awiwi_gen.ir.passes.share import share_products, share_sums
from awiwi_gen.ir.passes.signs import signs
from awiwi_gen.verify.reference import ball_values, disagreement

PASSES = (flatten, phase, share_products, share_sums, factor, scale, quotients, orient, signs, schedule)
STEPS = st.lists(
    st.tuples(
        st.sampled_from(["add", "sub", "mul", "div", "neg", "sin", "cos", "sqrt"]),
        st.integers(0, 10**6),
        st.integers(0, 10**6),
    ),
    min_size=1,
    max_size=40,
)


def grow(steps: list[tuple[str, int, int]], shuffled: bool = False) -> Graph:
    """A random graph; ``shuffled`` builds the same expressions with operands the other way round."""
    builder = Builder()
    refs = [builder.input("x", i) for i in range(4)] + [builder.const(Fraction(k, 7)) for k in (2, 3)]
    refs += [builder.param("r")]
    for operation, i, j in steps:
        a, b = refs[i % len(refs)], refs[j % len(refs)]
        if operation in ("add", "mul"):
            refs.append(builder.make(operation, (b, a) if shuffled else (a, b)))
        elif operation == "sub":
            refs.append(~builder.sub(b, a) if shuffled else builder.sub(a, b))
        elif operation == "div":  # 2 + sin(b) is never zero
            refs.append(builder.div(a, builder.add((builder.const(2), builder.call("sin", b)))))
        elif operation == "sqrt":
            refs.append(builder.call("sqrt", builder.add((builder.const(1), builder.mul((a, a))))))
        else:
            refs.append(~a if operation == "neg" else builder.call(operation, a))
    one = builder.const(1)  # so that what is zero only by cancellation is small beside something
    return builder.graph([Output("y", (4,), (*refs[-3:], one)), Output("z", (2,), (~refs[-1], one))])


def points(count: int = 5) -> dict[str, np.ndarray]:
    return {"x": np.random.default_rng(7).uniform(-1.5, 1.5, (count, 4))}


VALUES = {"r": Fraction(13, 2000)}


@given(STEPS)
def test_canonical_order_is_a_fixed_point(steps):
    graph = grow(steps)

    assert canonical(graph) == graph


@given(STEPS)
def test_operands_come_before_the_nodes_that_use_them(steps):
    graph = grow(steps)

    assert all(node_of(r) < i for i, node in enumerate(graph.nodes) for r in operands(node))
    assert len(set(graph.nodes)) == len(graph.nodes)


@settings(deadline=None)
@given(STEPS)
def test_the_order_of_construction_leaves_no_trace_in_the_value(steps):
    a, b = (ball_values(grow(steps, shuffled), points(), VALUES) for shuffled in (False, True))

    assert disagreement(a, b) < 1e-50


def test_equal_sums_and_products_are_one_node_whatever_their_order_and_sign():
    builder = Builder()
    x, y, z = (builder.input("x", i) for i in range(3))

    assert builder.add((x, y, z)) == builder.add((z, x, y))
    assert builder.sub(x, y) == ~builder.sub(y, x)
    assert builder.mul((x, ~y)) == ~builder.mul((y, x))
    assert builder.add((x, x, ~x)) == x
    assert builder.mul((x, builder.inv(x))) == builder.const(1)


def test_a_sum_that_renumbering_turns_leaves_no_sign_inside_products_and_functions():
    builder = Builder()
    late, early, z = (builder.input("x", i) for i in (1, 0, 2))
    difference = builder.sub(late, early)
    users = [
        builder.mul((z, difference)),
        builder.inv(difference),
        *(builder.call(f, difference) for f in ("sin", "cos")),
    ]
    graph = builder.graph([Output("y", (4,), tuple(users))])

    assert all(ref >= 0 for node in graph.nodes if node[0] in SIGNLESS for ref in operands(node))
    assert [ref >= 0 for ref in graph.roots] == [False, False, False, True]


@settings(deadline=None, max_examples=60)
@pytest.mark.parametrize("apply", PASSES, ids=lambda f: f.__name__)
@given(steps=STEPS)
def test_a_pass_keeps_the_value(apply, steps):
    graph = grow(steps)

    assert disagreement(*(ball_values(g, points(), VALUES) for g in (graph, apply(graph)))) < 1e-50


@settings(deadline=None, max_examples=60)
@pytest.mark.parametrize("passes", [*(order + REPEATED + FINAL for order in ORDERS), REPEATED + ORDERS[0]])
@given(steps=STEPS)
def test_passes_keep_the_value_one_after_the_other(passes, steps):
    graph = grow(steps)

    assert disagreement(*(ball_values(g, points(), VALUES) for g in (graph, stages(graph, passes)[-1][1]))) < 1e-50


@settings(deadline=None, max_examples=30)
@given(steps=STEPS)
@example([("mul", 0, 0), ("add", 0, 0), ("add", 0, 0), ("div", 7, 0)])
@example([("add", 0, 0), ("add", 1, 1), ("add", 0, 0), ("div", 33868, 0), ("add", 0, 0)])
def test_optimising_keeps_the_value_and_never_costs_more(steps):
    graph = grow(steps)
    best = optimise(graph)[-1][1]

    assert cost(best).weight <= cost(stages(graph, FINAL)[-1][1]).weight
    assert disagreement(*(ball_values(g, points(), VALUES) for g in (graph, best))) < 1e-50


@settings(deadline=None)
@given(STEPS)
def test_binding_numbers_keeps_the_value_and_leaves_no_parameter(steps):
    graph = grow(steps)
    bound = bind(graph, VALUES)

    assert bound.params == ()
    assert disagreement(*(ball_values(g, points(), VALUES) for g in (graph, bound))) < 1e-50


def test_constants_stay_exact():
    builder = Builder()
    tenth = builder.const(Fraction(1, 10))

    assert builder.value(builder.add([tenth] * 3)) == Fraction(3, 10)


def test_functions_of_constants_are_folded_far_below_the_precision_of_the_checks():
    builder = Builder()
    root = builder.call("sqrt", builder.param("a"))
    graph = bind(builder.graph([Output("y", (), (root,))]), {"a": Fraction(2)})
    node: Node = graph.nodes[0]

    assert len(graph.nodes) == 1
    assert abs(node[1] ** 2 - 2) < Fraction(1, 10**100)


def test_a_shared_pair_of_terms_is_computed_once():
    builder = Builder()
    a, b, c, d = (builder.input("x", i) for i in range(4))
    graph = builder.graph([Output("y", (2,), (builder.add((a, ~b, c)), builder.add((b, ~a, d))))])
    sums = [node for node in share_sums(graph).nodes if node[0] == "add"]

    assert len(sums) == 3
    assert all(len(node) == 3 for node in sums)
