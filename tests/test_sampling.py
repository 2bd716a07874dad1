"""What a clock and a delay leave of a law: exact sampling, delay margins, and the nearest law that runs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

from awiwi_gen.loops.sampled import delay_margin, is_implementable, report, sampled, slowed
from awiwi_gen.simulate import PERIOD
from awiwi_gen.verify.problems_riccati import joint

TABLE_13_1 = joint(4e-7, 2e-3, 0.605, 0.0012, 0.0012)
WEIGHTS = np.diag([10, 0.01, 1, 0.01])


def optimal(A, B, Q, R):
    B = B.reshape(len(A), -1)
    return np.linalg.solve(R, B.T @ solve_continuous_are(A, B, Q, R))


def random_loop(random):
    n, p = random.integers(2, 6), random.integers(1, 3)
    A, B = random.normal(size=(n, n)), random.normal(size=(n, p))
    return A, B, optimal(A, B, np.eye(n) * 10 ** random.uniform(-1, 1), np.eye(p)) * random.uniform(0.7, 1.5)


def simulated(A, B, K, period, delay, ticks, start):
    """The same loop by an integrator that knows nothing of matrix exponentials: states at the ticks."""
    x, held, states = start.copy(), [np.zeros(B.shape[1])] * delay, [start]
    for _ in range(ticks):
        held.append(-K @ x)
        u = held.pop(0)
        x = solve_ivp(lambda _, y, u=u: A @ y + B @ u, (0, period), x, rtol=1e-11, atol=1e-13).y[:, -1]
        states.append(x)
    return np.array(states)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_sampled_loop_is_the_plant_between_ticks_under_held_torques(delay):
    A, B, K = random_loop(np.random.default_rng(delay))
    start = np.ones(len(A))
    states = simulated(A, B, K, 0.05, delay, 8, start)

    step = sampled(A, B, K, 0.05, delay)
    full = np.append(start, np.zeros(len(step) - len(A)))
    for state in states[1:]:
        full = step @ full
        assert full[: len(A)] == pytest.approx(state, rel=1e-8, abs=1e-10)


def test_without_delay_and_with_a_fast_clock_the_poles_are_those_of_the_design():
    A, B = TABLE_13_1
    K = optimal(A, B, WEIGHTS, np.eye(1))
    poles = np.log(np.linalg.eigvals(sampled(A, B, K, 1e-7, 0)).astype(complex)) / 1e-7

    assert np.sort(poles.real) == pytest.approx(np.sort(report(A, B, K).poles.real), rel=1e-2)


def test_the_delay_margin_of_an_integrator_is_a_quarter_turn():
    assert delay_margin(np.zeros((1, 1)), np.ones(1), np.array([5.0])) == pytest.approx(np.pi / 2 / 5)


def test_a_loop_of_small_gain_is_stable_with_any_delay():
    assert delay_margin(np.array([[-2.0]]), np.ones(1), np.ones(1)) == np.inf


def test_an_unstable_loop_has_no_margin():
    assert delay_margin(np.eye(2), np.eye(2), np.zeros((2, 2))) == 0


def test_the_delay_margin_is_where_a_finely_sampled_loop_turns_unstable():
    """One and two inputs; a delay of many short periods is nearly one of continuous time."""
    random, parts, tried = np.random.default_rng(5), 60, 0
    for _ in range(12):
        A, B, K = random_loop(random)
        margin = delay_margin(A, B, K)
        if not np.isfinite(margin):
            continue
        tried += 1
        below, above = (report(A, B, K, share * margin / parts, parts).radius for share in (0.93, 1.07))

        assert below < 1 < above
    assert tried > 8


def test_a_law_that_runs_is_left_alone():
    A, B = TABLE_13_1
    K = optimal(A, B, WEIGHTS, np.array([[0.01]]))
    answer = is_implementable(A, B, K)

    assert answer.implementable
    assert answer.bandwidth == 1
    assert pytest.approx(K) == answer.K
    assert "stable at 3000 Hz and 1 period of delay" in answer.reason


def test_a_law_that_is_too_fast_is_refused_with_the_reason_and_the_nearest_that_runs():
    A, B = TABLE_13_1
    answer = is_implementable(A, B, optimal(A, B, WEIGHTS, np.array([[1e-4]])))

    assert not answer.implementable
    assert answer.report.radius > 1
    assert answer.report.delay_margin < 1.5 * PERIOD
    assert "spectral radius" in answer.reason
    assert "delay margin" in answer.reason
    assert 0.1 < answer.bandwidth < 1
    assert report(A, B, answer.K).implementable
    assert report(A, B, answer.K, delay=2).implementable  # with something to spare
    faster = slowed(A, B, optimal(A, B, WEIGHTS, np.array([[1e-4]])))(answer.bandwidth * 1.01)
    assert not report(A, B, faster, delay=2).implementable


def test_a_design_function_defines_slower_laws():
    A, B = TABLE_13_1
    answer = is_implementable(
        A, B, optimal(A, B, WEIGHTS, np.array([[1e-4]])),
        design=lambda share: optimal(A, B, WEIGHTS, np.array([[1e-4 / share**4]])),
    )  # fmt: skip

    assert not answer.implementable
    assert report(A, B, answer.K, delay=2).implementable


def test_a_law_that_was_never_stable_says_so():
    A, B = TABLE_13_1

    assert "unstable without any delay" in is_implementable(A, B, np.array([0.0, 0.0, -1.0, 0.0])).reason


def test_slowing_down_scales_the_poles():
    A, B = TABLE_13_1
    K = optimal(A, B, WEIGHTS, np.array([[0.01]]))
    half = np.linalg.eigvals(A - np.outer(B, slowed(A, B, K)(0.5)))

    assert slowed(A, B, K)(1.0) == pytest.approx(K, rel=1e-6)
    assert np.sort_complex(half) == pytest.approx(np.sort_complex(report(A, B, K).poles / 2), rel=1e-4)


def test_several_inputs_need_a_design():
    with pytest.raises(ValueError, match="one input"):
        slowed(np.eye(2), np.eye(2), np.eye(2))
