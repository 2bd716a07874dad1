"""State-dependent optimal gains, tick by tick (chapter 14): secants, any last gains, and what remains without new ones."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from tendon_solvers import numbers, write_headers

from awiwi_gen.build import FLAGS, compiler
from awiwi_gen.resources import CSRC
from awiwi_gen.verify.problems_riccati import joint

OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE = range(4)
TICK = {
    "m": 4e-7, "b": 2e-3, "dq": 0.0012, "dtheta": 0.0012, "spring": np.array([0.605, 0.0, 0.3]),
    "weights": np.array([10, 0.01, 1, 0.01]), "R": 0.01, "K_last": np.zeros(4),
    "x": np.array([0.3, 1.0, 0.5, -1.0]), "x_des": np.array([0.1, 0.0, 0.4, 0.0]),
}  # fmt: skip


def test_the_joint_has_the_gains_of_its_secant(lib):
    got = lib.sdre_joint(**TICK)
    k = lib.secant_stiffness(TICK["spring"], 0.5 - 0.3, 0.4 - 0.1).k
    A, b = joint(4e-7, 2e-3, float(k), 0.0012, 0.0012)
    known = lib.lqr(A, b, np.diag(TICK["weights"]), TICK["R"])
    hold = 0.605 * 0.3 + 0.3 * 0.3**3

    assert got.status == OK
    assert pytest.approx(known.K, rel=1e-10) == got.K
    assert pytest.approx(hold - got.K @ (TICK["x"] - TICK["x_des"]), rel=1e-12) == got.u


def test_any_last_gains_will_do(lib):
    random = np.random.default_rng(8)
    last = 10 ** random.uniform(-8, 8, (500, 4)) * random.choice([-1, 1], (500, 4))
    got = lib.sdre_joint(**TICK | {"K_last": last})

    assert np.all(got.status == OK)
    assert np.abs(got.K / lib.sdre_joint(**TICK).K - 1).max() < 1e-12


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"m": 0.0}, OUT_OF_DOMAIN), ({"b": -1.0}, OUT_OF_DOMAIN), ({"dq": -1.0}, OUT_OF_DOMAIN),
        ({"R": 0.0}, OUT_OF_DOMAIN), ({"spring": np.zeros(3)}, OUT_OF_DOMAIN),
        ({"spring": np.array([-1.0, 0, 0])}, OUT_OF_DOMAIN), ({"weights": np.array([0, 1.0, 0, 1])}, OUT_OF_DOMAIN),
        ({"weights": np.array([1.0, -1, 1, 1])}, OUT_OF_DOMAIN), ({"b": np.nan}, NOT_FINITE),
        ({"spring": np.array([np.nan, 0, 0])}, NOT_FINITE), ({"R": np.inf}, NOT_FINITE),
    ],
    ids=str,
)  # fmt: skip
def test_without_new_gains_the_last_ones_remain(lib, change, status):
    last = np.array([5.0, 0.1, 20.0, 1.0])
    got = lib.sdre_joint(**TICK | {"K_last": last} | change)

    assert got.status == status
    assert np.all(last == got.K)
    assert np.isfinite(got.u)


def test_a_state_that_is_not_a_number_asks_for_no_torque(lib):
    last = np.array([5.0, 0.1, 20.0, 1.0])
    for index in range(4):
        x = TICK["x"].copy()
        x[index] = np.nan
        got = lib.sdre_joint(**TICK | {"K_last": last, "x": x})

        assert got.status == NOT_FINITE
        assert got.u == 0
        assert np.isfinite(got.K).all()
    assert lib.sdre_joint(**TICK | {"K_last": got.K}).status == OK  # and it recovers


def test_last_gains_that_are_not_numbers_do_no_harm(lib):
    last = np.array([np.nan, 1.0, 1.0, np.inf])

    assert np.all(lib.sdre_joint(**TICK | {"K_last": last}).K == lib.sdre_joint(**TICK).K)
    assert np.all(lib.sdre_joint(**TICK | {"K_last": last, "b": -1.0}).K == 0)


@pytest.mark.parametrize("change", [{"R": 0.0}, {"b": -1.0}, {"weights": np.array([0.0, 1.0])}], ids=str)
def test_the_tendon_law_refuses_what_is_no_cost(lib, change):
    good = {
        "theta": 0.5, "thd": 0.0, "theta_des": 0.4, "b": 2e-3, "dtheta": 0.0, "spring": np.array([0.1, 0.1, 0.0]),
        "weights": np.array([1, 1e-4]), "R": 1e-6,
    }  # fmt: skip

    assert lib.sdre_tendon(**good).status == OK
    assert lib.sdre_tendon(**good | change).status == OUT_OF_DOMAIN


# -- a motion, tick by tick ---------------------------------------------------------------------------------

STEPS = 32  # allowed to the kernel


def reach(lib, ticks=300, faults=()):
    """Gains, torques and status of ticks at 3 kHz along a motion whose spring stiffens; some ticks have no inertia."""
    gains, torques, statuses, last = [], [], [], np.zeros(4)
    for tick in range(ticks):
        q, speed = 0.5 * np.sin(tick / 40), 0.5 * 3000 / 40 * np.cos(tick / 40)
        x = np.array([q, speed, q + 0.4 * np.sin(tick / 25), speed])
        got = lib.sdre_joint(**TICK | {"x": x, "K_last": last} | ({"b": np.nan} if tick in faults else {}))
        last = got.K
        gains.append(got.K)
        torques.append(float(got.u))
        statuses.append(int(got.status))
    return np.array(gains), np.array(torques), np.array(statuses)


def test_ticks_without_an_answer_keep_the_last_gains_and_leave_no_trace_afterwards(lib):
    faults = (0, 1, 50, 51, 52, 200)
    clean, with_faults = reach(lib), reach(lib, faults=faults)

    assert not clean[2].any()
    assert np.flatnonzero(with_faults[2]).tolist() == list(faults)
    for tick in faults:
        assert np.array_equal(with_faults[0][tick], with_faults[0][tick - 1] if tick > 1 else np.zeros(4))
    good = np.setdiff1d(np.arange(300), faults)
    assert np.abs(with_faults[0][good] / clean[0][good] - 1).max() < 1e-13
    assert np.isfinite(with_faults[1]).all()


class Joint(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_double) for name in ("m", "b", "k", "dq", "dtheta"))


@pytest.fixture(scope="module")
def solver(tmp_path_factory):
    """Status and gains for a plant (m, b, k, dq, dtheta) and weights (4 and R), from last gains in so many steps."""
    directory = tmp_path_factory.mktemp("gains")
    write_headers(directory)
    target, sources = directory / "gains.so", [str(CSRC / "joint_gains.c"), str(CSRC / "dense.c")]
    compiler().run(*FLAGS, f"-I{directory}", f"-I{CSRC}", "-shared", *sources, "-lm", "-o", str(target))
    call = ctypes.CDLL(str(target)).awiwi_joint_gains

    def solve(plant, weights, last, steps=STEPS):
        K, last = np.zeros(4), np.ascontiguousarray(last, float)
        cost = ctypes.c_double(weights[4])
        status = call(ctypes.byref(Joint(*plant)), numbers(weights[:4]), cost, numbers(last), steps, numbers(K))
        return status, K

    return solve


def steps_needed(solve, plant, weights, last):
    """How few steps give all digits that many give."""
    exact = solve(plant, weights, last)[1]
    for steps in range(STEPS + 1):
        status, K = solve(plant, weights, last, steps)
        if status == OK and np.abs(K / exact - 1).max() < 1e-12:
            return steps
    raise AssertionError("no number of steps will do")


def random_joints(count):
    random = np.random.default_rng(1)
    for _ in range(count):
        m, b, k = 10 ** random.uniform([-7, -4, -1], [-4, -2, 1.3])
        weights = 10 ** random.uniform([0, -3, -1, -3, -4], [2, 0, 1, 0, 0])
        yield (m, b, k, random.uniform(0, 5e-3), random.uniform(0, 0.1)), weights, random


def test_from_the_last_gains_there_is_nothing_to_search_and_from_none_there_is(solver):
    """The last gains are those of a spring that is up to 40 % softer or stiffer."""
    warm, cold = [], []
    for plant, weights, random in random_joints(400):
        before = (*plant[:2], plant[2] * random.uniform(0.7, 1.4), *plant[3:])
        warm.append(steps_needed(solver, plant, weights, solver(before, weights, np.zeros(4))[1]))
        cold.append(steps_needed(solver, plant, weights, np.zeros(4)))

    assert max(warm) == 0
    assert np.mean(cold) > 0.2
    assert max(cold) <= 6


def test_the_steps_allowed_are_enough_for_last_gains_of_any_size_and_sign(solver):
    needed = []
    for plant, weights, random in random_joints(400):
        last = 10 ** random.uniform(-8, 8, 4) * random.choice([-1, 1], 4)
        needed.append(steps_needed(solver, plant, weights, last))

    assert max(needed) > 6
    assert max(needed) <= 24
