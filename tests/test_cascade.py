"""Joint impedance on tendon forces (chapter 11): passive, in two time scales, and as a cascade with a certificate."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from proofs import vanishes
from sympy import Matrix, Rational, cos, diff, eye, simplify, symbols

from awiwi_gen.definitions.cascade_certificate import cascade_certificate
from awiwi_gen.definitions.impedance import cascade, joint_impedance, motor_impedance

T = sympy.Symbol("t")
ARM = a, b, c, d, e = symbols("a b c d e", positive=True)


def functions(names):
    return Matrix([sympy.Function(name)(T) for name in names.split()])


def column(*values):
    return [Matrix([value]) for value in values]


@pytest.fixture(scope="module")
def arm():
    """Two links in the plane, in symbols: mass matrix, Coriolis matrix of Christoffel symbols, gravity, angles."""
    q = functions("q1 q2")
    M = Matrix([[a + 2 * b * cos(q[1]), c + b * cos(q[1])], [c + b * cos(q[1]), c]])
    qd = q.diff(T)
    C = Matrix(2, 2, lambda i, j: sum(
        (diff(M[i, j], q[k]) + diff(M[i, k], q[j]) - diff(M[j, k], q[i])) / 2 * qd[k] for k in range(2)
    ))  # fmt: skip
    return M, C, Matrix([d * cos(q[0]) + e * cos(q[0] + q[1]), e * cos(q[0] + q[1])]), q


def energy_rate(arm, q_des, K, torque):
    """The rate of e' M e' / 2 + e K e / 2 along M q'' + C q' + g = torque."""
    M, C, gravity, q = arm
    error = q_des - q
    speed = error.diff(T)
    pushed = M * q_des.diff(T, 2) - (torque - C * q.diff(T) - gravity)  # M e''
    return (speed.T * pushed + speed.T * M.diff(T) * speed / 2 + error.T * K * speed)[0]


# -- the joint law ------------------------------------------------------------------------------------------


def test_the_energy_of_the_joints_falls_by_what_the_damper_takes(arm):
    M, C, gravity, q = arm
    q_des = functions("r1 r2")
    K, D = (Matrix([[x[0], x[1]], [x[1], x[2]]]) for x in (symbols("k:3"), symbols("D:3")))
    matrices = [Matrix(list(matrix)) for matrix in (M, C, K, D)]
    speed = (q_des - q).diff(T)

    tau = joint_impedance(
        None, *matrices[:2], gravity, q, q.diff(T), q_des, q_des.diff(T), q_des.diff(T, 2), *matrices[2:]
    )

    assert simplify(sympy.expand(energy_rate(arm, q_des, K, tau) + (speed.T * D * speed)[0])) == 0


@pytest.fixture(scope="module")
def printed_rate(arm):
    """The same in regulation, with the law as printed: C q' is cancelled (eq. 11.10)."""
    _, C, gravity, q = arm
    D = symbols("D", positive=True) * eye(2)
    tau = -q - D * q.diff(T) + gravity + C * q.diff(T)
    return energy_rate(arm, sympy.zeros(2, 1), eye(2), tau), D


def test_with_the_coriolis_torque_cancelled_half_of_the_changing_inertia_stays(arm, printed_rate):
    M, _, _, q = arm
    rate, D = printed_rate
    qd = q.diff(T)

    left = rate + (qd.T * D * qd)[0] - (qd.T * M.diff(T) * qd)[0] / 2

    assert simplify(sympy.expand(left)) == 0


def test_then_the_energy_rises_in_some_motions_against_eq_11_14(arm, printed_rate):
    q, (rate, _) = arm[-1], printed_rate
    speeds = dict(zip(q.diff(T), (10, -4), strict=True))

    here = rate.subs(speeds).subs(dict(zip(q, (0, sympy.pi / 2), strict=True)))

    assert here.subs({a: 3, b: 1, c: 1, symbols("D", positive=True): Rational(1, 10)}) > 0


def test_eq_11_13_counts_the_coriolis_torque_twice_and_turns_gravity_round(arm):
    M, C, gravity, q = arm
    qd, tau = q.diff(T), Matrix(symbols("tau:2"))
    true = (qd.T * (tau - C * qd - gravity) + qd.T * M.diff(T) * qd / 2)[0]
    skew = (qd.T * (M.diff(T) - 2 * C) * qd / 2)[0]

    mended, printed = (qd.T * (tau - gravity))[0] + skew, (qd.T * (tau - C * qd + gravity))[0] + skew

    assert simplify(sympy.expand(true - mended)) == 0
    assert simplify(sympy.expand(true - printed)) != 0


# -- two time scales ----------------------------------------------------------------------------------------

theta, thd, theta_des, friction, r, kp, kd = symbols("theta thd theta_des friction r kp kd")
f_des, rub = symbols("f_des rub")
SPRING = sympy.Function("V_k")(theta)  # its energy over the motor's angle: the tendon's torque is its slope


def motor_energy_rate(fed_forward):
    """The rate of the energy of eq. 11.5 under the law, feeding forward some force."""
    torque, at_rest = SPRING.diff(theta), SPRING.diff(theta).subs(theta, theta_des)
    tau, _ = motor_impedance(None, *column(theta, thd, theta_des, fed_forward, friction, r, kp, kd))
    rate = thd * (tau - torque - rub) + thd * (torque - at_rest) - thd * kp * (theta_des - theta)
    return sympy.expand(rate.subs(f_des, at_rest / r)), torque - at_rest


def test_feeding_forward_the_desired_force_the_motors_energy_falls_by_the_damper():
    rate, _ = motor_energy_rate(f_des)

    assert sympy.expand(rate - (-kd * thd**2 + thd * (friction - rub))) == 0  # eq. 11.8, mended


def test_feeding_forward_the_measured_force_leaves_a_term_of_either_sign():
    rate, missed = motor_energy_rate(SPRING.diff(theta) / r)

    assert sympy.expand(rate - (-kd * thd**2 + thd * (friction - rub)) - thd * missed) == 0


def test_over_compensation_below_the_damping_is_harmless_and_above_it_is_not():
    damper, speed, over = symbols("damper speed over", positive=True)

    rate = -damper * speed**2 + speed * over * speed  # an estimate that exceeds the friction by over times the speed

    assert rate.subs(over, damper / 2).is_negative
    assert rate.subs(over, 2 * damper).is_positive


def test_the_motor_finds_the_desired_force(lib):
    stiffness, radius, inertia, wanted = 8000.0, 0.004, 2e-3, 40.0
    at, speed = 0.0, 0.0
    for _ in range(4000):
        force = stiffness * radius * at
        tau = lib.motor_impedance(at, speed, wanted / (stiffness * radius), wanted, 0.0, radius, 5.0, 0.3).tau
        speed += (tau - radius * force) / inertia / 3000
        at += speed / 3000

    assert np.isclose(stiffness * radius * at, wanted, rtol=1e-9)


# -- the cascade --------------------------------------------------------------------------------------------


def test_the_force_error_obeys_its_own_equation_whatever_the_joints_do():
    angle, h, wanted = functions("theta h f_des")
    B, elongation = symbols("B x")
    curve, x = sympy.Function("phi")(elongation), r * angle + h
    force, k, curvature = (curve.diff(elongation, order).subs(elongation, x) for order in range(3))

    tau, _ = cascade(
        None, *column(force, x.diff(T), k, curvature / k, h.diff(T, 2), wanted, wanted.diff(T), wanted.diff(T, 2), friction,
                      r, B, kp, kd),
    )  # fmt: skip
    growing = k * (r * (tau - friction - r * force) / B + h.diff(T, 2)) + curvature * x.diff(T) ** 2  # f''
    error, rate = wanted - force, wanted.diff(T) - k * x.diff(T)

    assert simplify(sympy.expand(wanted.diff(T, 2) - growing + kd * rate + kp * error)) == 0


def test_eq_11_16_as_printed_loses_the_damping_gain():
    s, B = symbols("s B", positive=True)

    printed, mended = B * s**2 + kp * s + kp, B * s**2 + kd * s + kp

    assert kd not in printed.free_symbols
    assert sympy.Poly(mended, s).coeffs() == [B, kd, kp]


def test_the_matrix_of_eq_11_20_is_never_positive_definite():
    D, p, g = symbols("D p g", positive=True)
    W = Matrix([[D, p / 2, 0], [p / 2, 0, -g / 2], [0, -g / 2, 0]])  # of the printed V on (qd, e, e')

    assert sympy.expand(W.det() + D * g**2 / 4) == 0


def test_the_matrix_of_eq_11_21_is_never_positive_definite():
    D, p, g = symbols("D p g", positive=True)
    W = Matrix([[D, p / 2], [p / 2, -g]])

    assert W[1, 1].is_negative
    assert sympy.expand(-W.det()).is_positive


@pytest.fixture(scope="module")
def certified():
    """The certificate of one joint and two tendons in symbols."""
    D, P = symbols("D"), Matrix(symbols("p:2"))
    stiff, damp = Matrix(symbols("kp:2", positive=True)), Matrix(symbols("kd:2", positive=True))
    weight, omega = symbols("weight omega", positive=True)
    _, S, _ = cascade_certificate(None, *column(D), P, stiff, damp, *column(weight, omega))
    return D, P, stiff, damp, weight * sympy.diag(1, 1 / omega**2), S


def test_its_energy_solves_the_lyapunov_equation_of_every_force_loop(certified):
    _, _, stiff, damp, Q, S = certified

    for i in range(2):
        A, own = Matrix([[0, 1], [-stiff[i], -damp[i]]]), Matrix([[S[i, 0], S[i, 1]], [S[i, 1], S[i, 2]]])
        assert all(vanishes(entry) for entry in A.T * own + own * A + Q)


def test_its_energy_is_positive_for_positive_gains(certified):
    S = certified[-1]

    for i in range(2):
        assert S[i, 2].is_positive
        assert sympy.factor(sympy.together(S[i, 0] * S[i, 2] - S[i, 1] ** 2)).is_positive


def test_its_energy_falls_as_the_matrix_w_says(certified):
    D, P, stiff, damp, Q, S = certified
    mass, k, q, qd = symbols("m k q qd")
    errors, rates = Matrix(symbols("e:2")), Matrix(symbols("ed:2"))
    energy = mass * qd**2 / 2 + k * q**2 / 2
    energy += sum(
        S[i, 0] * errors[i] ** 2 + 2 * S[i, 1] * errors[i] * rates[i] + S[i, 2] * rates[i] ** 2 for i in range(2)
    )
    push = (P.T * errors)[0]  # the torque is -P' f, and f = f_des - e
    flow = {q: qd, qd: (-D * qd - k * q + push) / mass, **dict(zip(errors, rates, strict=True))}
    flow |= {rates[i]: -stiff[i] * errors[i] - damp[i] * rates[i] for i in range(2)}

    rate = sum(energy.diff(symbol) * speed for symbol, speed in flow.items())
    lost = D * qd**2 - qd * push + sum(Q[0, 0] * errors[i] ** 2 + Q[1, 1] * rates[i] ** 2 for i in range(2))

    assert vanishes(rate + lost)


def test_a_heavy_enough_weight_certifies_every_positive_damping():
    D, p, weight = symbols("D p weight", positive=True)
    W = Matrix([[D, -p / 2], [-p / 2, weight]])

    assert sympy.expand(W.det().subs(weight, p**2 / (2 * D))).is_positive
    assert sympy.limit(W.det(), weight, 0).is_negative


@pytest.fixture(scope="module")
def gain_sets():
    """Random dampings, couplings and force loops, good and bad."""
    random, count = np.random.default_rng(0), 2000
    A = random.normal(size=(count, 4, 4))
    D = 0.02 * (A + A.swapaxes(1, 2)) + random.uniform(0.02, 0.2, (count, 1, 1)) * np.eye(4)
    P = random.uniform(-0.02, 0.02, (count, 8, 4))
    stiff, damp = random.uniform(-10, 1000, (count, 8)), random.uniform(-1, 100, (count, 8))
    return D, P, stiff, damp, 10 ** random.uniform(-3, 0, count), random.uniform(10, 100, count)


def test_the_margin_is_positive_where_all_of_the_proof_holds_and_only_there(lib, gain_sets):
    D, P, stiff, damp, weight, omega = gain_sets
    margin = lib.cascade_certificate(*gain_sets).margin

    W, at = np.zeros((len(D), 20, 20)), np.arange(4, 12)
    W[:, :4, :4] = D
    W[:, :4, 4:12], W[:, 4:12, :4] = P.swapaxes(1, 2) / 2, P / 2
    W[:, at, at] = weight[:, None]
    W[:, at + 8, at + 8] = (weight / omega**2)[:, None]
    holds = (np.linalg.eigvalsh(W)[:, 0] > 0) & (stiff > 0).all(axis=1) & (damp > 0).all(axis=1)

    assert 0.1 < holds.mean() < 0.9
    assert np.array_equal(margin > 0, holds)


def test_the_energy_it_returns_is_that_of_scipys_lyapunov_solver(lib, gain_sets):
    linalg = pytest.importorskip("scipy.linalg")
    D, P, stiff, damp, weight, omega = (values[:30] for values in gain_sets)
    stiff, damp = np.abs(stiff) + 1, np.abs(damp) + 1

    S = lib.cascade_certificate(D, P, stiff, damp, weight, omega).S

    for s in range(30):
        for i in range(8):
            A, Q = np.array([[0, 1], [-stiff[s, i], -damp[s, i]]]), weight[s] * np.diag([1, omega[s] ** -2])
            found = np.array([[S[s, i, 0], S[s, i, 1]], [S[s, i, 1], S[s, i, 2]]])
            assert np.allclose(found, linalg.solve_continuous_lyapunov(A.T, -Q), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(("weight", "omega"), [(-0.1, 100.0), (0.0, 100.0), (0.1, -100.0), (np.nan, 100.0)])
def test_an_energy_with_a_weight_that_is_not_positive_certifies_nothing(lib, weight, omega):
    D, P, stiff, damp = 0.05 * np.eye(4), np.full((8, 4), 0.005), np.full(8, 1e4), np.full(8, 150.0)

    assert lib.cascade_certificate(D, P, stiff, damp, weight, omega).status == 1


@pytest.mark.parametrize("bad", ["nothing", "damping", "kp", "kd", "nan"])
def test_a_bad_gain_is_never_certified(lib, bad):
    D, P = 0.05 * np.eye(4), np.full((8, 4), 0.005)
    loops = {"kp": np.full(8, 1e4), "kd": np.full(8, 150.0)}
    if bad == "damping":
        D[3, 2] = D[2, 3] = 0.06
    elif bad == "nan":
        D[1, 1] = np.nan
    elif bad in loops:
        loops[bad][5] = -1.0

    margin = lib.cascade_certificate(D, P, loops["kp"], loops["kd"], 0.1, 100.0).margin

    assert bool(margin > 0) == (bad == "nothing")


def test_joints_that_are_driven_instead_of_damped_are_not_certified(lib):
    loops = np.full(8, 1e4), np.full(8, 150.0)

    assert lib.cascade_certificate(-0.05 * np.eye(4), np.full((8, 4), 0.005), *loops, 0.1, 100.0).margin < 0


def test_the_certified_energy_falls_along_the_motion_of_the_index_finger(lib):
    q_des, zero, weightless = np.array([0.1, 0.5, 0.6, 0.4]), np.zeros(4), np.zeros(3)
    K, D = np.diag([0.5, 0.5, 0.3, 0.2]), np.diag([0.01, 0.01, 0.006, 0.004])
    P, stiff, damp = lib.index_coupling(q_des), np.full(8, 150.0**2), np.full(8, 240.0)
    margin, S, _ = lib.cascade_certificate(D, P, stiff, damp, 0.2, 150.0)
    assert margin > 0

    def flow(x):
        q, qd, error, rate = x[:4], x[4:8], x[8:16], x[16:]
        M, C, gravity = lib.index_dynamics(q, qd, weightless)
        tau = lib.joint_impedance(M, C, gravity, q, qd, q_des, zero, zero, K, D) + P.T @ error
        qdd = np.linalg.solve(M, tau - C @ qd - gravity)
        return np.concatenate([qd, qdd, rate, -stiff * error - damp * rate])

    def energy(x):
        q, qd, error, rate = x[:4], x[4:8], x[8:16], x[16:]
        M, _, _ = lib.index_dynamics(q, qd, weightless)
        own = S[:, 0] * error**2 + 2 * S[:, 1] * error * rate + S[:, 2] * rate**2
        return qd @ M @ qd / 2 + (q - q_des) @ K @ (q - q_des) / 2 + own.sum()

    random, step = np.random.default_rng(1), 5e-5
    x = np.concatenate([q_des - 0.2, random.normal(size=4) * 2, random.normal(size=8) * 5, random.normal(size=8) * 500])
    values = [energy(x)]
    for _ in range(2000):
        k1 = flow(x)
        k2 = flow(x + step / 2 * k1)
        k3 = flow(x + step / 2 * k2)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + flow(x + step * k3))
        values.append(energy(x))

    assert np.all(np.diff(values) < 0)
    assert values[-1] < 0.1 * values[0]
