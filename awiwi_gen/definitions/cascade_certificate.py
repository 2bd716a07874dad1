"""A certificate that a gain set of the cascade is stable (section 11.5, mended).

The joints have the damping D, each tendon has a force loop e'' + kd e' + kp e = 0, and the force errors act on the
joints. With xi = (e, e') and A' S + S A = -Q for each loop, the energy

    V = qd' M qd / 2 + q' K q / 2 + sum xi' S xi        falls by  w' W w,  w = (qd, e, e')

where W = [D, P'/2, 0; P/2, Q11, 0; 0, 0, Q22]. The printed V has no S, and its W (eq. 11.21) has -G in a place where it
must be positive, so it is never positive definite. Here Q = weight diag(1, 1/omega^2), so V falls where
D - P' P / (4 weight) is positive definite. S is positive definite if kp and kd are positive. With positive gains, a
large enough weight always gives a proof.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.symmetric_matrix import factors, least, symmetric


def cascade_certificate(
    _: Any, D: Matrix, P: Matrix, kp: Matrix, kd: Matrix, weight: Matrix, omega: Matrix
) -> tuple[Expr, Matrix, list[Expr]]:
    """Margin, and S11, S12 and S22 of every force loop (m x 3), and the guards; D and P row by row."""
    derivation, n = Derivation(), int(sympy.sqrt(len(D)))
    damping, coupling = symmetric(D, n), Matrix(len(kp), n, list(P))
    loss = (coupling.T * coupling).applyfunc(lambda entry: derivation.name(entry / (4 * weight[0])))
    _lower, pivots = factors(derivation.name_all(damping - loss), derivation)
    mean = derivation.name(sympy.Abs(damping.trace()) / n)  # a positive scale
    spring = [derivation.name(gain / omega[0] ** 2) for gain in kp]
    shares = [pivot / mean for pivot in pivots] + spring + [gain / omega[0] for gain in kd]
    energy = Matrix([_energy(p, v, weight[0], omega[0]) for p, v in zip(kp, kd, strict=True)])
    return least(shares, derivation), energy, [weight[0], omega[0]]


def _energy(kp: Expr, kd: Expr, weight: Expr, omega: Expr) -> list[Expr]:
    """S of the Lyapunov equation for e'' + kd e' + kp e = 0 and Q = weight diag(1, 1/omega^2), solved by hand."""
    s12 = weight / (2 * kp)
    s22 = (2 * s12 + weight / omega**2) / (2 * kd)
    return [kp * s22 + kd * s12, s12, s22]
