"""The numbers that the source prints, against ours: what is told of them is computed, and computed again here."""

from __future__ import annotations

import re

import numpy as np
import pytest

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import (
    TABLE_13_1,
    TABLE_14_2,
    TABLE_15_1,
    TABLE_16_1,
    impedance_loop,
    normalised_loop,
    position_loop,
)
from awiwi_gen.loops.pair import TABLE_PAIR, at_rest, pair_loop
from awiwi_gen.loops.regulator import cancelling, regulator
from awiwi_gen.loops.sampled import is_implementable
from awiwi_gen.reproduce.figures import linear
from awiwi_gen.reproduce.figures.backstepping import OUTER, STEP, rise
from awiwi_gen.reproduce.gain_search import PRINTED_BOX, draw, nearest
from awiwi_gen.reproduce.printed import all_numbers
from awiwi_gen.reproduce.printed.backstepping import FIGURE_15_16
from awiwi_gen.reproduce.printed.linear import GAINS_13_11, fit_13_11
from awiwi_gen.results import compared, same_digits


@pytest.fixture(scope="module")
def numbers(lib, hand):
    return all_numbers(lib, hand)


# -- one number --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("printed", "ours", "same"),
    [
        *(("0.605", 0.6054, True), ("0.605", 0.6056, False), ("4600", 4591.4, True), ("4600", 4450.0, False)),
        *(("-0.0100", -0.01002, True), ("-0.0100", -0.0102, False), ("2e-4", 2.4e-4, True), ("2e-4", 2e-3, False)),
    ],
)
def test_a_number_agrees_if_it_rounds_to_the_digits_that_are_printed(printed, ours, same):
    assert same_digits(printed, ours) is same


def test_a_number_that_differs_is_a_misprint_by_default():
    assert compared("eq. 1", "1.5", 1.5, "").verdict == "agrees"
    assert compared("eq. 1", "1.5", 1.6, "").verdict == "misprint"
    assert compared("eq. 1", "1.5", 1.6, "", "not reproducible").verdict == "not reproducible"


# -- the table ---------------------------------------------------------------------------------------------


def test_every_chapter_of_part_2_with_numbers_is_in_the_table_in_order(numbers):
    chapters = [int(re.search(r"\d+", number.where)[0]) for number in numbers]

    assert chapters == sorted(chapters)
    assert set(chapters) == set(range(7, 17))


def test_every_row_has_the_printed_number_ours_and_a_reason(numbers):
    assert all(number.printed and number.ours and number.reason for number in numbers)
    assert {number.verdict for number in numbers} == {"agrees", "misprint", "not reproducible"}


@pytest.mark.parametrize(
    ("where", "verdicts"),
    [
        ("eq. 12.16, det(J)", ["agrees"]),
        ("eq. 12.18", ["not reproducible"] * 4),
        ("eq. 13.11, K1 + K3", ["agrees"]),
        ("eq. 15.70, gain of tau", ["misprint"]),
        ("eq. 16.3", ["agrees", "agrees", "agrees", "misprint"]),
        ("tables 16.1, 16.2", ["misprint"] * 4),
        ("chapters 14 and 16, tendons", ["agrees"]),
    ],
)
def test_the_table_has_the_verdicts_of_known_misprints(numbers, where, verdicts):
    assert [number.verdict for number in numbers if number.where.startswith(where)] == verdicts


def test_a_hand_without_motors_and_wrist_has_the_numbers_that_need_none(root, lib):
    claw = Hand.load(root / "examples" / "claw.toml")

    assert len(all_numbers(lib, claw)) > 50


# -- chapters 13 and 14 ------------------------------------------------------------------------------------


def test_a_heavier_motor_than_that_of_table_13_1_gives_eq_13_11(lib):
    fitted = fit_13_11(lib)
    K = fitted.optimum(lib)

    assert all(same_digits(text, gain) for text, gain in zip(GAINS_13_11, K, strict=True))
    assert 2 * TABLE_13_1.b < fitted.b < 2.1 * TABLE_13_1.b
    for friction in (0.0, TABLE_13_1.dq):
        table = TABLE_13_1.with_(dq=friction, dtheta=friction).optimum(lib)
        assert not any(same_digits(text, gain) for text, gain in zip(GAINS_13_11, table, strict=True))


def test_of_the_claims_on_optimal_gains_only_the_one_on_torque_holds(lib):
    settling, torque = linear.optimal(lib)

    assert (settling.number, settling.holds) == ("13.2", False)
    assert (torque.number, torque.holds) == ("13.3", True)


def test_no_gains_of_chapter_14_run_on_the_clock(lib):
    K = TABLE_14_2.optimum(lib)
    slower = TABLE_14_2.optimum(lib, linear.COST_14)

    assert not is_implementable(TABLE_14_2.A, TABLE_14_2.B, K).implementable
    assert is_implementable(TABLE_14_2.A, TABLE_14_2.B, slower).implementable


# -- chapters 15 and 16 ------------------------------------------------------------------------------------


def test_the_inertia_of_table_15_1_is_a_tenth_of_rotor_times_ratio_squared():
    assert pytest.approx(10 * TABLE_15_1.b) == TABLE_16_1.b == 2e-7 * 100**2


def test_figures_15_7_and_15_8_are_of_the_impedance_law(lib):
    """Rise times by K2 from 1 to 5: a damping makes the link slower, and that of the position law makes it faster."""
    times = np.linspace(0, 10, 1001)

    def rises(build):
        return [rise(times, build(lib, TABLE_15_1, (5.0, K2, *OUTER)).step(STEP, times)) for K2 in (1.0, 5.0)]

    faster, slower = rises(position_loop), rises(normalised_loop)
    assert faster[1] < faster[0] / 2
    assert slower[1] > 2 * slower[0]
    assert normalised_loop(lib, TABLE_15_1, (50.0, 1.0, *OUTER)).step(STEP, times).max() > 1.5 * STEP


def test_the_rate_of_the_load_cannot_be_neglected_with_the_printed_gains(lib):
    times = np.linspace(0, 1.0, 2001)
    fed = impedance_loop(lib, TABLE_15_1, FIGURE_15_16, fed=(1.0, 0.0))
    deflexion = fed.at_rest([0.2, 0.0])[0]

    assert deflexion == pytest.approx(0.2 / FIGURE_15_16[0])
    assert fed.response(np.zeros(4), times, [0.2, 0.0])[:, 0].max() > 40 * deflexion


def test_the_printed_damping_does_not_run_on_the_clock(lib):
    printed = impedance_loop(lib, TABLE_15_1, FIGURE_15_16)
    other = impedance_loop(lib, TABLE_16_1, FIGURE_15_16)
    softer = impedance_loop(lib, TABLE_16_1, (0.5, 0.0012, 100.0, 100.0))

    assert printed.poles().real.max() < 0
    assert [printed.sampled_radius(delay) for delay in (0, 1)] == pytest.approx([13.7, 3.8], abs=0.05)
    assert [other.sampled_radius(delay) for delay in (0, 1)] == pytest.approx([22.7, 4.9], abs=0.05)
    assert printed.delay_margin() < 25e-6
    assert softer.sampled_radius() < 1


def test_the_printed_decoupling_loses_the_pretension(lib):
    rests = [
        at_rest(*pair_loop(law, TABLE_PAIR, FIGURE_15_16[:2], pretension=0.15))[2::2]
        for law in (lib.backstepping_antagonistic, lib.backstepping_antagonistic_decoupled)
    ]

    assert rests[0] == pytest.approx(0.15)
    assert np.abs(rests[1]).max() < 0.01 * 0.15


def test_the_gains_of_table_16_1_are_poles():
    plant = TABLE_16_1
    loop = impedance_free(plant, regulator(plant, np.eye(4), 1.0, cancelled=True))
    poles = np.sort(np.linalg.eigvals(loop).real) / 100

    assert all(same_digits(t, p) for t, p in zip(("-7.7018", "-3.8384", "-3.8384", "-0.0100"), poles, strict=True))


def impedance_free(plant, gains):
    """The loop of table 16.1, whose spring is cancelled, under feedback gains."""
    A = np.diag([1.0, 1 / plant.m, 1.0], 1)
    A[3] -= plant.k / plant.b * gains
    return A


def test_the_two_plants_of_chapter_16_differ_by_cancelling_the_spring(lib):
    found = lib.backstepping_state_gains(plant=TABLE_16_1.numbers, gains=(1.0, 1e-3, 100.0, 100.0), weights=(1.0, 1.0))

    assert pytest.approx(found.K + cancelling(TABLE_16_1), rel=1e-12) == found.K_cancelled


def test_algorithm_3_as_printed_finds_gains_that_hardly_move(lib):
    wanted = regulator(TABLE_16_1, np.diag([100.0, 0.01, 0.01, 0.01]), 0.1, cancelled=True)
    found = nearest(lib, TABLE_16_1, wanted, draw(PRINTED_BOX, 2000, 1), relative=False)

    assert -0.5 < impedance_loop(lib, TABLE_16_1, found.gains).poles().real.max() < 0
