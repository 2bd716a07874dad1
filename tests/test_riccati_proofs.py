"""Optimal gains (chapters 13 and 14): what the solvers rest on, proved."""

from __future__ import annotations

import numpy as np
import sympy
from sympy import Function, Matrix, Symbol, diff, expand, simplify, sqrt, symbols

from awiwi_gen.definitions.state_dependent import motor_regulator, secant, torque
from awiwi_gen.verify.problems_riccati import tables

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
    slope, curvature = diff(F, c2).subs(known), diff(F, c2, 2).subs(known)
    hurwitz = c1 * c2 * c3 - c1**2 - c3**2

    assert simplify(curvature - 2 - 2 * (c1**2 - c3**2) ** 2 / (c1 * c3) ** 3) == 0
    assert simplify(slope * c1 * c3 - 2 * hurwitz) == 0
