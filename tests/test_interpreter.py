"""One interpreter, many algebras: floats, balls, error bounds, dimensions and CasADi agree on random graphs."""

from __future__ import annotations

from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from test_graph import STEPS, VALUES, grow, points

from awiwi_gen.errors import DimensionError
from awiwi_gen.ir.algebras import Bounded, Dimensions, Floats
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.from_casadi import Expressions, lower_casadi
from awiwi_gen.ir.graph import Output
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.ir.passes.bind import bind
from awiwi_gen.units import N, kg, m, one, s
from awiwi_gen.verify.reference import ball_values, disagreement, reference
from awiwi_gen.verify.verdict import float_values, stack


@settings(deadline=None)
@given(STEPS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_the_error_bound_covers_the_error_of_every_value(dtype, steps):
    graph = bind(grow(steps), VALUES)
    inputs = {"x": points()["x"].astype(dtype)}
    floats = float_values(graph, inputs, {}, Floats(dtype))
    bounds = float_values(graph, inputs, {}, Bounded(dtype))
    exact = reference(ball_values(graph, inputs, {}))
    for name, columns in floats.items():
        error = exact.error(name, stack(columns, 5))

        assert np.all(error <= stack([b[1] for b in bounds[name]], 5))


@settings(deadline=None)
@given(STEPS)
def test_a_graph_survives_the_journey_through_casadi(steps):
    graph = bind(grow(steps), {"r": Fraction(1, 8)})  # a power of two: CasADi's constants are doubles
    x = ca.SX.sym("x", 4)
    expressions = evaluate(graph, Expressions(), lambda node: x[node[2]])
    builder = Builder()
    names = list(expressions)
    values = [ca.vertcat(*expressions[name]) for name in names]
    lowered = lower_casadi(builder, values, [(x, [builder.input("x", i) for i in range(4)])])
    back = builder.graph(Output(n, (len(r),), tuple(r)) for n, r in zip(names, lowered, strict=True))

    assert disagreement(*(ball_values(g, points(), {}) for g in (graph, back))) < 1e-12  # 2/7 was rounded


def test_dimensions_are_checked_in_sums_and_in_arguments():
    builder = Builder()
    x, y = builder.input("x", 0), builder.input("x", 1)
    units = {0: N, 1: kg * m / s**2}
    force = builder.graph([Output("f", (), (builder.add((x, y)),))])

    assert evaluate(force, Dimensions(), lambda node: units[node[2]])["f"] == [N]
    for wrong in (
        builder.add((x, builder.const(1))),
        builder.call("sin", x),
        builder.call("atan2", x, builder.mul((x, y))),
    ):
        with pytest.raises(DimensionError):
            evaluate(builder.graph([Output("f", (), (wrong,))]), Dimensions(), lambda node: units[node[2]])


def test_zero_fits_any_unit():
    builder = Builder()
    graph = builder.graph([Output("f", (), (builder.const(0),))])

    assert evaluate(graph, Dimensions(), lambda node: one)["f"] == [None]
