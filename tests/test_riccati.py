"""Optimal gains (chapters 13 and 14): what the solvers rest on is proved, what they return is held against others."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from flint import arb
from scipy.linalg import LinAlgError, solve_continuous_are
from sympy import Function, Matrix, Symbol, diff, expand, simplify, sqrt, symbols

from awiwi_gen.control.state_dependent import motor_regulator, secant, torque
from awiwi_gen.verify.problems_riccati import chain, joint, optimum, tables

OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE = range(4)
s = Symbol("s")
R = Symbol("R", positive=True)


def vanishes(expression) -> bool:
    return expand(sympy.fraction(sympy.together(expression))[0]) == 0


def left_side(A, b, Q, S):
    """Of eq. 13.5."""
    return S * A + A.T * S - S * b * b.T * S / R + Q


# -- chapter 13: what the equation says --------------------------------------------------------------------


def general(n: int):
    A, b = Matrix(n, n, symbols(f"a:{n * n}")), Matrix(symbols(f"b:{n}"))
    S, Q = (Matrix(n, n, lambda i, j, name=name: Symbol(f"{name}{min(i, j)}{max(i, j)}")) for name in "SQ")
    return A, b, Q, S


def test_the_cost_to_come_falls_by_what_is_spent():
    """V = x'S x under u = -K x, K = b'S/R: its rate is -(x'Q x + R u^2) where the equation holds."""
    A, b, Q, S = general(4)
    x = Matrix(symbols("x:4"))
    u = (-(b.T * S / R) * x)[0]
    rate = (2 * x.T * S * (A * x + b * u))[0]
    owed = (x.T * left_side(A, b, Q, S) * x)[0]

    assert expand(rate + (x.T * Q * x)[0] + R * u**2 - owed) == 0


def test_no_other_control_costs_less():
    """What any u costs beyond x'S x is R (u + K x)^2."""
    A, b, Q, S = general(2)
    x, u = Matrix(symbols("x:2")), Symbol("u")
    gain = (b.T * S / R * x)[0]
    spent = (x.T * Q * x)[0] + R * u**2 + (2 * x.T * S * (A * x + b * u))[0]

    assert expand(spent - R * (u + gain) ** 2 - (x.T * left_side(A, b, Q, S) * x)[0]) == 0


def test_the_product_of_the_optimal_poles_is_known_beforehand():
    """c0^2 = det(A)^2 + v'Q v/R, v = adj(A) b: what the solver sets the scale of time by."""
    A, b, Q, S = general(2)
    K = b.T * S / R
    v = A.adjugate() * b
    gap = (A - b * K).det() ** 2 - A.det() ** 2 - (v.T * Q * v)[0] / R

    assert expand(gap + (v.T * left_side(A, b, Q, S) * v)[0] / R) == 0


def test_the_printed_signs_of_14_5_belong_to_the_negative_of_the_solution():
    A, b, Q, S = general(4)
    printed = S * A + A.T * S + S * b * b.T * S / R - Q

    assert (
        (printed.subs({x: -x for x in S.free_symbols}, simultaneous=True) + left_side(A, b, Q, S))
        .expand()
        .is_zero_matrix
    )


def test_the_negative_of_the_solution_drives_the_loop_away(lib):
    A, b, Q, r = tables()[1]
    K = lib.lqr(A, b, Q, r).K

    assert np.linalg.eigvals(A - np.outer(b, K)).real.max() < 0
    assert np.linalg.eigvals(A + np.outer(b, K)).real.max() > 0


# -- chapter 14: secants -----------------------------------------------------------------------------------

SPRING = s1, s2, s3 = Matrix(symbols("s1:4"))
x, y = symbols("x y", real=True)


def test_with_the_secant_the_pointwise_linear_form_is_the_plant():
    gap = torque(SPRING, x) - torque(SPRING, y)

    assert expand(secant(SPRING, x, y) * (x - y) - gap) == 0
    assert expand(diff(torque(SPRING, x), x) * (x - y) - gap) != 0  # with the slope it is not


def test_the_secant_of_one_point_is_the_slope():
    assert expand(secant(SPRING, x, x) - diff(torque(SPRING, x), x)) == 0


def test_the_closed_form_of_the_motor_solves_the_equation():
    b, k, d, w1, w2 = symbols("b k d w1 w2", positive=True)
    K1, K2 = motor_regulator(b, k, d, Matrix([w1, w2]), R)
    A, column = Matrix([[0, 1], [-k / b, -d / b]]), Matrix([0, 1 / b])
    S12, S22 = b * R * K1, b * R * K2
    S11 = Symbol("S11")  # the third entry is linear in it, and nothing else is
    E = left_side(A, column, sympy.diag(w1, w2), Matrix([[S11, S12], [S12, S22]]))

    assert simplify(E[0, 0]) == 0
    assert simplify(E[1, 1]) == 0
    assert diff(E[0, 1], S11) == 1


def test_the_printed_sign_of_14_9_asks_for_the_wrong_gain():
    """A spring that pushes away needs 2 k more than one that pulls back."""
    b, k, w1, w2 = symbols("b k w1 w2", positive=True)
    right, printed = (motor_regulator(b, stiffness, 0, Matrix([w1, w2]), R)[0] for stiffness in (k, -k))

    assert simplify(sympy.radsimp(printed) - sympy.radsimp(right) - 2 * k) == 0


def test_the_tendon_law_is_stable_from_everywhere():
    """V = b v^2/2 + the energy of the stiffness sqrt(k(x)^2 + w1/R), which falls by sqrt(d^2 + ...) v^2."""
    b, d, w1, w2 = symbols("b d w1 w2", positive=True)
    v, at = symbols("v at", real=True)
    k = Function("k", real=True)
    K1, K2 = motor_regulator(b, k(x), d, Matrix([w1, w2]), R)
    V = b * v**2 / 2 + sympy.Integral(sqrt(k(at) ** 2 + w1 / R) * at, (at, 0, x))
    rate = diff(V, x) * v + diff(V, v) * (-k(x) * x - d * v - K1 * x - K2 * v) / b

    assert simplify(rate.doit() + sqrt(d**2 + 2 * b * K1 + w2 / R) * v**2) == 0


# -- the joint without a Riccati equation --------------------------------------------------------------------

LINK, MOTOR, BRAKE, DRAG = wl, wm, d, l = symbols("w_l w_m d l", positive=True)
e, f, g, h, q1, q2, q3, q4, z = symbols("e f g h q1 q2 q3 q4 z")  # gains and weights, over b and over R b^2


def factored():
    """c(s) c(-s) minus what it is to be, by powers of -s^2; all frequencies over the inertias."""
    link = s**2 + d * s + wl
    plant = link * (s**2 + l * s + wm) - wl * wm
    loop = plant + link * (f * s + e) + wl * (g * s + h)
    cost = (q1 - q2 * s**2) * wl**2 + (q3 - q4 * s**2) * link * link.subs(s, -s)
    gap = expand(loop * loop.subs(s, -s) - plant * plant.subs(s, -s) - cost)
    return sympy.Poly(gap.subs(s, sympy.sqrt(-z)), z).all_coeffs()[::-1]


def test_the_optimal_polynomial_is_a_spectral_factor():
    """c c* = a a* + n*'Q n/R, up to the equation's left side."""
    A = Matrix([[0, 1, 0, 0], [-wl, -d, wl, 0], [0, 0, 0, 1], [wm, 0, -wm, -l]])
    b, Q = Matrix([0, 0, 0, 1]), sympy.diag(q1, q2, q3, q4)
    S = Matrix(4, 4, lambda i, j: Symbol(f"S{min(i, j)}{max(i, j)}"))
    link = s**2 + d * s + wl
    n = Matrix([wl, s * wl, link, s * link])
    a = expand(link * (s**2 + l * s + wm) - wl * wm)
    c = a + ((b.T * S / R) * n)[0]
    gap = c * c.subs(s, -s) - a * a.subs(s, -s) - (n.subs(s, -s).T * Q * n)[0] / R

    assert ((s * sympy.eye(4) - A) * n - b * a).expand().is_zero_matrix
    assert expand(gap + (n.subs(s, -s).T * left_side(A, b, Q, S) * n)[0] / R) == 0


def test_the_first_and_third_gain_add_up_to_what_the_weights_say():
    assert expand(factored()[0] - wl**2 * ((h + e) ** 2 - q1 - q3)) == 0


def test_the_equations_in_the_gains_are_those_of_the_factor():
    """What the solver polishes: speeds follow angles (f of e), and two more in e and g."""
    first, second, third = factored()[1:4]
    c3 = d + l + f
    follow = f**2 + 2 * l * f - 2 * e - q4
    P = e**2 + 2 * wm * e - q3 - 2 * wl * (c3 * g - h)
    U = (
        wl * (q2 - g**2 + 2 * g * (c3 + d) - 2 * h)
        + 2 * d * (c3 * (h - d * g) - e * g - wm * (f + g))
        + 2 * (h * (e + wm) - wm * e)
    )

    assert expand(third - follow) == 0
    assert expand(second - P - (d**2 - 2 * wl) * follow) == 0
    assert (
        expand(-first - (wl * U + (2 * wl - d**2) * P - wl**2 * follow)) == 0
        or expand(first - (wl**2 * follow - wl * U - (2 * wl - d**2) * P)) == 0
    )


def test_the_search_begins_above_the_solution_whatever_the_guess():
    """2 c1 c3 is at most t c3^2 + c1^2/t, so F is at least a parabola; its larger zero is where the search begins."""
    c2, g1, g2, g3 = symbols("c2 g1 g2 g3", real=True)
    t, c1, c3 = symbols("t c1 c3", positive=True)
    F = c2**2 + 2 - g2 - 2 * c1 * c3
    parabola = c2**2 + 2 - g2 - t * (g3 + 2 * c2) - (g1 + 2 * c2) / t
    excess = (F - parabola).subs({g3: c3**2 - 2 * c2, g1: c1**2 - 2 * c2})
    half = t + 1 / t
    start = half + sqrt(half**2 - 2 + g2 + t * g3 + g1 / t)

    assert simplify(excess - (sqrt(t) * c3 - c1 / sqrt(t)) ** 2) == 0
    assert simplify(parabola.subs(c2, start)) == 0


def test_the_search_comes_down_without_fail():
    """F is convex where it is defined, and its slope is positive exactly where the polynomial is stable."""
    c2, g1, g2, g3 = symbols("c2 g1 g2 g3", real=True)
    c1, c3 = symbols("c1 c3", positive=True)
    F = c2**2 + 2 - g2 - 2 * sqrt(g3 + 2 * c2) * sqrt(g1 + 2 * c2)
    known = {g3: c3**2 - 2 * c2, g1: c1**2 - 2 * c2}
    slope, bend = diff(F, c2).subs(known), diff(F, c2, 2).subs(known)
    hurwitz = c1 * c2 * c3 - c1**2 - c3**2

    assert simplify(bend - 2 - 2 * (c1**2 - c3**2) ** 2 / (c1 * c3) ** 3) == 0
    assert simplify(slope * c1 * c3 - 2 * hurwitz) == 0


# -- the solver ------------------------------------------------------------------------------------------------

PLANTS = 2000


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


def test_the_gains_are_those_of_scipy_on_thousands_of_plants(lib):
    plants = list(random_plants(PLANTS))
    got = lib.lqr(*stacked(plants))
    worst = []
    for S, (A, b, Q, r) in zip(got.S, plants, strict=True):
        known = solve_continuous_are(A, b[:, None], Q, np.array([[r]]))
        weight = np.sqrt(np.diag(known))  # both as seen from coordinates in which the diagonal is 1
        worst.append(np.abs((S - known) / np.outer(weight, weight)).max())

    assert np.all(got.status == OK)
    assert np.all(got.residual < 1e-10)
    assert np.median(worst) < 1e-12
    assert np.quantile(worst, 0.99) < 1e-8
    assert max(worst) < 1e-5


def test_where_they_differ_it_is_nearer_to_the_truth(lib):
    for A, b, Q, r in random_plants(60, seed=7):
        exact = np.array([float(K) for K in optimum(A, b, Q, r)[0]])
        known = b @ solve_continuous_are(A, b[:, None], Q, np.array([[r]])) / r
        ours, scipys = (np.abs(K / exact - 1).max() for K in (lib.lqr(A, b, Q, r).K, known))

        assert ours <= max(20 * scipys, 1e-11)
        assert ours < 1e-8


def test_the_plants_of_the_tables_are_solved_to_the_last_digits(lib):
    plants = tables()
    got = lib.lqr(*stacked(plants))
    for K, S, plant in zip(got.K, got.S, plants, strict=True):
        gains, cost = ([float(x) for x in part] for part in optimum(*plant))

        assert pytest.approx(gains, rel=2e-10) == K
        assert pytest.approx(cost, rel=1e-9) == S.ravel()
    assert np.all(got.status == OK)


def test_the_optimum_of_table_16_1(lib):
    A, b = chain(7.2e-7, 2e-3, 0.605)
    K = lib.lqr(A, b, np.diag([100, 0.01, 0.01, 0.01]), 0.1).K

    assert pytest.approx((31.622776601684, 0.4401419396557, 2058.2239096652, 3.702444052883), rel=1e-12) == K


def test_plants_that_cannot_be_stabilised_are_refused(lib):
    random = np.random.default_rng(3)
    found = []
    for i in range(1000):
        A, b, turn = random.normal(size=(4, 4)), random.normal(size=4), np.eye(4)
        A[3], b[3] = 0, 0
        A[3, 3] = random.uniform(0.05, 3)  # a mode that nothing reaches
        if i % 2:
            turn = random.normal(size=(4, 4))
        found.append((turn @ A @ np.linalg.inv(turn), turn @ b, np.eye(4), 1.0))
    got = lib.lqr(*stacked(found))

    assert np.all(got.status[::2] == OUT_OF_DOMAIN)
    assert np.all(got.status != OK)
    assert np.count_nonzero(got.status == OUT_OF_DOMAIN) > 980
    assert np.all(got.K[got.status == OUT_OF_DOMAIN] == 0)


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


def test_what_is_called_good_is_stable_even_for_costs_that_are_none(lib):
    random = np.random.default_rng(5)
    plants = []
    for _ in range(500):
        Q = random.normal(size=(4, 4))
        plants.append((random.normal(size=(4, 4)), random.normal(size=4), Q + Q.T, 1.0))
    got = lib.lqr(*stacked(plants))
    good = [i for i in range(500) if got.status[i] == OK]

    assert 0 < len(good) < 500
    for i in good:
        A, b, _, _ = plants[i]
        assert np.linalg.eigvals(A - np.outer(b, got.K[i])).real.max() < 0


def exact_residual(A, b, Q, r, S):
    """The residual of S without rounding: its largest entry relative to the terms on its diagonal."""
    n = range(4)
    A, Q, S = ([[arb(float(x)) for x in row] for row in matrix] for matrix in (A, Q, S))
    K = [sum(arb(float(b[i])) * S[i][j] for i in n) / arb(float(r)) for j in n]
    parts = [[[S[i][k] * A[k][j] for k in n] + [S[j][k] * A[k][i] for k in n] for j in n] for i in n]
    sums = [[float(sum(parts[i][j]) + Q[i][j] - K[i] * K[j] * arb(float(r))) for j in n] for i in n]
    terms = [float(sum(map(abs, parts[i][i])) + abs(Q[i][i]) + K[i] ** 2 * arb(float(r))) for i in n]
    return max(abs(sums[i][j]) / np.sqrt(terms[i] * terms[j]) for i in n for j in n)


# -- the joint, tick by tick -------------------------------------------------------------------------------------

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


def test_scipy_agrees_that_some_plants_have_no_optimum():
    with pytest.raises(LinAlgError):
        solve_continuous_are(np.eye(2), np.array([[1.0], [0.0]]), np.eye(2), np.eye(1))
