"""Poles of a joint with a spring: the closed-form gains of chapter 12 proved, and its printed numbers weighed."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from sympy import Matrix, diff, exp, simplify, symbols

from awiwi_gen.definitions.pole_placement import joint_gains, motor_gains, target
from awiwi_gen.verify.problems_riccati import joint

m, b, k, dq, dtheta, w1, w2, x1, x2 = symbols("m b k d_q d_theta omega_1 omega_2 xi_1 xi_2", positive=True)
s = symbols("s")
a1, a2, a3, a4 = alpha = Matrix(symbols("alpha_1:5"))  # u = alpha . x, as eq. 12.12 prints it
A = Matrix([[0, 1, 0, 0], [-k / m, -dq / m, k / m, 0], [0, 0, 0, 1], [k / b, 0, -k / b, -dtheta / b]])
INPUT = Matrix([0, 0, 0, 1 / b])
TABLE = {"m": 4e-7, "b": 2e-3, "k": 0.605, "dq": 0.0012, "dtheta": 0.0012}  # table 12.1
TARGET = {"omega": (100.0, 30.0), "xi": (0.7, 0.7)}


def polynomial(matrix):
    """Coefficients c0 to c3 of det(s - matrix)."""
    return matrix.charpoly(s).all_coeffs()[:0:-1]


def vanishes(expression):
    return sympy.expand(sympy.fraction(sympy.together(expression))[0]) == 0


# -- proofs ------------------------------------------------------------------------------------------------


def test_the_gains_of_the_motor_give_its_oscillator():
    K = motor_gains(b, dtheta, k, w1, x1)
    closed = Matrix([[0, 1], [(-k - K[0]) / b, (-dtheta - K[1]) / b]])

    assert simplify(closed.charpoly(s).as_expr() - (s**2 + 2 * x1 * w1 * s + w1**2)) == 0


def test_the_gains_of_the_joint_give_it_two_oscillators():
    wanted = sympy.Poly((s**2 + 2 * s * x1 * w1 + w1**2) * (s**2 + 2 * s * x2 * w2 + w2**2), s).all_coeffs()[:0:-1]
    K = joint_gains(m, b, k, dq, dtheta, target(Matrix([w1, w2]), Matrix([x1, x2])))

    assert all(vanishes(got - want) for got, want in zip(polynomial(A - INPUT * K.T), wanted, strict=True))


def test_every_target_is_stable():
    """Hurwitz' last determinant has no negative term."""
    c0, c1, c2, c3 = target(Matrix([w1, w2]), Matrix([x1, x2]))
    determinant = sympy.Poly(sympy.expand(c1 * (c2 * c3 - c1) - c0 * c3**2), w1, w2, x1, x2)
    square = 4 * x1 * x2 * w1 * w2 * (w1**2 - w2**2) ** 2  # its only terms with a minus

    assert all(c > 0 for c in sympy.Poly(sympy.expand(determinant.as_expr() - square), w1, w2, x1, x2).coeffs())


def test_the_joint_can_be_given_any_poles_as_long_as_its_spring_is_one():
    reach = Matrix.hstack(*(A**i * INPUT for i in range(4)))

    assert simplify(reach.det() - k**2 / (m**2 * b**4)) == 0


def test_the_mended_coefficients_are_those_of_the_closed_loop():
    mended = [
        -k * (a1 + a3) / (m * b),
        (-dq * a3 - k * (a2 + a4 - dq - dtheta)) / (m * b),
        (dq * dtheta - m * a3 + k * (m + b) - dq * a4) / (m * b),
        (m * dtheta - m * a4 + dq * b) / (m * b),
    ]

    assert all(vanishes(x - y) for x, y in zip(polynomial(A + INPUT * alpha.T), mended, strict=True))


def test_the_third_row_of_the_printed_identification_is_not_one_of_them():
    printed = (dq * dtheta - m * a3 + m * b / k * (m + b) - dq * a4) / (m * b)
    wrong = polynomial(A + INPUT * alpha.T)[2] - printed

    assert simplify(wrong - ((m + b) * k / (m * b) - (m + b) / k)) == 0
    assert sympy.solve(sympy.Eq(wrong, 0), k) == [sympy.sqrt(b * m)]  # right by chance for this spring only


def test_the_printed_jacobian_and_its_determinant_are_right():
    jacobian = Matrix(polynomial(A + INPUT * alpha.T)).jacobian(alpha)
    printed = k / (b * m) * Matrix([[-1, 0, -1, 0], [0, -1, -dq / k, -1], [0, 0, -m / k, -dq / k], [0, 0, 0, -m / k]])

    assert (jacobian - printed).applyfunc(simplify) == sympy.zeros(4)
    assert simplify(printed.det() - k**2 / (m**2 * b**4)) == 0


def test_the_input_matrix_carries_the_motor_and_not_the_gains():
    """Eq. 12.11 prints B = alpha; its own coefficients (eq. 12.12) come from B = (0, 0, 0, 1/b)."""
    as_printed = polynomial(A + alpha * Matrix([[1, 1, 1, 1]]))

    assert not vanishes(as_printed[0] + k * (a1 + a3) / (m * b))


def test_the_solution_grows_with_the_sign_printed_in_its_exponent():
    time, c, d = symbols("t c d", positive=True)
    root = (-c - sympy.sqrt(c**2 - 4 * m * d)) / (2 * m)  # eq. 12.4

    def left_side(x):
        return simplify(m * diff(x, time, 2) + c * diff(x, time) + d * x)

    assert left_side(exp(root * time)) == 0
    assert left_side(exp(-root * time)) != 0


# -- the kernels -------------------------------------------------------------------------------------------


def closed(K, **changed):
    matrix, column = joint(**TABLE | changed)
    return matrix - np.outer(column, K)


def test_the_kernel_places_the_poles_of_the_table(lib):
    got = lib.pole_placement(**TABLE, **TARGET)
    poles = np.sort_complex(np.linalg.eigvals(closed(got.K)))
    wanted = [
        w * (-x + sign * 1j * np.sqrt(1 - x**2)) for w, x in zip(*TARGET.values(), strict=True) for sign in (-1, 1)
    ]

    assert got.status == 0
    assert poles == pytest.approx(np.sort_complex(wanted), rel=1e-6)
    assert pytest.approx([13915.943099, 21.966372231, -13915.955, 5.6372], rel=1e-9) == -got.K


def test_the_poles_printed_belong_to_another_target_than_the_table_has(lib):
    got = lib.pole_placement(**TABLE, omega=(100.0, 10.0), xi=(1.0, 1.0))
    poles = np.sort(np.linalg.eigvals(closed(got.K)).real)

    assert poles == pytest.approx([-100, -100, -10, -10], rel=1e-4)


def test_the_printed_poles_of_the_other_spring_are_no_poles_of_any_spring(lib):
    """The spring does not enter the sum of the poles."""
    sums = [
        np.linalg.eigvals(closed(lib.pole_placement(**TABLE, **TARGET).K, k=spring)).sum().real for spring in (0.6, 0.7)
    ]
    printed = -318.78 + 2 * 53.27 - 0.058

    assert sums == pytest.approx([-182, -182], rel=1e-6)
    assert abs(printed + 2 * (100 + 10)) > 7


def test_a_spring_that_differs_by_a_hundredth_of_a_percent_makes_it_unstable(lib):
    K = lib.pole_placement(**TABLE, **TARGET).K

    def growth(spring):
        return np.linalg.eigvals(closed(K, k=spring)).real.max()

    assert growth(0.605) < 0
    assert growth(0.605 * (1 - 2e-4)) > 0
    assert growth(0.605 * (1 + 2e-4)) > 0


@pytest.mark.parametrize("name", ["m", "b", "k"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_a_plant_that_is_none_is_refused(lib, name, value):
    assert lib.pole_placement(**TABLE | {name: value}, **TARGET).status == 1


@pytest.mark.parametrize(
    "change", [{"omega": (100.0, 0.0)}, {"omega": (-1.0, 30.0)}, {"xi": (0.7, -0.1)}, {"xi": (np.nan, 0.7)}], ids=str
)
def test_a_target_that_is_not_stable_is_refused(lib, change):
    assert lib.pole_placement(**TABLE, **TARGET | change).status == 1
    assert lib.pole_placement_motor(b=2e-3, dtheta=0.0, k=1.0, omega0=-1.0, xi0=1.0).status == 1


def test_the_law_holds_what_is_desired_and_draws_towards_it(lib):
    K, x, x_des = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.1, 0.0, 0.3, 0.0]), np.array([0.2, 0.0, 0.25, 0.0])

    assert lib.pole_placement_law(K, x_des, x_des, 0.7) == 0.7
    assert lib.pole_placement_law(K, x, x_des, 0.7) == pytest.approx(0.7 + 0.1 - 0.15)
