"""What chapters 15 and 16 print of the backstepping laws, against what follows from their own equations of motion."""

from __future__ import annotations

import sympy
from proofs import column, rate, spelled_out, vanishes
from sympy import Matrix, Rational, symbols

from awiwi_gen.definitions.backstepping.gains import backstepping_state_gains

m, b, k = PLANT = column("m b k")
K_p, K_d, K_3, K_4 = GAINS = column("K_p K_d K_3 K_4")
x1, x2, x3, x4 = column("x1:5")
u, v, tau_m, tau_ext = column("u v tau_m tau_ext")

TABLE_16_1 = {m: Rational("7.2e-7"), b: Rational("2e-3"), k: Rational("0.605")}


# -- sections 15.1 and 15.2 --------------------------------------------------------------------------------


def test_the_first_state_of_the_example_is_driven_by_the_error_and_not_by_itself():
    k1, z2 = symbols("k1 z2")
    moved = (-(x1**3) + x1**2 + x2).subs(x2, z2 - x1**2 - k1 * x1)  # x2 = z2 + its wanted value, eq. 15.2

    assert vanishes(moved - (-(x1**3) - k1 * x1 + z2))
    assert not vanishes(moved - (-(x1**3) - k1 * x1 - x1))  # eq. 15.4


def test_the_motor_of_eq_15_15_is_as_heavy_as_the_motor():
    q, qd, theta, thd = column("q qd theta thd")
    force = k * (q - theta)  # eq. 15.11 and 15.12: m q'' = -f, b theta'' = f + u
    moving = {q: qd, qd: -force / m, theta: thd, thd: (force + u) / b}
    momentum = m * qd + b * thd

    assert vanishes(rate(momentum, moving) - u)  # only the motor's torque moves the whole
    assert not vanishes(rate(momentum, moving | {thd: force / m + u / b}) - u)


def test_the_linearising_torque_after_eq_15_21_takes_the_acceleration():
    q2, q4 = symbols("q2 q4")
    fourth = sympy.solve(sympy.Eq(b * m / k * q4 + (b + m) * q2, u), q4)[0]  # eq. 15.17

    assert vanishes(fourth.subs(u, b * m / k * (k * (b + m) / (b * m) * q2 + v)) - v)
    assert not vanishes(fourth.subs(u, b * m / k * (k * (b + m) / (b * m) * q4 + v)) - v)


# -- section 15.3 ------------------------------------------------------------------------------------------


def torque_acceleration():
    """tau'' of eq. 15.51, tau = k (theta - q)."""
    return k * ((tau_m - x3) / b - (x3 + tau_ext) / m)


def test_the_last_row_of_eq_15_53_has_the_motor_before_its_bracket():
    bracket = -(m + b) / m * x3 + tau_m - b / m * tau_ext

    assert vanishes(torque_acceleration() - k / b * bracket)
    assert vanishes(k / m * bracket - b / m * torque_acceleration())


def test_the_energy_of_eq_15_55_is_of_the_speed_and_counts_the_outer_torque_once():
    moving = {x1: x2, x2: (-K_p * x1 - K_d * x2 + tau_ext) / m}
    energy = m * x2**2 / 2 + K_p * x1**2 / 2
    middle = x2 * (-K_p * x1 - K_d * x2 + tau_ext) + x2 * K_p * x1 + x2 * tau_ext

    assert vanishes(rate(energy, moving) - (-K_d * x2**2 + x2 * tau_ext))
    assert vanishes(middle - rate(energy, moving) - x2 * tau_ext)


def test_the_outer_torque_works_on_the_speed_and_not_on_the_torque_error_of_eq_15_60():
    z3 = symbols("z3")
    moving = {x1: x2, x2: (-K_p * x1 - K_d * x2 + z3 + tau_ext) / m, z3: -K_3 * z3 - x2}
    found = rate(m * x2**2 / 2 + K_p * x1**2 / 2 + z3**2 / 2, moving)

    assert vanishes(found - (-K_d * x2**2 - K_3 * z3**2 + x2 * tau_ext))
    assert not vanishes(found - (-K_d * x2**2 - K_3 * z3**2 - z3 * tau_ext))


def test_eq_15_62_cancels_the_torque_and_eq_15_67_doubles_and_reverses_it():
    free = torque_acceleration().subs(tau_ext, 0)
    right, printed = (sign * ((m + b) / m * x3 + b / k * u) for sign in (1, -1))

    assert vanishes(free.subs(tau_m, right) - u)
    assert vanishes(free.subs(tau_m, printed) - (-u - 2 * k * (m + b) / (m * b) * x3))


# -- section 15.4 ------------------------------------------------------------------------------------------


def test_before_eq_15_76_the_torques_stand_outside_the_bracket():
    slope, curvature = symbols("slope curvature")
    curved = curvature * (x4 / slope) ** 2
    stretch = curved + slope / b * (tau_m - (b + m) / m * x3 - b / m * tau_ext)  # eq. 15.75
    torques = (b + m) / m * x3 + b / m * tau_ext

    assert vanishes(stretch.subs(tau_m, b / slope * (u - curved) + torques) - u)
    assert not vanishes(stretch.subs(tau_m, b / slope * (u - curved + torques)) - u)
    assert vanishes(
        stretch.subs(tau_m, b / slope * (u - curved) + torques).subs(curvature, 0) - u
    )  # it may be straight


def test_the_middle_line_of_eq_15_81_interchanges_slope_and_curvature():
    slope, curvature = symbols("slope curvature")
    right = curvature * (x4 / slope) ** 2 + slope / b * (tau_m - (b + m) / m * x3)
    printed = x4**2 / slope + curvature / b * (tau_m - (b + m) / (b * m) * x3)

    assert vanishes(torque_acceleration().subs(tau_ext, 0) - right.subs({slope: k, curvature: 0}))
    assert vanishes(printed.subs(curvature, 0) - x4**2 / slope)  # a straight spring would not feel the motor


# -- section 15.5 ------------------------------------------------------------------------------------------


def pair():
    """Torques and their accelerations of two motors on a link (eq. 15.82, equal motors)."""
    tau, motors, springs = column("tau1:3"), column("tau_m1:3"), column("k1:3")
    link = (tau[0] - tau[1] + tau_ext) / m
    return (
        tau,
        motors,
        springs,
        [springs[i] * ((motors[i] - tau[i]) / b - side * link) for i, side in enumerate((1, -1))],
    )


def test_eq_15_83_pulls_back_with_the_torque_of_its_own_spring():
    tau, motors, springs, accelerated = pair()
    for i, side in enumerate((1, -1)):
        others = tau[1 - i] + m / b * motors[i] - side * tau_ext
        assert vanishes(accelerated[i] - springs[i] / m * (-(m + b) / b * tau[i] + others))
        printed = springs[i] / m * ((m + b) / b * tau[i] + others)
        assert vanishes(printed - accelerated[i] - 2 * springs[i] * (m + b) / (m * b) * tau[i])


def test_the_decoupling_of_eq_15_84_leaves_the_other_tendon_in_the_links_equation():
    tau, motors, _, accelerated = pair()
    decoupled = [a.subs(motors[i], b / m * (u - tau[1 - i])) for i, a in enumerate(accelerated)]

    assert all(vanishes(d.diff(tau[1 - i])) for i, d in enumerate(decoupled))  # as meant
    link = (tau[0] - tau[1] + tau_ext) / m
    assert vanishes(link - (tau[0] + tau_ext) / m + tau[1] / m)  # eq. 15.86 has no such term


E_T = q, qd, e, ed = column("q qd e ed")
C_t, C_s, K_t, K_s = column("C_t C_s K_t K_s")
LINK = (-K_p * q - K_d * qd + e) / m  # eq. 15.92 of one motor
MENDED = -(qd + K_t * e) / C_t  # of eq. 15.95


def test_the_sign_of_k_t_in_eq_15_95_feeds_the_error():
    energy = m * qd**2 / 2 + K_p * q**2 / 2 + C_t * e**2 / 2
    mended, printed = (rate(energy, {q: qd, qd: LINK, e: -(qd + sign * K_t * e) / C_t}) for sign in (1, -1))

    assert vanishes(mended - (-K_d * qd**2 - K_t * e**2))
    assert vanishes(printed - (-K_d * qd**2 + K_t * e**2))


def mended_law():
    """e'' under eq. 15.104 with eq. 15.95 mended, and the error e_s."""
    e_s = ed - MENDED
    return rate(MENDED, {q: qd, qd: LINK, e: ed}) - C_t / C_s * e - K_s / C_s * e_s, e_s


def test_the_energy_falls_by_k_s_and_not_by_c_s_as_eq_15_105_has_it():
    moved, e_s = mended_law()
    energy = m * qd**2 / 2 + K_p * q**2 / 2 + C_t * e**2 / 2 + C_s * e_s**2 / 2
    found = rate(energy, {q: qd, qd: LINK, e: ed, ed: moved})

    assert vanishes(found - (-K_d * qd**2 - K_t * e**2 - K_s * e_s**2))
    assert not vanishes(found - (-K_d * qd**2 - K_t * e**2 - C_s * e_s**2))


def test_eq_15_106_as_printed_has_a_growing_motion_where_the_mended_law_has_none():
    jerk = rate(LINK, {q: qd, qd: LINK, e: ed})
    edd = symbols("edd")
    literal = -(jerk - K_t * edd) / C_t - C_t / C_s * e - K_s / C_s * (qd / C_t + (1 - K_t / C_t) * ed)
    numbers = {m: TABLE_16_1[m], K_p: Rational(1, 2), K_d: Rational(1, 20), K_t: 100, K_s: 100, C_t: 1, C_s: 1}

    assert literal.diff(edd) != 0  # one derivative too many: the law asks for what it is to decide
    for moved, grows in ((sympy.solve(sympy.Eq(edd, literal), edd)[0], True), (mended_law()[0], False)):
        closed = Matrix([qd, LINK, ed, moved]).jacobian(E_T).subs(numbers)
        poles = sympy.Poly(closed.charpoly().as_expr()).nroots(n=30)
        assert any(sympy.re(pole) > 0 for pole in poles) is grows


# -- chapter 16 --------------------------------------------------------------------------------------------


def third_gain():
    """The gain of tau with weights of 1, and what is left of it without gains (eq. 16.3)."""
    K = spelled_out(backstepping_state_gains(None, PLANT, GAINS, Matrix([1, 1])).K[2])
    return K, K.subs(dict.fromkeys(GAINS, 0))


def test_the_constant_of_eq_16_3_has_the_slip_of_sign_of_eq_15_70_and_its_right_sign_is_1812_594():
    _, constant = third_gain()
    printed = (m + b) / m + b / (k * m) + b / k

    assert vanishes(printed - constant - 2 * (m + b) / m)
    assert round(float(printed.subs(TABLE_16_1)), -2) == 7400
    assert round(float(constant.subs(TABLE_16_1)), 3) == 1812.594
    rounded = {b / k: 0.0033, b / (k * m): 4600, 1 / m: 1400000}
    assert all(f"{float(exact.subs(TABLE_16_1)):.2g}" == f"{text:.2g}" for exact, text in rounded.items())


def test_the_state_of_eq_16_2_has_other_gains_than_those_of_eq_16_3():
    g1, g2, g3, g4 = gains = column("g1:5")
    q, qd, theta, thd = column("q qd theta thd")
    by_torque = (gains.T * Matrix([q, qd, k * (theta - q), k * (thd - qd)]))[0]

    assert vanishes(by_torque - (g1 - k * g3) * q - (g2 - k * g4) * qd - k * g3 * theta - k * g4 * thd)


def test_no_gains_with_weights_of_one_come_to_the_optimum_of_table_16_1():
    """With the spring cancelled, the gain of tau is never less than 4591.37; the table's costs want 2058.22."""
    positive = symbols("K_p K_d K_3 K_4 m b k", positive=True)
    K = third_gain()[0] + (m + b) / m
    excess = sympy.expand((K - b / k * (1 + 1 / m)).subs(dict(zip([*GAINS, *PLANT], positive, strict=True))))

    assert all(term.is_positive for term in sympy.Add.make_args(excess))
    assert round(float((b / k * (1 + 1 / m)).subs(TABLE_16_1)), 2) == 4591.37
