"""Stiffness of the controller behind tendons (chapter 8): what is felt, when it exists, and when it is stable."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from proofs import vanishes

from awiwi_gen.definitions.stiffness_correction import stiffness_correction, stiffness_correction_scalar

SAMPLES = 400
UNIT = np.eye(4)


def series(*stiffnesses):
    return np.linalg.inv(sum(np.linalg.inv(stiffness) for stiffness in stiffnesses))


def least_eigenvalue(matrix):
    return np.linalg.eigvalsh((matrix + matrix.swapaxes(-1, -2)) / 2)[..., 0]


@pytest.fixture(scope="module")
def pairs():
    """Random symmetric matrices, definite and not, in both orders."""
    random = np.random.default_rng(0)

    def drawn(mean):
        A = random.normal(size=(SAMPLES, 4, 4))
        return A + A.swapaxes(1, 2) + random.uniform(-2, 14, (SAMPLES, 1, 1)) * UNIT + mean * UNIT

    return drawn(0.0), drawn(8.0)


def test_in_series_with_the_tendons_it_is_what_is_asked_for():
    a, b, c, d, e, f = sympy.symbols("a b c d e f")
    wanted, tendons = sympy.Matrix([[a, b], [b, c]]), sympy.Matrix([[d, e], [e, f]])

    controller, _ = stiffness_correction(None, wanted.reshape(4, 1), tendons.reshape(4, 1))

    # K_eff^-1 = K_imp^-1 + K_mech^-1, times K_imp from the left and K_mech from the right
    missing = controller * wanted.inv() * tendons - tendons - controller
    assert all(vanishes(entry) for entry in missing)


def test_the_kernel_gives_the_stiffness_that_is_asked_for(lib, pairs):
    wanted, tendons = pairs
    K_imp, status = lib.stiffness_correction(wanted, tendons)
    good = status == 0

    assert 0.2 < good.mean() < 0.8
    assert np.allclose(series(K_imp[good], tendons[good]), wanted[good], rtol=1e-6, atol=1e-8)
    assert np.allclose(K_imp, K_imp.swapaxes(1, 2), rtol=1e-9, equal_nan=True)


def test_the_guard_is_that_tendons_are_stiffer_than_the_desire_and_the_desire_stable(lib, pairs):
    wanted, tendons = pairs

    _, status = lib.stiffness_correction(wanted, tendons)

    possible = (least_eigenvalue(wanted) > 0) & (least_eigenvalue(tendons - wanted) > 0)
    assert np.array_equal(status == 0, possible)


def test_a_correction_that_passes_the_guard_is_positive_definite_and_above_the_desire(lib, pairs):
    wanted, tendons = pairs
    K_imp, status = lib.stiffness_correction(wanted, tendons)
    good = status == 0

    assert np.all(least_eigenvalue(K_imp[good]) > 0)
    assert np.all(least_eigenvalue(K_imp[good] - wanted[good]) > 0)


def test_where_the_guard_refuses_a_stable_desire_no_positive_definite_controller_exists(pairs):
    wanted, tendons = pairs
    stable = (least_eigenvalue(wanted) > 0) & (least_eigenvalue(tendons) > 0)
    refused = stable & (least_eigenvalue(tendons - wanted) < 0)

    controllers = np.linalg.inv(np.linalg.inv(wanted[refused]) - np.linalg.inv(tendons[refused]))

    assert refused.sum() > 20
    assert np.all(least_eigenvalue(controllers) < 0)


def test_a_positive_felt_stiffness_is_not_enough_as_section_8_2_has_it():
    theta, q, controller, tendons = sympy.symbols("theta q K_imp K_mech")
    energy = controller * theta**2 / 2 + tendons * (q - theta) ** 2 / 2

    hessian = sympy.hessian(energy, (theta, q))

    assert sympy.expand(hessian.det() - controller * tendons) == 0  # positive only with K_imp
    example = hessian.subs({controller: -3, tendons: 1})
    assert 1 / (sympy.Rational(-1, 3) + 1) == sympy.Rational(3, 2)  # is felt
    assert example.det() < 0  # a saddle: the equilibrium is unstable


def test_a_motor_behind_such_a_controller_runs_away_though_the_joint_feels_stiff():
    controller, tendons, inertia, damping = -3.0, 1.0, np.diag([1e-2, 1e-4]), 0.05 * np.eye(2)
    stiffness = np.array([[controller + tendons, -tendons], [-tendons, tendons]])
    loop = np.block([
        [np.zeros((2, 2)), np.eye(2)],
        [-np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, damping)],
    ])  # fmt: skip

    assert np.isclose(series(np.array([[controller]]), np.array([[tendons]]))[0, 0], 1.5)
    assert np.linalg.eigvals(loop).real.max() > 1


def test_eq_8_2_makes_the_controller_eps_over_eps_minus_one_times_the_desire():
    k, eps = sympy.symbols("k eps", positive=True)

    k_imp, sensitivity, guards = stiffness_correction_scalar(None, sympy.Matrix([k]), sympy.Matrix([eps * k]))

    assert sympy.simplify(k_imp - eps / (eps - 1) * k) == 0
    assert sympy.simplify(sensitivity + 1 / (eps - 1) ** 2) == 0
    assert sympy.simplify(guards[1] - (eps - 1) * k) == 0


@pytest.mark.parametrize(("eps", "sensitivity"), [(1.5, -4), (2.0, -1), (3.0, -0.25)])
def test_an_error_of_the_tendons_costs_the_less_the_stiffer_they_are(lib, eps, sensitivity):
    found = lib.stiffness_correction_scalar(1.0, eps)

    assert found.status == 0
    assert np.isclose(found.sensitivity, sensitivity, rtol=1e-14)
    step = 1e-6
    slope = (lib.stiffness_correction_scalar(1.0, eps + step).k_imp - found.k_imp) / step
    assert np.isclose(slope, sensitivity, rtol=1e-5)


def test_where_both_are_equal_the_inverse_vanishes_and_not_the_stiffness(lib):
    K = np.diag([1.0, 2.0, 3.0, 4.0]) + 0.1
    near = [lib.stiffness_correction(K, K + gap * UNIT).K_imp for gap in (1, 1e-3, 1e-6)]

    inverses = [np.linalg.norm(np.linalg.inv(controller)) for controller in near]

    assert lib.stiffness_correction(K, K).status == 1
    assert lib.stiffness_correction_scalar(2.0, 2.0).status == 1
    assert inverses[0] > 100 * inverses[1] > 10000 * inverses[2]  # printed: K_imp^-1 becomes infinite


def test_fewer_joints_are_the_first_of_four(lib):
    wanted, tendons = np.array([[1.0, 0.2], [0.2, 2.0]]), np.array([[4.0, -0.5], [-0.5, 5.0]])
    padded = [UNIT.copy(), 2 * UNIT]
    for whole, part in zip(padded, (wanted, tendons), strict=True):
        whole[:2, :2] = part

    found = lib.stiffness_correction(*padded)

    assert found.status == 0
    assert np.allclose(series(found.K_imp[:2, :2], tendons), wanted, rtol=1e-12)
    assert np.allclose(found.K_imp[2:], 2 * UNIT[2:])


def test_only_lower_triangles_are_read(lib, pairs):
    wanted, tendons = pairs
    above = np.triu(np.full((4, 4), np.nan), 1)

    plain, marked = lib.stiffness_correction(wanted, tendons), lib.stiffness_correction(wanted + above, tendons + above)

    assert np.array_equal(plain.K_imp, marked.K_imp, equal_nan=True)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 0.0, -1.0])
def test_what_is_no_stiffness_is_refused(lib, bad):
    K_eff, K_mech = UNIT.copy(), 3 * UNIT
    K_eff[2, 2] = bad

    assert lib.stiffness_correction(K_eff, K_mech).status == 1
    assert lib.stiffness_correction_scalar(bad, 3.0).status == 1


def test_a_pretension_and_this_correction_make_a_finger_feel_as_desired(lib):
    q, forces = np.array([0.1, 0.4, 0.5, 0.3]), np.linspace(20.0, 60.0, 8)
    P = lib.index_coupling(q)
    tendons = P.T @ (lib.index_tendon_stiffness(forces).k[:, None] * P)
    wanted = np.diag(np.linalg.eigvalsh(tendons)[0] / np.array([1.5, 2.0, 3.0, 4.0]))

    controller = lib.stiffness_correction(wanted, tendons)

    assert controller.status == 0
    assert np.allclose(series(controller.K_imp, tendons), wanted, rtol=1e-10, atol=1e-12)
