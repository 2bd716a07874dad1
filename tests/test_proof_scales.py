"""What verification compares on a legal hand where something vanishes, is not unique, or lies at a limit."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from math import inf

import numpy as np
import pytest
import random_hands
from flint import arb
from samples import ONE_FINGER

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Output
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.records import problem_of
from awiwi_gen.verify.physics import Motion, the_rate_of_M_less_2C_is_skew_symmetric
from awiwi_gen.verify.reference import ball_values, disagreement, term_size
from awiwi_gen.verify.verdict import judge_solver

POINTS = {"x": np.linspace(0.1, 2, 20)[:, None]}
TINY = arb(0, 1e-70)  # zero, as far as it is known


def cancelling(factor: Fraction):
    """sin(x)^2 + cos(x)^2 - factor, times 1000: zero for a factor of 1."""
    builder = Builder()
    sine, cosine = (builder.call(name, builder.input("x", 0)) for name in ("sin", "cos"))
    squares = [builder.mul((each, each)) for each in (sine, cosine)]
    total = builder.add((*squares, builder.const(-factor)))
    return builder.graph([Output("y", (), (builder.mul((builder.const(1000), total)),))])


# -- an output that is zero everywhere ----------------------------------------------------------------------


def test_an_output_that_cancels_is_compared_on_the_scale_of_its_terms():
    zero, nearly = cancelling(Fraction(1)), cancelling(Fraction(1) + Fraction(1, 10**20))
    values = [ball_values(graph, POINTS, {}) for graph in (zero, nearly)]

    def size(name):
        return term_size(zero, POINTS, {}, name)

    assert 1500 < size("y") < 4000
    assert disagreement(values[0], {"y": [[arb(0)] * 20]}, size) < 1e-70
    assert 1e-21 < disagreement(*values, size) < 1e-20


def test_without_a_size_of_terms_no_difference_from_zero_is_accepted():
    assert disagreement({"y": [[TINY]]}, {"y": [[arb(0)]]}) == inf
    assert disagreement({"y": [[TINY]]}, {"y": [[arb(0)]]}, lambda _: 0.0) == inf


def test_a_value_that_is_not_a_number_never_agrees():
    assert disagreement({"y": [[arb("nan")]]}, {"y": [[arb(0)]]}, lambda _: 1.0) == inf


@pytest.fixture(scope="module")
def one_joint():
    return Hand.parse(random_hands.hand(2, 1, set()))


def test_a_single_joint_has_no_coriolis_matrix_and_the_law_of_its_skew_rate_still_judges(one_joint):
    job = Job(one_joint, only="one_[cm]*_matrix")
    graphs = {kernel.family: job.records[kernel.name].graph for kernel in job.kernels}
    inputs = {name: np.full((3, 1), value) for name, value in (("q", 0.3), ("qd", 2.0))}
    motion = Motion(graphs, inputs, {})
    outputs = [motion.at(family) for family in ("mass_matrix", "coriolis_matrix")]
    residual, terms = the_rate_of_M_less_2C_is_skew_symmetric(motion, *outputs)

    assert all(x.contains(0) for x in outputs[1]["C"].flat)
    assert max(float(x.abs_upper()) for x in residual.flat) < 1e-40 * max(float(x) for x in terms)


# -- tendon forces that are not unique ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def alike():
    """The distribution of a finger with three tendons over one joint: its problem, record and C function."""
    job = Job(Hand.parse(random_hands.hand(1, 1, {"alike"})), only="one_tendon_distribution")
    kernel = next(kernel for kernel in job.kernels if kernel.name == job.only)
    used = {family: job.records[name] for family, name in kernel.needs.items()}
    problem, record = problem_of(kernel, used), job.records[kernel.name]
    return problem, record, load(cached_tree(job), job.store)[kernel.name]


def judged(alike, change):
    problem, record, function = alike

    def call(inputs):
        found = function(**inputs)
        return found._replace(f=change(found.f, inputs))

    def observed(found):
        return problem.observed(record.inputs, found)

    other = partial(problem.other_reference, record.inputs)
    return judge_solver("kernel", record.reference, {}, observed, other, record.inputs, call, 1e-11, 0)


def test_forces_that_are_not_unique_are_judged_by_what_they_do(alike):
    record = alike[1]

    assert {"torque", "stiffness", "outside", "status"} == set(record.reference.high)
    assert judged(alike, lambda f, _: f).passed


@pytest.fixture
def twins(alike):
    """The two tendons over the same pulley in the same sense."""
    P = alike[0].tendons(alike[1].inputs["q"])[0][0]
    found = [i for i in range(len(P)) if np.array_equal(P[i], P[-1])]  # the last tendon repeats one before it
    assert len(found) == 2
    return found


def test_other_forces_of_the_same_effect_pass(alike, twins):
    exchanged = np.arange(len(alike[0].solver.equations))
    exchanged[twins] = twins[::-1]

    assert judged(alike, lambda f, _: f[:, exchanged]).passed


def test_forces_of_another_effect_fail(alike):
    assert not judged(alike, lambda f, _: f + 1e-6).passed


def test_forces_beyond_their_limits_fail_although_their_effect_is_right(alike, twins):
    def beyond(f, _):
        f = f.copy()
        f[:, twins] += 1000.0, -1000.0
        return f

    verdict = judged(alike, beyond)

    assert not verdict.passed
    assert verdict.worst_scaled_error > 100  # newtons outside the limits


# -- estimates at the limits --------------------------------------------------------------------------------


def test_the_reference_of_an_estimate_stays_within_a_narrow_range():
    job = Job(Hand.parse(random_hands.hand(1, 2, {"spans", "narrow range"})), only="one_joint_estimate")
    kernel = next(kernel for kernel in job.kernels if kernel.name == job.only)
    low, high = (np.array(kernel.solver.arrays[end]) for end in ("low", "high"))
    q = job.records[kernel.name].reference.high["q"]

    assert (high - low).min() < 0.17
    assert ((q >= low) & (q <= high)).all()
    inside = (q > low + 1e-9) & (q < high - 1e-9)
    assert inside.any(axis=0).all()
    assert not inside.all()


def test_a_four_bar_whose_range_leaves_zero_out_starts_parallel_at_the_near_end():
    hand = Hand.parse(random_hands.hand(1, 1, {"four-bar without zero"}))
    link = hand.fingers["one"].links[0]
    job = Job(hand, only="one_link_poses")
    near_end = min((float(link.low), float(link.high)), key=abs)
    axes = load(cached_tree(job), job.store).one_link_poses([near_end]).T[0, :3, :3]

    assert float(link.low) * float(link.high) > 0
    np.testing.assert_allclose(axes, np.round(axes), atol=1e-12)  # nothing but the quarter turn before the joint


def test_a_four_bar_whose_range_holds_zero_has_the_structure_it_always_had():
    finger = Hand.parse(ONE_FINGER).fingers["jaw"]

    assert finger.structure()["links"][0] == ["root", "none", 1]
    assert finger.links[0].start == 0
