"""The backstepping laws of sections 15.1 to 15.4: their proofs, and where the printed ones fail."""

from __future__ import annotations

import sympy
from proofs import column, rate, shifts, spelled_out, vanishes
from sympy import Matrix, Symbol

from awiwi_gen.definitions.backstepping.gains import backstepping_state_gains
from awiwi_gen.definitions.backstepping.laws import academic_law, impedance_law, nonlinear_law, position_law
from awiwi_gen.definitions.backstepping.recursion import Level, Start, Tuning, backstep
from awiwi_gen.definitions.naming import Derivation

PLANT = m, b, k = column("m b k")
GAINS = K_p, K_d, K_3, K_4 = column("K_p K_d K_3 K_4")
WEIGHTS = C_t, C_s = column("C_t C_s")
STATE = q, qd, tau, taud = column("q qd tau taud")
DESIRED = column("r:5")
EXTERNAL = tau_ext, tau_extd = column("tau_ext tau_extd")
JOINT = {"state": STATE, "desired": DESIRED, "external": EXTERNAL, "gains": GAINS, "weights": WEIGHTS}


def joint_flow(motor, slope=k, curvature=0):
    """A joint behind one spring (eq. 15.71, r = 1)."""
    accelerated = (tau + tau_ext) / m
    stretch = curvature * (taud / slope) ** 2 + slope * ((motor - tau) / b - accelerated)
    return {q: qd, qd: accelerated, tau: taud, taud: stretch, **shifts(DESIRED, EXTERNAL)}


# -- the recursion -----------------------------------------------------------------------------------------


def test_the_recursion_stabilises_any_chain():
    x1, x2, x3 = x = column("x1:4")
    a = column("a:6")
    drifts = [a[0] * x1**2, a[1] * x1 * x2, a[2] * x1 + a[3] * x3 * x2]
    gains = [1 + a[4] * x1**2, 2 + x1 * x2, a[5]]
    rates, weights = column("k1:4"), column("c1:4")

    chain = [Level(Matrix([x[i]]), Matrix([drifts[i]]), Matrix([gains[i]])) for i in range(3)]
    tunings = [Tuning(rates[i : i + 1, :], weights[i : i + 1, :]) for i in range(3)]
    law = backstep(chain, Start(0, Matrix([0])), tunings, Derivation())
    u = spelled_out(law.control[0])
    flow = {x1: drifts[0] + gains[0] * x2, x2: drifts[1] + gains[1] * x3, x3: drifts[2] + gains[2] * u}

    assert vanishes(rate(law.energy, flow) - law.rate)
    squares = [c * k * spelled_out(z[0]) ** 2 for c, k, z in zip(weights, rates, law.errors, strict=True)]
    assert vanishes(law.rate + sum(squares))


def test_the_recursion_stabilises_levels_of_several_states():
    first, second = column("x1:3"), column("x3:5")
    couples = Matrix([[1, Symbol("a")], [0, 2 + first[0] ** 2]])
    rates, weights = column("k1:5"), column("c1:5")

    chain = [
        Level(first, Matrix([first[1], -first[0]]), couples),
        Level(second, Matrix([first[0] * second[1], 0]), sympy.diag(1, 3)),
    ]
    tunings = [Tuning(rates[i : i + 2, :], weights[i : i + 2, :]) for i in (0, 2)]
    law = backstep(chain, Start(0, Matrix([0, 0])), tunings, Derivation())
    u = law.control.applyfunc(spelled_out)
    flow = dict(zip(first, chain[0].drift + couples * second, strict=True))
    flow |= zip(second, chain[1].drift + chain[1].gain * u, strict=True)

    assert vanishes(rate(law.energy, flow) - law.rate)


# -- section 15.1 ------------------------------------------------------------------------------------------


X = x1, x2 = column("x1 x2")
K = k1, k2 = column("k1 k2")


def academic_flow(u):
    return {x1: -(x1**3) + x1**2 + x2, x2: u}


def test_the_energy_of_the_example_falls():
    law = academic_law(X, K)

    assert vanishes(rate(law.energy, academic_flow(spelled_out(law.control[0]))) - law.rate)
    z2 = x2 + x1**2 + k1 * x1
    assert vanishes(law.rate + x1**4 + k1 * x1**2 + k2 * z2**2)


def test_the_printed_control_of_the_example_lacks_minus_x1_and_its_energy_may_rise():
    law = academic_law(X, K)
    z2 = x2 + x1**2 + k1 * x1
    printed = -(2 * x1 + k1) * (-(x1**3) + x1**2 + x2) - k2 * z2
    rises = rate(law.energy, academic_flow(printed))

    assert vanishes(spelled_out(law.control[0]) - (printed - x1))
    assert vanishes(rises - (law.rate + x1 * z2))
    gains_of_figure_15_1 = {k1: sympy.Rational(1, 100), k2: sympy.Rational(1, 2)}
    assert rises.subs(gains_of_figure_15_1 | {x1: sympy.Rational(1, 10), x2: sympy.Rational(1, 10)}) > 0
    assert vanishes(rate(z2, academic_flow(printed)) + k2 * z2)  # why its figures converge all the same


# -- section 15.2 ------------------------------------------------------------------------------------------


MOTION = column("y:4")
RATES = column("k1:5")
SCALES = column("c2:5")


def test_the_energy_of_the_position_law_falls():
    law = position_law(MOTION, DESIRED, PLANT, RATES, SCALES)
    u = spelled_out(law.control[0])
    flow = {**shifts(MOTION, DESIRED), MOTION[3]: k / (b * m) * (u - (b + m) * MOTION[2])}

    assert vanishes(rate(law.energy, flow) - law.rate)
    errors = [spelled_out(z[0]) for z in law.errors]
    assert vanishes(law.rate + sum(c * r * z**2 for c, r, z in zip([1, *SCALES], RATES, errors, strict=True)))


def test_the_position_law_completed_is_the_characteristic_polynomial_of_its_errors():
    a, b_, c, d = RATES
    law = position_law(MOTION, Matrix([0] * 5), PLANT, RATES, Matrix([1, 1, 1]))
    coefficients = [
        a * b_ * c * d + a * b_ + a * d + c * d + 1,
        a * b_ * c + a * b_ * d + a * c * d + 2 * a + b_ * c * d + b_ + c + 2 * d,
        a * b_ + a * c + a * d + b_ * c + b_ * d + c * d + 3,
        a + b_ + c + d,
    ]
    expected = (b + m) * MOTION[2] - b * m / k * sum(x * y for x, y in zip(coefficients, MOTION, strict=True))

    assert vanishes(law.control[0] - expected)


# -- sections 15.3 and 15.4 --------------------------------------------------------------------------------


def test_the_energy_of_the_impedance_law_falls_but_for_the_power_of_the_outer_torque():
    law = impedance_law(plant=PLANT, **JOINT)
    z3, z4 = (spelled_out(z[0]) for z in law.errors)
    speed = qd - DESIRED[1]

    assert vanishes(rate(law.energy, joint_flow(spelled_out(law.control[0]))) - law.rate)
    assert vanishes(law.rate + K_d * speed**2 + C_t * K_3 * z3**2 + C_s * K_4 * z4**2 - speed * tau_ext)


def test_the_energy_falls_behind_a_spring_of_any_slope_and_curvature_even_none():
    slope, curvature = spring = column("slope curvature")
    law = nonlinear_law(plant=PLANT[:2, :], spring=spring, **JOINT)
    flow = joint_flow(spelled_out(law.control[0]), slope, curvature)

    assert vanishes(rate(law.energy, flow) - law.rate)
    linear = impedance_law(plant=PLANT, **JOINT).control[0]
    assert vanishes(spelled_out(law.control[0]).subs({slope: k, curvature: 0}) - spelled_out(linear))


def test_the_printed_nonlinear_law_takes_the_spring_for_five_thousand_times_what_it_is():
    slope, curvature = spring = column("slope curvature")
    law = nonlinear_law(plant=PLANT[:2, :], spring=spring, **(JOINT | {"external": Matrix([0, 0])}))
    right = spelled_out(law.control[0])
    wanted = curvature * (taud / slope) ** 2 + slope * ((right - tau) / b - tau / m)
    printed = b / slope * (wanted - curvature * (taud / slope) ** 2) + (b + m) / (b * m) * tau

    assert vanishes(printed - right - (b + m) / m * (1 / b - 1) * tau)
    still = {tau_ext: 0, tau_extd: 0}
    rises = spelled_out(rate(law.energy, joint_flow(printed, slope, curvature)) - law.rate).subs(still)
    z4 = spelled_out(law.errors[1][0])
    assert vanishes(rises - C_s * z4 * slope / b * (b + m) / m * (1 / b - 1) * tau)


def feedback(weights=WEIGHTS):
    """The impedance law's slopes, from the law itself."""
    law = spelled_out(impedance_law(plant=PLANT, **(JOINT | {"weights": weights})).control[0])
    return Matrix([-law.diff(x) for x in STATE]), Matrix([law.diff(x) for x in EXTERNAL])


def test_the_state_feedback_is_the_law_differentiated():
    K, h = feedback()
    closed = backstepping_state_gains(None, PLANT, GAINS, WEIGHTS)

    assert all(map(vanishes, K - closed.K))
    assert all(map(vanishes, h - closed.h))


def test_the_printed_expansion_has_two_slips_in_the_third_gain_and_none_elsewhere():
    K, _ = feedback(Matrix([1, 1]))
    printed = b / k * Matrix([
        K_4 * K_3 * K_p + K_p,
        K_3 * K_p + K_4 * (K_3 * K_d + K_p + 1) + K_d,
        k * (m + b) / (m * b) + K_4 * (K_3 + K_d / m) + (K_3 * K_d + K_p) / m + 1,
        K_4 + K_d / m + K_3,
    ])  # fmt: skip

    slips = b / k * (2 * k * (m + b) / (m * b) - 1 / m)
    assert all(map(vanishes, printed - K - Matrix([0, 0, slips, 0])))


def test_a_fed_outer_torque_gives_the_static_stiffness_and_an_unfed_one_another():
    K, h = feedback(Matrix([1, 1]))
    held = Matrix([q, 0, tau, 0])
    for fed, stiffness in (
        (1, K_p),
        (0, K_p * m * (1 + K_3 * K_4) / (m * (1 + K_3 * K_4) + 1 + K_p + K_d * (K_3 + K_4) - k)),
    ):
        motor = (-K.T * held)[0] + fed * h[0] * tau_ext
        at_rest = [tau + tau_ext, motor - tau]
        found = sympy.solve(at_rest, [q, tau], dict=True)[0]
        assert vanishes(tau_ext / found[q] - stiffness)
