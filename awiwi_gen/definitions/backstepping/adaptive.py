"""The antagonistic backstepping law for a joint with model errors.

It has the recursion of section 15.5 over all six states, and adds what a real joint needs: the link's damping d_q, which
must not count as an external torque; estimated slopes of the springs; and estimated torques that resist the motors,
which are cancelled. With e = q - q_d the link is to obey

    m e'' + (K_d + d_q) e' + K_p e = tau_ext

If the estimate of the resisting torques d is d^, the energy V of errors e_t and e_s has the rate

    V' = - (K_d + d_q) e'^2 - sum (C_t K_3 e_t^2 + C_s K_4 e_s^2) + e' tau_ext + sum C_s e_s (phi' / b) (d^ - d)
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from sympy import Expr, Matrix, diag

from awiwi_gen.definitions.backstepping.recursion import Law, Level, Start, Tuning, backstep
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.plants import SIDES


def adaptive_law(
    joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix, inertias: Matrix,
    springs: Matrix, damping: Expr, impedance: Matrix, tunings: Matrix,
) -> Law:  # fmt: skip
    """The law for motors without resistance.

    As `laws.antagonistic_law`, with the damping of the link added: torques (tau, tau'), springs (phi', phi'') and
    tunings (K_3, K_4, C_t, C_s) have a row for each motor.
    """
    m = inertias[0]
    torque, rate = torques[0::2, :], torques[1::2, :]
    pulls = Matrix([SIDES]) / m
    accelerated = (pulls * torque)[0] + (external[0] - damping * joint[1]) / m
    drifts, gains = [], []
    for i, side in enumerate(SIDES):
        slope, curvature = springs[2 * i : 2 * i + 2, :]
        drifts.append(curvature * (rate[i] / slope) ** 2 - slope * (torque[i] / inertias[i + 1] + side * accelerated))
        gains.append(slope / inertias[i + 1])
    chain = [
        Level(joint[:1, :], Matrix([0]), Matrix([1])),
        Level(joint[1:, :], Matrix([(external[0] - damping * joint[1]) / m]), pulls),
        Level(torque, Matrix([0, 0]), diag(1, 1)),
        Level(rate, Matrix(drifts), diag(*gains)),
    ]
    error, speed = joint - desired[:2, :]
    link_torque = m * desired[2] + damping * desired[1] - impedance[0] * error - impedance[1] * speed
    signals = {a: b for given in (desired, external, pretension) for a, b in pairwise(given)}
    start = Start(
        levels=2,
        target=Matrix([pretension[0] + side * link_torque / 2 for side in SIDES]),
        energy=(m * speed**2 + impedance[0] * error**2) / 2,
        rate=speed * external[0] - (impedance[1] + damping) * speed**2,
        signals=signals,
    )
    return backstep(chain, start, [Tuning(tunings[i::4, :], tunings[i + 2 :: 4, :]) for i in (0, 1)], Derivation())


def backstepping_adaptive(
    _: Any, joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix, inertias: Matrix,
    springs: Matrix, damping: Matrix, impedance: Matrix, tunings: Matrix, resistance: Matrix,
) -> tuple[Matrix, list[Expr]]:  # fmt: skip
    """Torques (2) [N m] of both motors, and the guards."""
    law = adaptive_law(joint, torques, desired, pretension, external, inertias, springs, damping[0], impedance, tunings)
    return law.control + resistance, [*inertias, springs[0], springs[2], *impedance, *tunings]
