"""Ends of searches that are no answers: what counts as another minimum, and where a reference goes downhill."""

from __future__ import annotations

from fractions import Fraction
from math import atan

import numpy as np
import pytest
from flint import arb

from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Output
from awiwi_gen.ir.passes.bind import bind
from awiwi_gen.tune.hand_gains import pretensions
from awiwi_gen.units import parse_quantity
from awiwi_gen.verify.other_minima import Found
from awiwi_gen.verify.problems import Descent

LOW, HIGH = 5.0, 100.0


def pair(f: float, wanted: float, missing: float = 0.0) -> Found:
    """Equal forces of two antagonists with arms of 1 m, whose springs have the stiffness 10 f + f^2 / 10."""
    forces, ones = np.full(2, f), np.ones(2)
    k, slope, curvature = 10 * forces + forces**2 / 10, 10 + forces / 5, 0.2 * ones
    return Found(
        forces, np.array([[1.0], [-1.0]]), np.zeros((2, 1, 1)), k, slope, curvature, np.array([[wanted]]), LOW, HIGH,
        np.array([missing]),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("force", "wanted", "is_minimum"),
    [
        (LOW, 0.0, True),  # too soft to be reached: all at the lower limit
        (HIGH, 1e5, True),
        (LOW, 1e5, False),  # leaving the limit brings it nearer
        (HIGH, 0.0, False),
        (50.0, 1500.0, True),
        (50.0, 1e5, False),  # so far out of reach that the distance curves down
    ],
)
def test_a_minimum_is_told_from_forces_that_want_to_leave_and_from_a_maximum(force, wanted, is_minimum):
    assert pair(force, wanted).is_minimum() is is_minimum


def test_a_torque_out_of_reach_holds_its_tendons_whatever_their_stiffness():
    assert not pair(HIGH, 0.0).is_minimum()
    assert pair(HIGH, 0.0, missing=1.0).is_minimum()


def test_distances_of_stiffness_are_those_of_all_entries():
    assert pair(50.0, 1500.0).distance == pytest.approx(0)
    assert pair(50.0, 1600.0).distance == pytest.approx(100)


def test_a_reference_halves_the_steps_of_gauss_and_newton_that_go_too_far():
    def measured(x: float) -> tuple[list[arb], list[arb]]:
        return [arb(-atan(3 * x))], [arb(3 / (1 + 9 * x * x))]

    descent = Descent([arb(1.5)], [arb(-1000)], [arb(1000)])
    assert abs(1.5 - atan(4.5) * (1 + 9 * 1.5**2) / 3) > 1.5  # a whole step ends farther away
    for _ in range(40):
        descent.move(*measured(float(descent.trial[0])))

    assert abs(float(descent.reached[0])) < 1e-12


def test_the_cosine_of_a_right_angle_is_zero_although_pi_is_not_exact():
    builder = Builder()
    cosine = builder.make("cos", (builder.param("angle"),))
    bound = bind(builder.graph([Output("c", (1,), (cosine,))]), {"angle": parse_quantity("90 deg").value})

    assert bound.nodes == (("const", Fraction(0)),)


def test_gains_are_checked_at_forces_that_the_springs_of_the_hand_can_have(lib):
    class Stiffer:
        class spring_elongation:  # noqa: N801 as in a library
            inputs = ({"low": [12.5], "high": [15.0]},)

    assert pretensions(lib) == [10.0, 20.0]
    assert pretensions(Stiffer) == [12.5, 15.0]
