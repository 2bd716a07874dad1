"""The impedance law as a state feedback, and the gains of the law for given feedback gains (chapter 16).

With the errors of torque and torque rate eliminated, the link obeys under the law

    (m s^2 + K_d s + K_p) (s^2 + sigma s + pi) + s (s + K_4) / C_t = m s^4 + c4 m s^3 + c3 m s^2 + c2 s + c1
    sigma = K_3 + K_4            pi = K_3 K_4 + C_t / C_s

and tau'' = -c1 q - c2 q' - c3 tau - c4 tau'. So the feedback gains are K = (b / k) (c1, c2, c3, c4) for a plant whose
spring's torque is cancelled, tau'' = (k / b) u, as in table 16.1; without this cancellation the
third is less by (m + b) / m. Equation 16.3 prints a wrong constant there.
"""

from typing import NamedTuple

from sympy import Expr, Matrix, sqrt

from awiwi_gen.definitions.naming import Derivation, jacobian


class Feedback(NamedTuple):
    """tau_m = -K (q, q', tau, tau') + h (tau_ext, tau_ext'); ``linearised`` is K where the spring is cancelled."""

    K: Matrix
    linearised: Matrix
    h: Matrix


def backstepping_state_gains(_: object, plant: Matrix, gains: Matrix, weights: Matrix) -> Feedback:
    """Feedback gains of the impedance law (eq. 15.70 and 16.3, mended)."""
    m, b, k = plant
    stiffness, damping, fast, slow = gains
    names = Derivation()
    total, product = names.name(fast + slow), names.name(fast * slow + weights[0] / weights[1])
    from_link = names.name((damping * total + stiffness + 1 / weights[0]) / m)
    coefficients = Matrix(
        [
            stiffness * product,
            damping * product + stiffness * total + slow / weights[0],
            product + from_link,
            total + damping / m,
        ]
    )
    linearised = names.name_all(b / k * coefficients)
    return Feedback(
        linearised - Matrix([0, 0, (m + b) / m, 0]),
        linearised,
        Matrix([b / m - b / k * from_link, -b * damping / (k * m)]),
    )


def backstepping_state_gains_derivatives(_: object, plant: Matrix, gains: Matrix, weights: Matrix) -> Matrix:
    """Partial derivatives (4 x 4) of the feedback gains for a cancelled spring by (K_p, K_d, K_3, K_4)."""
    return jacobian(backstepping_state_gains(_, plant, gains, weights).linearised, gains)


def optimal_backstepping_rates(
    _: object, K_opt: Matrix, plant: Matrix, impedance: Matrix, weights: Matrix
) -> tuple[Matrix, list[Expr]]:
    """K_3 and K_4 for which the law has the desired gains of tau and tau', for given K_p and K_d; and the guards.

    They are the roots of r^2 - sigma r + (pi - C_t / C_s). Guards are the plant, impedance and weights, the square of
    half the roots' difference, their sum and their product.
    """
    m, b, k = plant
    stiffness, damping = impedance
    names = Derivation()
    total = names.name(k / b * K_opt[3] - damping / m)
    product = names.name(
        k / b * K_opt[2] - weights[0] / weights[1] - (damping * total + stiffness + 1 / weights[0]) / m
    )
    spread = names.name(total**2 / 4 - product)
    larger = names.name(total / 2 + sqrt(spread))
    return Matrix([larger, product / larger]), [*plant, *impedance, *weights, spread, total, product]


def optimal_backstepping_weights(
    _: object, K_opt: Matrix, plant: Matrix, impedance: Matrix
) -> tuple[Matrix, Matrix, list[Expr]]:
    """K_3, K_4 and the weights C_t, C_s for which the law has all four desired gains, for given K_p and K_d; guards.

    Each follows from those before it, coefficient by coefficient, without roots. Guards are the plant, the impedance,
    1 / C_t, K_3, K_4 and C_t / C_s.
    """
    m, b, k = plant
    stiffness, damping = impedance
    names = Derivation()
    c1, c2, c3, c4 = names.name_all(k / b * K_opt)
    total, product = names.name(c4 - damping / m), names.name(c1 / stiffness)
    inverse = names.name(m * (c3 - product) - damping * total - stiffness)
    slow = names.name((c2 - damping * product - stiffness * total) / inverse)
    fast = names.name(total - slow)
    ratio = names.name(product - fast * slow)
    weight = names.name(1 / inverse)
    return Matrix([fast, slow]), Matrix([weight, weight / ratio]), [*plant, *impedance, inverse, fast, slow, ratio]
