"""The solver of the Riccati equation (chapter 13), held against others: gains, what they cost, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb
from scipy.linalg import LinAlgError, solve_continuous_are

from awiwi_gen.verify.problems_riccati import chain, joint, optimum, tables

OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE = range(4)
PLANTS = 1000


def random_plants(count, seed=1):
    """Joints, integrator chains, matrices without structure, and these in coordinates of unlike size."""
    random = np.random.default_rng(seed)
    for i in range(count):
        C, r = random.normal(size=(4, 4)), 10 ** random.uniform(-3, 2)
        Q = np.diag(10 ** random.uniform(-2, 2, 4))
        m, b, k = 10 ** random.uniform([-7, -4, -1], [-4, -2, 1.3])
        if i % 4 == 0:
            yield *joint(m, b, k, random.uniform(0, 5e-3), random.uniform(0, 0.1)), Q, r
        elif i % 4 == 1:
            yield *chain(m, b, k), Q, r
        else:
            A, column, size = random.normal(size=(4, 4)), random.normal(size=4), np.ones(4)
            if i % 4 == 3:
                size = 10 ** random.uniform(-3, 3, 4)
            yield A * size[:, None] / size, column * size, C @ C.T / np.outer(size, size), r


def stacked(plants):
    return (np.array(part) for part in zip(*plants, strict=True))


def test_the_gains_are_those_of_scipy_on_a_thousand_plants(lib):
    plants = list(random_plants(PLANTS))
    got = lib.lqr(*stacked(plants))
    worst = []
    for S, (A, b, Q, r) in zip(got.S, plants, strict=True):
        known = solve_continuous_are(A, b[:, None], Q, np.array([[r]]))
        weight = np.sqrt(np.diag(known))  # both as seen from coordinates in which the diagonal is 1
        worst.append(np.abs((S - known) / np.outer(weight, weight)).max())

    assert np.all(got.status == OK)
    assert np.all(got.residual < 1e-11)
    assert np.median(worst) < 1e-12
    assert np.quantile(worst, 0.99) < 1e-8
    assert max(worst) < 1e-5


def test_where_they_differ_it_is_right_to_the_last_digit(lib):
    scipys = []
    for A, b, Q, r in random_plants(60, seed=7):
        exact = np.array([float(K) for K in optimum(A, b, Q, r)[0]])
        known = b @ solve_continuous_are(A, b[:, None], Q, np.array([[r]])) / r
        scipys.append(np.abs(known / exact - 1).max())

        assert np.abs(lib.lqr(A, b, Q, r).K / exact - 1).max() < 3e-16
    assert max(scipys) > 1e-12


def test_the_plants_of_the_tables_are_solved_to_the_last_digits(lib):
    plants = tables()
    got = lib.lqr(*stacked(plants))
    for K, S, plant in zip(got.K, got.S, plants, strict=True):
        gains, cost = ([float(x) for x in part] for part in optimum(*plant))

        assert pytest.approx(gains, rel=3e-16, abs=0) == K
        assert pytest.approx(cost, rel=3e-16, abs=0) == S.ravel()
    assert np.all(got.status == OK)


def test_the_optimum_of_table_16_1(lib):
    A, b = chain(7.2e-7, 2e-3, 0.605)
    K = lib.lqr(A, b, np.diag([100, 0.01, 0.01, 0.01]), 0.1).K

    assert pytest.approx((31.622776601684, 0.4401419396557, 2058.2239096652, 3.702444052883), rel=1e-12) == K


def unstable_corner(random, turned):
    """A matrix whose last mode grows or stands still, and coordinates in which that is not to be seen, or is."""
    A, turn = random.normal(size=(4, 4)), random.normal(size=(4, 4)) if turned else np.eye(4)
    A[3] = 0
    A[3, 3] = random.uniform(0.05, 3)
    return A, turn


def test_plants_that_cannot_be_stabilised_are_refused(lib):
    random = np.random.default_rng(3)
    found = []
    for i in range(1000):
        A, turn = unstable_corner(random, i % 2)
        b = random.normal(size=4)
        b[3] = 0
        found.append((turn @ A @ np.linalg.inv(turn), turn @ b, np.eye(4), 1.0))
    got = lib.lqr(*stacked(found))

    assert np.all(got.status == OUT_OF_DOMAIN)
    assert np.all(got.K == 0)


def test_a_mode_that_grows_for_nothing_is_refused(lib):
    """The Riccati equation has a stabilising solution then, but letting it grow costs less."""
    random = np.random.default_rng(9)
    found = []
    for i in range(1000):
        A, turn = unstable_corner(random, i % 2)
        C, back = random.normal(size=(4, 4)), np.linalg.inv(turn)
        C[:, 3] = 0
        found.append((turn @ A.T @ back, turn @ random.normal(size=4), back.T @ C.T @ C @ back, 1.0))
    got = lib.lqr(*stacked(found))

    assert np.all(got.status == OUT_OF_DOMAIN)


def test_weights_that_leave_a_joint_free_to_turn_away_are_refused(lib):
    random = np.random.default_rng(10)
    speeds, apart = np.diag([0, 0.01, 0, 0.01]), np.array([1.0, 0, -1, 0])
    found = []
    for i in range(500):
        m, b, k = 10 ** random.uniform([-7, -4, -1], [-4, -2, 1.3])
        plant = joint(m, b, k, random.uniform(0, 5e-3), random.uniform(0, 0.1))
        found.append((*plant, speeds + (i % 2) * np.outer(apart, apart), 10 ** random.uniform(-3, 2)))
    got = lib.lqr(*stacked(found))

    assert np.all(got.status == OUT_OF_DOMAIN)
    held = [(A, b, Q + np.diag([1e-3, 0, 0, 0]), r) for A, b, Q, r in found]
    assert np.all(lib.lqr(*stacked(held)).status == OK)


def test_a_mode_that_decays_by_itself_may_cost_nothing(lib):
    random = np.random.default_rng(11)
    found = []
    for _ in range(300):
        A, C = random.normal(size=(4, 4)), random.normal(size=(4, 4))
        A[:3, 3], C[:, 3] = 0, 0
        A[3, 3] = -random.uniform(0.05, 3)
        found.append((A, random.normal(size=4), C.T @ C, 1.0))
    got = lib.lqr(*stacked(found))

    assert np.all(got.status == OK)
    assert np.abs(got.S[:, 3]).max() < 1e-12 * np.abs(got.S).max()


def test_a_stable_plant_that_costs_nothing_is_left_alone(lib):
    got = lib.lqr(np.diag([-1.0, -2.0, -3.0, -4.0]), np.ones(4), np.zeros((4, 4)), 1.0)

    assert got.status == OK
    assert not got.K.any()
    assert not got.S.any()


def test_costs_that_reward_a_motion_are_refused(lib):
    random = np.random.default_rng(5)
    Q = random.normal(size=(500, 4, 4))
    Q = Q @ Q.swapaxes(1, 2)
    lowest, along = np.linalg.eigh(Q)
    along = along[:, :, 0]
    rewarding = Q - (lowest[:, 0] + 1e-6 * lowest[:, 3])[:, None, None] * along[:, :, None] * along[:, None, :]
    A, b = random.normal(size=(500, 4, 4)), random.normal(size=(500, 4))

    assert np.all(lib.lqr(A, b, Q, 1.0).status == OK)
    assert np.all(lib.lqr(A, b, rewarding, 1.0).status == OUT_OF_DOMAIN)


def test_modes_out_of_reach_that_die_by_themselves_are_no_obstacle(lib):
    random = np.random.default_rng(4)
    for _ in range(50):
        A, b = random.normal(size=(4, 4)), random.normal(size=4)
        A[3], b[3] = 0, 0
        A[3, 3] = -random.uniform(0.05, 3)
        got = lib.lqr(A, b, np.eye(4), 1.0)
        known = b @ solve_continuous_are(A, b[:, None], np.eye(4), np.eye(1))

        assert got.status == OK
        assert pytest.approx(known, rel=1e-6, abs=1e-9) == got.K


GOOD = (*joint(4e-7, 2e-3, 0.605, 0.0012, 0.0012), np.diag([10, 0.01, 1, 0.01]), 0.01)


@pytest.mark.parametrize("r", [0.0, -1.0])
def test_torque_that_costs_nothing_is_refused(lib, r):
    got = lib.lqr(*GOOD[:3], r)

    assert got.status == OUT_OF_DOMAIN
    assert np.all(got.K == 0)
    assert got.residual == 1


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_is_refused(lib, which, value):
    plant = [np.array(part, float) for part in GOOD]
    plant[which].flat[-1] = value
    got = lib.lqr(*plant)

    assert got.status == NOT_FINITE
    assert np.all(got.K == 0)
    assert np.all(got.S == 0)


def exact_residual(A, b, Q, r, S):
    """The residual of S without rounding: its largest entry relative to the terms on its diagonal."""
    n = range(4)
    A, Q, S = ([[arb(float(x)) for x in row] for row in matrix] for matrix in (A, Q, S))
    K = [sum(arb(float(b[i])) * S[i][j] for i in n) / arb(float(r)) for j in n]
    parts = [[[S[i][k] * A[k][j] for k in n] + [S[j][k] * A[k][i] for k in n] for j in n] for i in n]
    sums = [[float(sum(parts[i][j]) + Q[i][j] - K[i] * K[j] * arb(float(r))) for j in n] for i in n]
    terms = [float(sum(map(abs, parts[i][i])) + abs(Q[i][i]) + K[i] ** 2 * arb(float(r))) for i in n]
    return max(abs(sums[i][j]) / np.sqrt(terms[i] * terms[j]) for i in n for j in n)


def test_the_residual_is_told_truly_down_to_the_rounding_of_the_solution(lib):
    """What is told is for coordinates that the solver balances; plants of like size it leaves nearly as they are."""
    told, true = [], []
    for i, (A, b, Q, r) in enumerate(random_plants(240, seed=12)):
        if i % 4 == 2:
            got = lib.lqr(A, b, Q, r)
            told.append(got.residual)
            true.append(exact_residual(A, b, Q, r, got.S))
    ratio = np.array(told) / true

    assert np.median(told) < 1e-14
    assert ratio.min() > 0.1
    assert ratio.max() < 10


def test_it_recovers_at_the_next_good_call(lib):
    plants = [np.array([part, part, part], float) for part in GOOD]
    plants[0][1] = np.nan
    got = lib.lqr(*plants)

    assert got.status.tolist() == [OK, NOT_FINITE, OK]
    assert np.array_equal(got.K[0], got.K[2])


def test_scipy_agrees_that_some_plants_have_no_optimum():
    with pytest.raises(LinAlgError):
        solve_continuous_are(np.eye(2), np.array([[1.0], [0.0]]), np.eye(2), np.eye(1))
