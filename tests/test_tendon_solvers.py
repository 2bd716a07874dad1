"""The distribution's C by itself: fingers and springs that no hand has, how much work it is, and which tendons are pairs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import random_hands
import tendon_solvers as solvers
from tendon_solvers import (
    INFEASIBLE,
    NOT_CONVERGED,
    NOT_FINITE,
    OK,
    OUT_OF_DOMAIN,
    demand,
    fingers,
    quadratic,
)

import awiwi_gen
from awiwi_gen.emit.files import room_of
from awiwi_gen.kernels.fingers_control import INVERSIONS, SEARCHES, UPDATES, antagonists, distribution
from awiwi_gen.pipeline import Job
from awiwi_gen.resources import CSRC
from awiwi_gen.structure import groups

DOCS = Path(__file__).resolve().parent.parent / "docs"


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return solvers.compiled(tmp_path_factory.mktemp("solvers"))


def test_the_search_finds_what_the_formulas_of_pairs_give(library):
    random = np.random.default_rng(12)
    told, untold, *_ = fingers(library, random)

    for _ in range(200):
        tau, K = demand(told, random, 1.0)
        by_formula, by_search = told.distribute(tau, K), untold.distribute(tau, K)
        assert by_formula[0] == by_search[0] == OK
        assert np.abs(by_formula[1] - by_search[1]).max() < 1e-8


def test_the_bounds_told_are_those_of_the_header():
    header = (CSRC / "awiwi_distribution.h").read_text()
    most = {name: int(number) for name, number in re.findall(r"AWIWI_MOST_(\w+) = (\d+)", header)}

    assert most["INVERSIONS"] + 2 == INVERSIONS
    assert 2 + 4 * (1 + most["STIFFNESS_STEPS"]) == SEARCHES
    assert 2 + most["UPDATE_STEPS"] == UPDATES
    assert f"| {most['UPDATE_STEPS']} steps, {UPDATES} evaluations" in (DOCS / "solvers.md").read_text()
    assert f"| {INVERSIONS} evaluations" in (DOCS / "solvers.md").read_text()
    assert f"| {most['TORQUE_STEPS']} steps" in (DOCS / "solvers.md").read_text()
    assert f"2 + 4 x {SEARCHES // 4} evaluations" in (DOCS / "solvers.md").read_text()


def test_the_work_is_bounded_as_the_header_says_and_small(library):
    random = np.random.default_rng(13)
    counts = {"pairs": [0], "search": [0]}

    for _ in range(150):
        for finger in fingers(library, random):
            status, f = finger.distribute(*demand(finger, random, random.choice([0.0, 1.0, 10.0])))
            assert status == OK
            assert finger.low <= f.min() <= f.max() <= finger.high
            counts["pairs" if finger.pairs else "search"].append(finger.calls)

    assert max(counts["pairs"]) <= 6
    assert max(counts["search"]) <= 40


FIVE_OVER_TWO = [[16.39, -4.446], [5.81, -12.91], [-10.997, 12.91], [21.134, 0], [20.282, -12.91]]  # mm
SEVEN_OVER_FIVE = [
    [-1, -7.3, 2.3, -11.7, 4], [-13, 0, 0, 0, 0], [-13, -13.3, 0, 0, 0], [-13, 13.3, 9.6, 0, 0],
    [-13, -13.3, 9.6, -15, 0], [13, -13.3, 9.6, 15, 15.3], [13, 13.3, -9.6, 15, -15.3],
]  # fmt: skip


def test_most_stiffnesses_of_many_tendons_over_few_joints_are_reached(library):
    finger = solvers.Finger(library, np.array(FIVE_OVER_TWO) * 1e-3, quadratic)
    random, missed = np.random.default_rng(1), []

    for _ in range(300):
        forces = random.uniform(finger.low, finger.high, 5)
        wanted = finger.stiffness(forces)
        status, f = finger.distribute(-finger.P.T @ forces, wanted)
        assert status == OK
        missed.append(np.linalg.norm(finger.stiffness(f) - wanted) / np.linalg.norm(wanted))

    assert sum(each > 1e-9 for each in missed) <= 3  # of 14 from the middle, low and high forces alone
    assert max(missed) <= 0.01


def test_a_torque_of_forces_at_their_limits_is_within_reach(library):
    finger = solvers.Finger(library, np.array(SEVEN_OVER_FIVE) * 1e-3, quadratic)
    random = np.random.default_rng(2)

    for _ in range(3000):
        forces, kind = random.uniform(finger.low, finger.high, 7), random.uniform(size=7)
        forces = np.where(kind < 0.15, finger.low, np.where(kind < 0.3, finger.high, forces))
        inside = (
            np.linalg.matrix_rank(finger.P[(kind >= 0.3)]) == 5
        )  # else the torque is at the edge, and rounding decides
        if inside or np.sum(kind >= 0.3) > 3:
            assert finger.distribute(-finger.P.T @ forces, finger.stiffness(forces))[0] == OK


def test_solvers_of_a_smaller_hand_refuse_a_larger_one(tmp_path):
    finger = solvers.Finger(solvers.compiled(tmp_path, room=(2, 4)), np.array(FIVE_OVER_TWO) * 1e-3, quadratic)

    assert finger.distribute([0, 0], np.eye(2))[0] == OUT_OF_DOMAIN
    assert finger.by_gradient([0, 0], np.eye(2), 3, 1.0, 1.0)[0] == OUT_OF_DOMAIN
    assert finger.calls == 0


def test_solvers_have_room_for_the_largest_finger_of_a_hand():
    hand = awiwi_gen.Hand.parse(random_hands.hand(47))
    (finger,) = hand.fingers.values()

    assert room_of(Job(hand).kernels) == (8, 18) == (len(finger.joints), len(finger.pulled))
    assert room_of([]) == (4, 4)


@pytest.mark.parametrize("kind", ["slack", "steps", "flat", "falling", "saw"])
def test_springs_that_no_spring_is_like_end_within_the_bounds(library, kind):
    random = np.random.default_rng(14)
    curves = {
        "slack": lambda f: (0.0, 0.0, 0.0),
        "steps": lambda f: (5000 + 3000 * np.floor(f / 10), 0.0, 0.0),
        "flat": lambda f: (5000.0, 0.0, 0.0),
        "falling": lambda f: (20000 - 150 * f, -150.0, 0.0),
        "saw": lambda f: (5000 + 400 * (f % 7), 400.0, 0.0),
    }

    for _ in range(60):
        for finger in fingers(library, random):
            tau, K = demand(finger, random, 1.0)
            finger.curve = curves[kind]
            status, f = finger.distribute(tau, K)
            assert finger.calls <= INVERSIONS + SEARCHES
            assert finger.low <= f.min() <= f.max() <= finger.high
            assert status in (OK, NOT_CONVERGED)
            assert np.abs(finger.P.T @ f + tau).max() < 1e-13


@pytest.mark.parametrize("share", [0.0, 0.2, 0.4, 0.6, 1.0])
def test_alike_tendons_share_a_force_unequally_where_only_that_is_stiff_enough(library, share):
    finger = solvers.Finger(library, [[0.009], [-0.009], [-0.009]], quadratic)
    wanted = np.array([100, 5 + 90 * share, 95 - 90 * share])  # the first is at its limit

    status, f = finger.distribute(-finger.P.T @ wanted, finger.stiffness(wanted))

    assert status == OK
    assert np.abs(np.sort(f) - np.sort(wanted)).max() < 1e-7


def test_alike_tendons_at_one_limit_do_not_slow_the_search(library):
    random = np.random.default_rng(19)
    directions = random.normal(size=(9, 4)) * 0.01
    directions[random.uniform(size=directions.shape) < 0.3] = 0
    P = np.concatenate([directions[:3], directions])
    P[-1] -= P.sum(axis=0)
    finger = solvers.Finger(library, P, quadratic)
    calls = []

    for _ in range(11):
        kind, forces = random.uniform(size=12), random.uniform(finger.low, finger.high, 12)
        forces = np.where(kind < 0.3, finger.low, np.where(kind < 0.5, finger.high, forces))
        off = random.normal(size=(4, 4)) * random.choice([0.1, 1.0])
        wanted = finger.stiffness(forces) * random.uniform(0.3, 3) + off + off.T
        assert finger.distribute(-P.T @ forces, wanted)[0] == OK
        calls.append(finger.calls)

    assert calls[-1] <= 40  # 143 where a tendon that blocks a way off a saddle is not held


def test_tendons_that_pull_at_nothing_give_no_torque_and_forces_within_limits(library):
    for finger in fingers(library, np.random.default_rng(20)):
        finger.P *= 0
        for tau, expected in ((np.zeros(2), OK), (np.array([0.1, 0.0]), INFEASIBLE)):
            status, f = finger.distribute(tau, np.eye(2))

            assert status in (expected, NOT_FINITE)
            assert finger.low <= f.min() <= f.max() <= finger.high


def test_a_curve_that_ends_too_early_is_a_status(library):
    for finger in fingers(library, np.random.default_rng(15)):
        tau, K = demand(finger, np.random.default_rng(16), 0.0)
        finger.curve = lambda f: quadratic(f) if 20 < f < 80 else None

        status, f = finger.distribute(tau, K)

        assert status == OUT_OF_DOMAIN
        assert np.all(f == 0)  # neither limit is on the curve


def test_a_hand_without_springs_takes_its_limits_of_stiffness(root):
    hand = awiwi_gen.Hand.load(root / "tests" / "one_finger.toml")
    lib = awiwi_gen.build(hand)
    tension = np.array([0.0, 50.0, 100.0])

    k, slope, curvature, status = lib.jaw_tendon_stiffness(tension)

    assert status == 0
    assert np.allclose(k, [1000, 25500, 50000])
    assert np.allclose(slope, 490)
    assert np.all(curvature == 0)
    random = np.random.default_rng(17)
    f = random.uniform(1, 99, (500, 3))
    P = lib.jaw_coupling(np.zeros(2))
    K = np.einsum("si,ia,ib->sab", lib.jaw_tendon_stiffness(f).k, P, P)
    found = lib.jaw_tendon_distribution(np.zeros(2), -f @ P, K, 0.0, 100.0)
    assert not found.status.any()
    assert np.abs(found.f - f).max() < 1e-8


# -- which tendons are pairs --------------------------------------------------------------------------------


def test_pairs_and_spans_are_read_off_the_routing(hand):
    found = {
        name: [(group, antagonists(finger, group)) for group in groups(finger)] for name, finger in hand.fingers.items()
    }

    assert found["index"] == [([0, 1, 2, 3], [(0, 3), (1, 2)]), ([4, 5, 6, 7], [(4, 5), (6, 7)])]
    assert found["thumb"] == [([0, 1, 2, 3], []), ([4, 5, 6, 7], [(4, 5), (6, 7)])]
    assert found["ring"] == [([0, 1, 2, 3], [(0, 3), (1, 2)]), ([4, 5], [(4, 5)])]
    assert found["fifth"][0] == ([0, 1], [(0, 1)])


def test_every_pair_is_a_direction_of_the_null_space_and_they_fill_it(lib, hand):
    for name in ("index", "middle", "ring", "fifth"):
        P = lib[f"{name}_coupling"](np.zeros(len(hand.fingers[name].joints)))
        pairs = [pair for group in groups(hand.fingers[name]) for pair in antagonists(hand.fingers[name], group)]
        moves = np.zeros((len(pairs), len(P)))
        for move, pair in zip(moves, pairs, strict=True):
            move[list(pair)] = 1

        assert np.abs(moves @ P).max() == 0
        assert len(pairs) == len(P) - np.linalg.matrix_rank(P)


def test_tendons_that_are_no_independent_pairs_are_searched(root):
    finger = awiwi_gen.Hand.load(root / "tests" / "one_finger.toml").fingers["jaw"]
    twice = finger.model_copy(update={"tendons": finger.tendons[2:] * 2})

    assert distribution(finger).strings["searched"] == "0, 1, 2"
    assert distribution(twice).strings["searched"] == "0, 1"


def test_updates_from_any_forces_are_short_and_end_where_the_forces_give_the_torque(library):
    random, rounds = np.random.default_rng(8), []

    for _ in range(60):
        for finger in fingers(library, random):
            tau, K = demand(finger, random, random.choice([0.0, 1.0, 10.0]))
            whole, best = finger.distribute(tau, K)
            f, status, count = random.uniform(-20, 120, len(finger.P)), NOT_CONVERGED, 0
            while status == NOT_CONVERGED and count < 30:
                status, f = finger.distribute(tau, K, last=f)
                assert finger.calls <= INVERSIONS + UPDATES
                assert finger.low <= f.min() <= f.max() <= finger.high
                count += 1
            assert status == whole
            if whole == OK:
                assert np.abs(finger.P.T @ f + tau).max() < 1e-13
            assert np.abs(finger.P.T @ (f - best)).max() < 1e-9
            again = finger.distribute(tau, K, last=f)
            assert again[0] == status
            assert np.abs(again[1] - f).max() < 1e-6
            rounds.append(count)

    assert np.median(rounds) <= 2


def test_an_update_at_a_corner_of_the_limits_ends_although_each_tendon_has_to_be_looked_at(library):
    random, corners = np.random.default_rng(3), 0
    for _ in range(20):
        finger = solvers.Finger(library, random.uniform(-0.01, 0.01, (8, 2)), quadratic)
        tau, K = random.normal(size=2) * 100, np.diag(random.uniform(1, 5, 2))  # far out of reach
        f = finger.distribute(tau, K)[1]

        status, again = finger.distribute(tau, K, last=f)
        assert status == INFEASIBLE
        assert np.abs(again - f).max() < 1e-9
        corners += np.isin(f, [finger.low, finger.high]).all()

    assert corners > 10


def test_an_update_refuses_forces_that_are_no_numbers(library):
    finger = next(iter(fingers(library, np.random.default_rng(8))))
    finger.pairs = []

    status, f = finger.distribute(
        np.zeros(finger.P.shape[1]), np.eye(finger.P.shape[1]), last=np.full(len(finger.P), np.nan)
    )

    assert status == NOT_FINITE
    assert finger.low <= f.min() <= f.max() <= finger.high
