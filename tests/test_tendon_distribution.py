"""Tendon forces for a torque and a stiffness (chapter 7), against optimisers that know nothing of tendons."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from tendon_demands import HIGH, LOW, Demands
from tendon_solvers import INFEASIBLE, NOT_FINITE, OK, OUT_OF_DOMAIN

from awiwi_gen.kernels.fingers_control import antagonists
from awiwi_gen.structure import groups
from awiwi_gen.verify import nearest_forces

FINGERS = ["thumb", "index", "middle", "ring", "fifth"]
SHAPES = ["thumb", "index", "ring"]  # of routing: the others are like the index
PAIRED = ["index", "ring", "fifth"]
GRID = 27


# -- what the forces must do --------------------------------------------------------------------------------


@pytest.mark.parametrize("finger", FINGERS)
@pytest.mark.parametrize("reachable", [True, False])
def test_a_torque_within_reach_is_exact_and_no_limit_is_violated(lib, finger, reachable):
    demands = Demands(lib, finger, 3000)
    if not reachable:
        demands.unreachable()

    found = demands.solved()

    assert not found.status.any()
    assert found.f.min() >= LOW
    assert found.f.max() <= HIGH
    assert np.abs(demands.torque(found.f) - demands.tau).max() < 2e-14


@pytest.mark.parametrize("finger", FINGERS)
def test_forces_that_give_what_is_asked_for_are_found_again(lib, finger):
    demands = Demands(lib, finger, 3000)

    found = demands.solved()

    assert np.abs(found.f - demands.f).max() < 1e-9
    assert demands.error(found.f).max() < 1e-20


@pytest.mark.parametrize("finger", SHAPES)
def test_no_sequential_quadratic_programme_finds_a_nearer_stiffness(lib, finger):
    demands = Demands(lib, finger, 20, seed=1)
    demands.unreachable()
    ours = demands.error(demands.solved().f)

    for s in range(20):
        cost, torque = demands.problem(s)
        for start in (demands.f[s], np.full(demands.f.shape[1], (LOW + HIGH) / 2)):
            theirs = scipy.optimize.minimize(
                cost, start, jac=True, method="SLSQP", bounds=[(LOW, HIGH)] * len(start), constraints=[torque],
                options={"ftol": 1e-13, "maxiter": 400},
            )  # fmt: skip
            if np.abs(torque["fun"](theirs.x)).max() < 1e-9:
                assert ours[s] <= theirs.fun * (1 + 1e-6) + 1e-9


@pytest.mark.parametrize("finger", ["thumb", "index"])
def test_no_trust_region_finds_a_nearer_stiffness(lib, finger):
    demands = Demands(lib, finger, 3, seed=2)
    demands.unreachable()
    ours = demands.error(demands.solved().f)

    for s in range(3):
        cost, torque = demands.problem(s)
        theirs = scipy.optimize.minimize(
            cost, demands.f[s], jac=True, method="trust-constr",
            bounds=scipy.optimize.Bounds(LOW, HIGH, keep_feasible=True), hess=scipy.optimize.BFGS(),
            constraints=[scipy.optimize.LinearConstraint(demands.P[s].T, -demands.tau[s], -demands.tau[s])],
            options={"maxiter": 60},
        )  # fmt: skip
        if np.abs(torque["fun"](theirs.x)).max() < 1e-9:
            assert ours[s] <= theirs.fun * (1 + 1e-6) + 1e-9


@pytest.mark.parametrize("finger", PAIRED)
def test_pairs_reach_the_global_optimum_of_the_sums_of_their_stiffnesses(lib, hand, finger):
    demands = Demands(lib, finger, 700, seed=3)
    demands.unreachable()
    ours = demands.error(demands.solved().f)
    pairs = [pair for group in groups(hand.fingers[finger]) for pair in antagonists(hand.fingers[finger], group)]
    first, second = (np.array(side) for side in zip(*pairs, strict=True))

    p = demands.P[0][first]
    difference = -np.linalg.solve(p.T, demands.tau.T).T
    room = HIGH - LOW - np.abs(difference)

    def sums(shift):
        f = np.zeros_like(demands.f)
        f[:, first], f[:, second] = (LOW + shift + np.maximum(sign * difference, 0) for sign in (1, -1))
        k = demands.curve(f).k
        return k[:, first] + k[:, second]

    least, most = sums(np.zeros_like(room)), sums(room)
    columns = np.einsum("ia,ib->abi", p, p).reshape(-1, len(p))
    for s in range(len(ours)):
        wanted = (demands.K[s] + demands.K[s].T).ravel() / 2
        theirs = scipy.optimize.lsq_linear(columns, wanted, (least[s], most[s]), method="bvls", tol=1e-14)
        assert abs(ours[s] - theirs.cost) <= 1e-9 * (1 + theirs.cost)


def test_no_point_of_a_grid_over_all_pretensions_of_the_thumb_is_nearer(lib):
    demands = Demands(lib, "thumb", 200, seed=4)
    demands.unreachable()
    best = demands.solved().f

    ours, theirs = demands.error(best), np.full(len(best), np.inf)
    moves = np.linalg.svd(demands.P[:, :4, :2])[0][:, :, 2:]  # of the four straight spans, which give no torque
    for a in np.linspace(-110, 110, GRID):
        for b in np.linspace(-110, 110, GRID):
            f = best.copy()
            f[:, :4] = demands.f[:, :4] + moves @ [a, b]
            allowed = (f >= LOW).all(axis=1) & (f <= HIGH).all(axis=1)
            cost = np.where(allowed, demands.error(np.clip(f, LOW, HIGH)), np.inf)
            theirs = np.minimum(theirs, cost)

    assert np.isfinite(theirs).mean() > 0.9
    assert np.all(ours <= theirs * (1 + 1e-9) + 1e-12)


def test_no_descent_from_many_random_starts_ends_nearer(lib):
    demands = Demands(lib, "thumb", 300, seed=12)
    demands.unreachable()
    best, count = demands.solved().f, len(demands.f)

    def curve(f, *names):
        found = demands.curve(f.T)
        return [getattr(found, name).T for name in names]

    K, low, high = (demands.K + demands.K.swapaxes(1, 2)) / 2, np.full(count, LOW), np.full(count, HIGH)
    others = nearest_forces.Demands(best, K, demands.P, demands.dP, low, high, best < 0, [0, 1, 2, 3])
    theirs = np.min([demands.error(f) for f in nearest_forces.minima(others, curve).swapaxes(0, 1)], axis=0)

    assert np.all(demands.error(best) <= theirs * (1 + 1e-9) + 1e-12)


# -- torques out of reach -----------------------------------------------------------------------------------


@pytest.mark.parametrize("finger", FINGERS)
def test_a_torque_out_of_reach_gives_the_nearest_one_and_says_so(lib, finger):
    demands = Demands(lib, finger, 150, seed=5)
    demands.tau = demands.tau * 2 + demands.random.normal(size=demands.tau.shape) * 0.5

    found = demands.solved()

    ours = np.linalg.norm(demands.torque(found.f) - demands.tau, axis=1)
    theirs = np.array([
        np.sqrt(2 * scipy.optimize.lsq_linear(P.T, -tau, (LOW, HIGH), method="bvls", tol=1e-15).cost)
        for P, tau in zip(demands.P, demands.tau, strict=True)
    ])  # fmt: skip
    assert np.abs(ours - theirs).max() < 1e-9
    assert np.array_equal(found.status == INFEASIBLE, theirs > 1e-12)
    assert (found.status == INFEASIBLE).mean() > 0.5
    assert LOW <= found.f.min() <= found.f.max() <= HIGH


def test_joints_whose_torque_is_within_reach_keep_it_when_others_ask_too_much(lib):
    demands = Demands(lib, "index", 300, seed=6)
    demands.tau[:, 2:] += 3.0

    found = demands.solved()

    assert np.all(found.status == INFEASIBLE)
    assert np.abs(demands.torque(found.f) - demands.tau)[:, :2].max() < 1e-14


# -- what else is to be expected ----------------------------------------------------------------------------


@pytest.mark.parametrize("finger", FINGERS)
def test_asking_for_more_stiffness_never_loosens_a_tendon(lib, finger):
    demands = Demands(lib, finger, 1, seed=7)
    scales = np.linspace(0.3, 3.0, 200)[:, None, None]
    lowest = demands.stiffness(np.full_like(demands.f, 20.0))[0] if finger != "thumb" else demands.K[0]
    rest = np.zeros_like(demands.tau) if finger != "thumb" else demands.tau

    found = demands.kernel(demands.q, rest, scales * lowest, LOW, HIGH).f

    total = found.sum(axis=1)
    assert np.all(np.diff(total if finger == "thumb" else found, axis=0) >= -1e-9)
    assert total[-1] > total[0] + 50


def test_opposite_torques_swap_the_forces_of_antagonists(lib, hand):
    demands = Demands(lib, "index", 500, seed=8)

    forth, back = (demands.kernel(demands.q, sign * demands.tau, demands.K, LOW, HIGH).f for sign in (1, -1))

    for group in groups(hand.fingers["index"]):
        for first, second in antagonists(hand.fingers["index"], group):
            assert np.abs(forth[:, first] - back[:, second]).max() < 1e-9


def test_only_the_symmetric_part_of_the_stiffness_matters(lib):
    for finger in ("index", "thumb"):
        demands = Demands(lib, finger, 100, seed=9)
        twist = demands.random.normal(size=demands.K.shape)

        plain, twisted = (
            demands.kernel(demands.q, demands.tau, K, LOW, HIGH).f
            for K in (demands.K, demands.K + twist - twist.swapaxes(1, 2))
        )

        assert np.abs(plain - twisted).max() < 1e-7


# -- bad input ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("finger", ["thumb", "index"])
@pytest.mark.parametrize("port", ["q", "tau", "K", "f_min", "f_max"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_gives_a_status_and_forces_within_limits(lib, finger, port, bad):
    demands = Demands(lib, finger, 1)
    given = {"q": demands.q[0], "tau": demands.tau[0], "K": demands.K[0], "f_min": LOW, "f_max": HIGH}
    given[port] = np.full_like(given[port], bad) if np.ndim(given[port]) else bad

    found = demands.kernel(**given)

    if port != "q" or finger == "thumb":  # constant couplings do not read the pose
        assert found.status == NOT_FINITE
        expected = {"f_min": 0.0, "f_max": LOW}.get(port, (LOW + HIGH) / 2)
        assert np.all(found.f == expected)
    assert demands.solved().status.tolist() == [OK]  # and it recovers


@pytest.mark.parametrize("finger", FINGERS)
def test_limits_in_the_wrong_order_are_refused_with_the_lower_limit(lib, finger):
    demands = Demands(lib, finger, 1)

    found = demands.kernel(demands.q, demands.tau, demands.K, HIGH, LOW)

    assert found.status == OUT_OF_DOMAIN
    assert np.all(found.f == HIGH)


@pytest.mark.parametrize("finger", FINGERS)
def test_limits_off_the_spring_are_refused_with_forces_within_them(lib, finger):
    demands = Demands(lib, finger, 200, seed=10)

    found = demands.kernel(demands.q, demands.tau, demands.K, -50.0, 400.0)

    assert np.all(found.status == OUT_OF_DOMAIN)
    assert np.all((found.f >= -50.0) & (found.f <= 400.0))


@pytest.mark.parametrize("finger", FINGERS)
def test_equal_limits_leave_one_answer(lib, finger):
    demands = Demands(lib, finger, 1)
    balance = demands.torque(np.full_like(demands.f, 40.0))

    for tau, status in ((balance, OK), (balance + 0.01, INFEASIBLE)):
        found = demands.kernel(demands.q, tau, demands.K, 40.0, 40.0)
        assert found.status == status
        assert np.all(found.f == 40.0)


@pytest.mark.parametrize("finger", ["thumb", "index"])
@pytest.mark.parametrize("scale", [0.0, 1e-300, 1e6, 1e150, 1e300])
def test_absurd_stiffnesses_give_bounded_forces_and_the_torque_or_a_status(lib, finger, scale):
    demands = Demands(lib, finger, 50, seed=11)
    demands.K *= scale

    found = demands.solved()

    assert LOW <= found.f.min() <= found.f.max() <= HIGH
    exact = np.abs(demands.torque(found.f) - demands.tau).max(axis=1) < 1e-13
    assert np.all(exact | (found.status != OK))
    assert scale > 1e100 or not found.status.any()
