"""The order of evaluation: few values alive, sums taken up term by term, outputs written as soon as they are known."""

import re

import numpy as np
import pytest

from awiwi_gen.emit.c import Printer
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.algebras import Floats
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import LEAVES, Output, node_of, operands
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.ir.passes.schedule import depth_first, schedule
from awiwi_gen.pipeline import Job

FINGER = ("bias", "forward_dynamics", "inverse_dynamics")


@pytest.fixture(scope="module")
def finger_graphs(hand):
    """What is emitted for a finger."""
    records = Job(hand, only="index_*").records
    return [records[f"index_{name}"].graph for name in FINGER]


def weighted(count):
    """A sum over a sequence in which each value is made from the one before: y = sum of i t[i], t[i+1] = t[i]^2 + x[i]."""
    builder = Builder()
    values = [builder.input("x", 0)]
    for i in range(1, count):
        values.append(builder.add([builder.mul([values[-1], values[-1]]), builder.input("x", i)]))
    total = builder.add([builder.mul([builder.const(i + 2), value]) for i, value in enumerate(values)])
    return builder.graph([Output("y", (2,), (total, values[-1]))])


def alive(graph):
    """The most values that are alive at a time: computed, or an input already read, and read again later."""
    last, peak, now = graph.last_uses, 0, set()
    for index, node in enumerate(graph.nodes):
        now |= {node_of(ref) for ref in operands(node) if graph.nodes[node_of(ref)][0] == "input"}
        if node[0] not in LEAVES:
            now.add(index)
        peak = max(peak, len(now))
        now = {value for value in now if last[value] > index}
    return peak


def test_a_sum_takes_up_values_as_they_come():
    graph = weighted(30)

    assert alive(depth_first(graph)) >= 30
    assert alive(schedule(graph)) <= 4  # the sum, a value, the next value and an input


def test_every_term_is_taken_once_and_operations_stay_as_many(finger_graphs):
    for graph in finger_graphs:
        ordered = schedule(graph)

        def additions(graph):
            return sum(len(node) - 2 for node in graph.nodes if node[0] == "add")

        assert additions(ordered) == additions(graph)
        assert sum(n[0] == "mul" for n in ordered.nodes) == sum(n[0] == "mul" for n in depth_first(graph).nodes)
        assert all(node_of(ref) < index for index, node in enumerate(ordered.nodes) for ref in operands(node))


def test_fingers_keep_fewer_values_alive_than_a_recursive_evaluation(finger_graphs):
    for graph in finger_graphs:
        assert alive(schedule(graph)) < alive(depth_first(graph))


def test_the_order_does_not_depend_on_the_order_it_is_given(finger_graphs):
    for graph in finger_graphs:
        assert schedule(depth_first(graph)) == schedule(graph)


def test_a_sum_begins_with_a_positive_term_where_it_has_one():
    builder = Builder()
    x = [builder.input("x", i) for i in range(4)]
    terms = [builder.mul([x[0], x[1]]), builder.mul([x[1], x[2]]), builder.mul([x[2], x[3]])]
    total = builder.add([~terms[0], ~terms[1], terms[2]])
    ordered = schedule(builder.graph([Output("y", (1,), (total,))]))
    values = evaluate(ordered, Floats(np.float64), lambda leaf: np.float64((2.0, 3.0, 5.0, 7.0)[leaf[2]]))

    assert values["y"] == [35.0 - 6.0 - 15.0]
    assert all(node[1] >= 0 for node in ordered.nodes if node[0] == "add")


def test_c_adds_to_partial_sums_and_writes_what_is_known():
    text = Printer(schedule(weighted(6)), Options(), "").statements()
    (name,) = (re.match(r"double (s\d+) = ", line)[1] for line in text if line.startswith("double "))

    assert sum(line.startswith(f"{name} += ") for line in text) == 4
    assert [line[:8] for line in text if line.startswith("y_out[")] == ["y_out[1]", "y_out[0]"]


@pytest.mark.parametrize("own", [True, False])
def test_negated_and_repeated_outputs_are_written_where_their_value_is_known(own):
    builder = Builder()
    x = [builder.input("x", i) for i in range(2)]
    product = builder.mul([builder.call("sin", x[0]), x[1]])
    graph = builder.graph([Output("y", (3,), (product, ~product, x[0])), Output("z", (1,), (builder.const(2),))])
    text = Printer(schedule(graph), Options(math="own" if own else "libm"), "").statements()

    t = "t0" if own else "t1"  # a sine of the library has a variable of its own

    assert {line for line in text if re.match(r"[yz]_out\[", line)} == {
        f"y_out[0] = {t};", f"y_out[1] = -{t};", "y_out[2] = x_in[0];", "z_out[0] = 2.0;",
    }  # fmt: skip
