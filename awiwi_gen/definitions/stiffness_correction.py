"""The controller's stiffness that makes a joint feel as stiff as desired (chapter 8).

The controller acts through the tendons, so their compliances add: K_eff^-1 = K_imp^-1 + K_mech^-1 (eq. 8.1). Then

    K_imp = K_eff + K_eff (K_mech - K_eff)^-1 K_eff

is positive definite where K_eff and K_mech - K_eff are. Section 8.2 asks only for K_eff to be so, which is not enough: a
controller of -3 behind tendons of 1 gives 1.5, and is unstable. Where K_mech equals K_eff, K_imp is infinite.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Matrix

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.symmetric_matrix import factors, solve_lower, symmetric


def stiffness_correction(_: Any, K_eff: Matrix, K_mech: Matrix) -> Any:
    """K_imp (n x n) [N m/rad], and the pivots of K_eff and K_mech - K_eff; both matrices row by row."""
    derivation, n = Derivation(), sympy.sqrt(len(K_eff))
    wanted, tendons = symmetric(K_eff, n), symmetric(K_mech, n)
    _lower, wanted_pivots = factors(wanted, derivation)
    lower, pivots = factors(derivation.name_all(tendons - wanted), derivation)
    half = solve_lower(lower, wanted, derivation)
    added = half.T * sympy.diag(*(derivation.name(1 / pivot) for pivot in pivots)) * half
    return wanted + added, [*wanted_pivots, *pivots]


def stiffness_correction_scalar(_: Any, k_eff: Matrix, k_mech: Matrix) -> Any:
    """k_imp [N m/rad] of one joint, its derivative by k_mech, and the guards."""
    share = k_eff[0] / (k_mech[0] - k_eff[0])
    return share * k_mech[0], -(share**2), [k_eff[0], k_mech[0] - k_eff[0]]
