"""The controller's stiffness by inverting compliances, which add in series (eq. 8.1)."""

from __future__ import annotations

from math import isqrt
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.symmetric_matrix import pivots, symmetric


def stiffness_correction(_: Any, K_eff: SX, K_mech: SX) -> Any:
    """K_imp (n x n) [N m/rad] from the difference of the compliances, and the quotients of minors."""
    n = isqrt(K_eff.numel())
    wanted, tendons = symmetric(K_eff, n), symmetric(K_mech, n)
    compliance = ca.inv_minor(wanted) - ca.inv_minor(tendons)
    return ca.inv_minor(compliance), [*pivots(wanted), *pivots(tendons - wanted)]


def stiffness_correction_scalar(_: Any, k_eff: SX, k_mech: SX) -> Any:
    """k_imp [N m/rad] of one joint, its derivative by k_mech, and the guards."""
    k_imp = 1 / (1 / k_eff - 1 / k_mech)
    return k_imp, ca.gradient(k_imp, k_mech), [k_eff, k_mech - k_eff]
