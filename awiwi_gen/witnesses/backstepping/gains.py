"""The gains of chapter 16 by differentiating the law, by polynomial division, and by mean and distance of roots."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.backstepping.laws import backstepping_impedance


def backstepping_state_gains(part: object, plant: SX, gains: SX, weights: SX) -> tuple[SX, SX, SX]:
    """Feedback gains of the impedance law: its derivatives by the state."""
    state, external = ca.SX.sym("state", 4), ca.SX.sym("external", 2)
    torque, _guards = backstepping_impedance(part, state, SX(5, 1), external, plant, gains, weights)
    cancelled = torque - (1 + plant[1] / plant[0]) * state[2]
    return -ca.jacobian(torque, state), -ca.jacobian(cancelled, state), ca.jacobian(torque, external)


def backstepping_state_gains_derivatives(part: object, plant: SX, gains: SX, weights: SX) -> SX:
    """Partial derivatives (4 x 4) of the feedback gains for a cancelled spring by (K_p, K_d, K_3, K_4)."""
    return ca.jacobian(backstepping_state_gains(part, plant, gains, weights)[1].T, gains)


def optimal_backstepping_rates(_: object, K_opt: SX, plant: SX, impedance: SX, weights: SX) -> tuple[SX, list[SX]]:
    """K_3 and K_4 from their mean and half their distance."""
    c3, c4 = plant[2] * K_opt[2] / plant[1], plant[2] * K_opt[3] / plant[1]
    fast_link = ca.vertcat(impedance[0] + 1 / weights[0], impedance[1]) / plant[0]
    mean = (c4 - fast_link[1]) / 2
    product = c3 - fast_link[0] - weights[0] / weights[1] - 2 * mean * fast_link[1]
    spread = (mean + ca.sqrt(product)) * (mean - ca.sqrt(product))
    given = ca.vertsplit(ca.vertcat(plant, impedance, weights))
    return ca.vertcat(mean + ca.sqrt(spread), mean - ca.sqrt(spread)), [*given, spread, 2 * mean, product]


def optimal_backstepping_weights(_: object, K_opt: SX, plant: SX, impedance: SX) -> tuple[SX, SX, list[SX]]:
    """K_3, K_4, C_t and C_s from the quotient and the remainder of the closed loop's polynomial by the link's."""
    m = plant[0]
    c = plant[2] / plant[1] * K_opt
    dividend, divisor = ca.vertcat(c[:2], m * c[2:], m), ca.vertcat(impedance, m)
    quotient = SX(3, 1)
    for power in (2, 1, 0):
        quotient[power] = dividend[power + 2] / divisor[2]
        dividend[power : power + 3] -= quotient[power] * divisor
    # s (s + K_4) / C_t has the quotient 1 / (m C_t) and the remainder (K_4 - K_d / m) s / C_t - K_p / (m C_t)
    inverse = -m * dividend[0] / impedance[0]
    slow = dividend[1] / inverse + impedance[1] / m
    fast = quotient[1] - slow
    ratio = quotient[0] - inverse / m - fast * slow
    given = ca.vertsplit(ca.vertcat(plant, impedance))
    return ca.vertcat(fast, slow), ca.vertcat(1, 1 / ratio) / inverse, [*given, inverse, fast, slow, ratio]
