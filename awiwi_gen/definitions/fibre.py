"""A tendon's fibre and the friction in its guidings (sections 4.1, 4.2).

A `fibre` is the hand file's `Fibre` or its symbolic copy.
"""

from typing import Any

import sympy
from sympy import Expr, Matrix


def stretch(fibre: Any, f: Matrix) -> Expr:
    """Elongation [m] of the fibre under the force f [N]: strain f / (E S) over its whole length."""
    return f[0] / (fibre.modulus * fibre.section) * fibre.length


def stiffness(fibre: Any, k: Matrix) -> Expr:
    """Stiffness [N/m] of fibre and mechanism in series: their elongations add (section 4.3)."""
    return 1 / (1 / k[0] + fibre.length / (fibre.modulus * fibre.section))


def friction(fibre: Any, f: Matrix, bend: Matrix) -> Expr:
    """Force [N] lost by friction in guidings that bend a tendon under the force f [N] by the total angle `bend` [rad].

    Each bend d alpha takes mu f d alpha, so the loss is proportional to f, which eq. 4.1 prints as a constant C0.
    """
    return f[0] * (1 - sympy.exp(-fibre.guiding * bend[0]))
