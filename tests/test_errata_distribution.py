"""Where chapter 7 prints what cannot hold: its equations, its norms, and algorithm 2 beside what the kernels do."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
import tendon_solvers as solvers
from tendon_solvers import demand, fingers


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return solvers.compiled(tmp_path_factory.mktemp("solvers"))


def test_the_stiffness_of_eq_7_1_needs_the_transposed_coupling_and_the_opposite_sign():
    q = sympy.Matrix(sympy.symbols("q:2"))
    at = sympy.Matrix(sympy.symbols("a:2"))
    h = sympy.Matrix([sympy.Function(f"h{i}")(*q) for i in range(3)])
    f, k = sympy.Matrix(sympy.symbols("f:3")), sympy.Matrix(sympy.symbols("k:3"))
    P = h.jacobian(q)
    here = dict(zip(q, at, strict=True))
    stretched = f + sympy.diag(*k) * (h - h.subs(here))

    stiffness = (-(-P.T * stretched).jacobian(q)).subs(here).doit()
    mended = P.T * sympy.diag(*k) * P + sum((f[i] * sympy.hessian(h[i], q) for i in range(3)), sympy.zeros(2))

    assert sympy.simplify(stiffness - mended.subs(here).doit()) == sympy.zeros(2)
    with pytest.raises(sympy.matrices.exceptions.ShapeError):
        P * f  # as printed in eq. 7.6


def test_the_printed_norms_are_none():
    x = np.array([1.0, -1.0])

    assert np.sqrt(x.sum()) == 0  # eq. 7.8 and 7.9 without squares: a vector that is not zero
    assert max(-1.0, -2.0) < 0  # eq. 7.10 without moduli: less than nothing
    assert np.linalg.norm(x) == np.sqrt(2)


def test_the_squared_distance_of_eq_7_4_is_quadratic_only_for_springs_that_stiffen_evenly():
    f, a, b, c = sympy.symbols("f a b c")

    even, uneven = ((a + b * f + stiffening * f**2) ** 2 for stiffening in (0, c))

    assert sympy.degree(even, f) == 2
    assert sympy.degree(uneven, f) == 4


def printed_search(finger, tau, K, rounds, step, weight):
    """Algorithm 2 as printed: the gradient is that of the last trial, also where that is not taken."""
    moves = np.linalg.svd(finger.P)[0][:, finger.P.shape[1] :]
    alpha, best, costs = np.zeros(moves.shape[1]), np.inf, []
    particular = -np.linalg.pinv(finger.P.T) @ tau + (finger.low + finger.high) / 2 * (
        1 - np.linalg.pinv(finger.P.T) @ finger.P.T @ np.ones(len(finger.P))
    )

    def cost(alpha):
        f = particular + moves @ alpha
        inside = np.clip(f, finger.low, finger.high)
        k, slope, _ = np.array([finger.curve(force) for force in inside]).T
        excess = (finger.P.T * k) @ finger.P - K
        gradient = np.where(f == inside, slope, 0) * np.einsum("ia,ab,ib->i", finger.P, excess, finger.P)
        return (excess**2).sum() / 2 + weight * ((f - inside) ** 2).sum() / 2, moves.T @ (
            gradient + weight * (f - inside)
        )

    gradient = np.zeros_like(alpha)
    for _ in range(rounds):
        found, gradient = cost(alpha - step * gradient)
        if found < best:
            best, alpha = found, alpha - step * gradient
        else:
            step /= 2
        costs.append(cost(alpha)[0])
    return particular + moves @ alpha, costs


STEP, WEIGHT = 2000.0, 1e-3  # of the first trial, and of what lies outside the limits


def compared(library, far):
    """Errors of torque [N m], limits [N] and stiffness [N m/rad] by algorithm 2, mended and printed, and by ours."""
    random = np.random.default_rng(18)
    finger = next(fingers(library, random))
    rows = []
    for _ in range(30):
        tau, K = demand(finger, random, far)
        row = []
        for f in (
            finger.by_gradient(tau, K, 200, STEP, WEIGHT)[1],
            printed_search(finger, tau, K, 200, STEP, WEIGHT)[0],
            finger.distribute(tau, K)[1],
        ):
            outside = max(0.0, finger.low - f.min(), f.max() - finger.high)
            inside = np.clip(f, finger.low, finger.high)
            row.append((np.abs(finger.P.T @ f + tau).max(), outside, np.abs(finger.stiffness(inside) - K).max()))
        rows.append(row)
    return np.array(rows).transpose(2, 1, 0)


@pytest.fixture(scope="module")
def within_reach(library):
    return compared(library, 0.0)


@pytest.fixture(scope="module")
def out_of_reach(library):
    return compared(library, 1.0)


def test_algorithm_2_keeps_the_torque_whatever_it_does_else(within_reach, out_of_reach):
    for torque, _, _ in (within_reach, out_of_reach):
        mended, printed, ours = torque

        assert max(mended.max(), ours.max()) < 1e-13
        assert printed.max() < 1e-9


def test_algorithm_2_mended_finds_what_forces_can_give_and_printed_it_does_not(within_reach):
    mended, printed, ours = within_reach[2]

    assert max(mended.max(), ours.max()) < 1e-9
    assert np.median(printed) > 0.1


def test_algorithm_2_violates_limits_that_the_closed_form_keeps(out_of_reach):
    mended, printed, ours = out_of_reach[1]

    assert (mended > 1e-3).mean() > 0.5
    assert mended.max() > 10
    assert printed.max() > 10
    assert np.all(ours == 0)


def test_printed_algorithm_2_moves_to_points_it_never_evaluated_and_so_gets_worse(library):
    random = np.random.default_rng(19)
    finger = next(fingers(library, random))

    rises = [max(np.diff(printed_search(finger, *demand(finger, random, 0.0), 60, STEP, WEIGHT)[1])) for _ in range(10)]

    assert max(rises) > 0.01
