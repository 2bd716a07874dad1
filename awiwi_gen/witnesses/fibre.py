"""A tendon's fibre from its elastic energy, and the friction in its guidings as that of two halves in series."""

from typing import Any

import casadi as ca
from casadi import SX


def stretch(fibre: Any, f: SX) -> SX:
    """Elongation [m] of the fibre under the force f [N]: gradient of its complementary energy."""
    return ca.gradient(_complementary(fibre, f), f)


def stiffness(fibre: Any, k: SX) -> SX:
    """Stiffness [N/m] of fibre and mechanism in series: inverse curvature of their complementary energy."""
    force = SX.sym("force")
    return 1 / ca.hessian(_complementary(fibre, force) + force**2 / (2 * k), force)[0]


def friction(fibre: Any, f: SX, bend: SX) -> SX:
    """Force [N] lost by friction in guidings that bend a tendon under f [N] by the total angle `bend` [rad] (eq. 4.1)."""
    half = ca.exp(bend * (SX(fibre.guiding) / -2))
    return f * (1 - half) + f * half * (1 - half)


def _complementary(fibre: Any, f: SX) -> SX:
    return f**2 * (SX(fibre.length) / (2 * SX(fibre.modulus) * SX(fibre.section)))
