"""Gains of the impedance law from feedback gains (chapter 16): in closed form, by Newton's method, and by chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from awiwi_gen.loops.joint import TABLE_16_1, Plant
from awiwi_gen.reproduce.gain_search import PRINTED_BOX, USEFUL_BOX, draw, nearest

OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE = range(4)
UNIT = np.array([1.0, 1.0])
K_TABLE_16_1 = np.array([31.622776601684, 0.4401419396557, 2058.2239096652, 3.702444052883])
PLANT = Plant(1e-4, 2e-3, 0.6)


def random_gains(count, seed=0):
    """Plants, gains and weights of which each matters for the feedback."""
    random = np.random.default_rng(seed)
    m, b, k = 10 ** random.uniform([-5, -3.5, -1], [-3, -2, 1], (count, 3)).T
    stiffness = k * random.uniform(0.2, 2, count)
    pace = np.sqrt(stiffness / m)
    damping = m * pace * random.uniform(0.4, 1.0, count)
    fast, slow = pace * random.uniform(1.0, 2.0, count), pace * random.uniform(0.1, 0.4, count)
    weight = random.uniform(2.0, 8.0, count) / stiffness
    inertia = weight / (fast * slow) / random.uniform(0.2, 1.0, count)
    return (
        np.stack([m, b, k], axis=1), np.stack([stiffness, damping, fast, slow], axis=1),
        np.stack([weight, inertia], axis=1),
    )  # fmt: skip


def feedback(lib, plant, gains, weights):
    return lib.backstepping_state_gains(plant, gains, weights).K_cancelled


# -- in closed form -----------------------------------------------------------------------------------------


def test_the_rates_are_found_again(lib):
    plant, gains, weights = random_gains(2000)
    wanted = feedback(lib, plant, gains, weights)

    found = lib.optimal_backstepping_rates(wanted, plant, gains[:, :2], weights)

    assert not found.status.any()
    assert np.abs(found.rates / gains[:, 2:] - 1).max() < 1e-9


def test_rates_match_the_gains_of_torque_for_any_impedance_or_say_that_none_do(lib):
    plant, gains, weights = random_gains(2000, seed=1)
    wanted = feedback(lib, plant, gains, weights)
    impedance = gains[:, :2] * np.random.default_rng(2).uniform(0.1, 3, (2000, 2))

    found = lib.optimal_backstepping_rates(wanted, plant, impedance, weights)
    there = found.status == OK
    matched = feedback(lib, plant, np.concatenate([impedance, found.rates], axis=1), weights)

    assert 0.1 < there.mean() < 0.9
    assert np.abs(matched / wanted - 1)[there, 2:].max() < 1e-9
    assert np.all(found.rates[there] > 0)
    assert np.all(found.status[~there] == OUT_OF_DOMAIN)


def test_the_weights_are_found_again(lib):
    plant, gains, weights = random_gains(2000, seed=3)
    wanted = feedback(lib, plant, gains, weights)

    found = lib.optimal_backstepping_weights(wanted, plant, gains[:, :2])

    assert not found.status.any()
    assert np.abs(found.rates / gains[:, 2:] - 1).max() < 1e-8
    assert np.abs(found.weights / weights - 1).max() < 1e-8


# -- all four gains -----------------------------------------------------------------------------------------


def test_all_four_gains_are_found_near_the_start(lib):
    plant, gains, weights = random_gains(1000, seed=4)
    wanted = feedback(lib, plant, gains, weights)
    start = gains * np.random.default_rng(5).uniform(0.95, 1.05, gains.shape)

    found = lib.optimal_backstepping(wanted, plant, weights, start)
    matched = feedback(lib, plant, np.concatenate([found.impedance, found.rates], axis=1), weights)

    assert not found.status.any()
    assert np.abs(matched / wanted - 1).max() < 1e-12


def test_gains_are_never_called_equal_that_are_not(lib):
    """From far away the method may end elsewhere or nowhere, but then it says so."""
    plant, gains, weights = random_gains(1000, seed=6)
    wanted = feedback(lib, plant, gains, weights)
    start = gains * 10 ** np.random.default_rng(7).uniform(-2, 2, gains.shape)

    found = lib.optimal_backstepping(wanted, plant, weights, start)
    nearest_found = np.concatenate([found.impedance, found.rates], axis=1)
    miss = np.abs(feedback(lib, plant, nearest_found, weights) / wanted - 1).max(axis=1)

    assert np.array_equal(found.status == OK, miss < 1e-11)
    assert set(found.status) <= {OK, NOT_CONVERGED}
    assert np.all(nearest_found > 0)


def test_table_16_1_has_no_gains_and_the_nearest_are_returned(lib):
    """K_3 is at least (b / k) (1 + 1 / m) = 4591 whatever the gains, and the table's is 2058."""
    start = np.array([0.5, 1e-3, 100.0, 100.0])
    found = lib.optimal_backstepping(K_TABLE_16_1, np.array(TABLE_16_1.numbers), UNIT, start)
    gains = np.array([*found.impedance, *found.rates])
    least = TABLE_16_1.b / TABLE_16_1.k * (1 + 1 / TABLE_16_1.m)

    assert found.status == OUT_OF_DOMAIN
    assert pytest.approx(4591.37, rel=1e-6) == least
    assert feedback(lib, np.array(TABLE_16_1.numbers), gains, UNIT)[2] >= least
    assert np.isfinite(gains).all()


def test_where_no_gains_do_scipy_finds_none_nearer(lib):
    plant, start = np.array(PLANT.numbers), np.array([0.5, 1e-3, 100.0, 100.0])
    wanted = np.array([20.0, 0.4, 25.0, 1.0])  # the third is below (b / k) (1 + 1 / m) = 33.3

    def miss(logarithms):
        return feedback(lib, plant, start * np.exp(logarithms), UNIT) / wanted - 1

    found = lib.optimal_backstepping(wanted, plant, UNIT, start)
    ours = np.linalg.norm(miss(np.log(np.array([*found.impedance, *found.rates]) / start)))
    theirs = np.linalg.norm(least_squares(miss, np.zeros(4), bounds=(-13.8, 13.8), xtol=1e-14, ftol=1e-14).fun)

    assert found.status == OUT_OF_DOMAIN
    assert ours <= theirs * (1 + 1e-6)


# -- bad input ----------------------------------------------------------------------------------------------

START = np.array([0.5, 1e-3, 100.0, 100.0])


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize(("bad", "status"), [
    (np.nan, NOT_FINITE), (np.inf, NOT_FINITE), (0.0, OUT_OF_DOMAIN), (-1.0, OUT_OF_DOMAIN),
])  # fmt: skip
def test_what_is_no_gain_or_plant_is_refused_and_the_next_call_is_good(lib, which, bad, status):
    plant = np.array(PLANT.numbers)
    good = [feedback(lib, plant, START, UNIT), plant, UNIT, START]
    for element in range(len(good[which])):
        given = [part.copy() for part in good]
        given[which][element] = bad
        found = lib.optimal_backstepping(*given)

        assert found.status == status
        expected = np.zeros(4) if status == NOT_FINITE else given[3]
        assert np.array_equal([*found.impedance, *found.rates], expected)
        assert lib.optimal_backstepping(*good).status == OK


@pytest.mark.parametrize("name", ["rates", "weights"])
def test_the_closed_forms_never_call_good_what_is_not_positive(lib, name):
    plant, gains, weights = (part[0] for part in random_gains(1))
    kernel = getattr(lib, f"optimal_backstepping_{name}")
    good = [feedback(lib, plant, gains, weights), plant, gains[:2], *([weights] if name == "rates" else [])]
    assert kernel(*good).status == OK

    for part in range(len(good)):
        for element in range(len(good[part])):
            given = [each.copy() for each in good]
            for bad in (0.0, -1.0, np.nan) if part else (np.nan,):  # feedback gains may have any sign
                given[part][element] = bad
                refused = kernel(*given).status == OUT_OF_DOMAIN
                assert refused or (name == "rates" and part == 0 and element < 2)  # these two it does not read


# -- by chance ----------------------------------------------------------------------------------------------


def test_algorithm_3_mended_comes_near_where_gains_exist_and_never_as_near_as_newton(lib):
    plant = np.array(PLANT.numbers)
    wanted = feedback(lib, plant, START, UNIT)
    drawn = nearest(lib, PLANT, wanted, draw(USEFUL_BOX, 20000, 0))

    found = lib.optimal_backstepping(wanted, plant, UNIT, drawn.gains)
    exact = np.abs(feedback(lib, plant, np.array([*found.impedance, *found.rates]), UNIT) / wanted - 1).max()

    assert drawn.cost < 0.5
    assert found.status == OK
    assert exact < 1e-11


def test_algorithm_3_as_printed_draws_from_where_no_useful_gains_are(lib):
    wanted = feedback(lib, np.array(PLANT.numbers), START, UNIT)
    costs = [nearest(lib, PLANT, wanted, draw(box, 20000, 1)).cost for box in (PRINTED_BOX, USEFUL_BOX)]

    assert costs[0] > 5 * costs[1]
