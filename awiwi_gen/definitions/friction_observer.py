"""A motor's friction from its velocity (chapter 9): the observer that needs no acceleration.

The motor obeys B theta'' = u - tau - friction. The estimate follows by d estimate/dt = L (friction - estimate); as
printed, eq. 9.2 lacks the hat on theta'' and does not. With the momentum z that the motor would have by the estimate,

    dz/dt = u - tau - estimate        estimate = L (z - B theta')

the acceleration drops out. The implicit step over a sample T has estimate and momentum at the end of the sample:

    z+ = z + T (u - tau - estimate+)        estimate+ = L (z+ - B theta'+)

The estimate is a low-pass of the average friction, with the pole 1/(1 + L T): stable for any L and T.
"""

from __future__ import annotations

from typing import Any

from sympy import Matrix


def friction_observer(
    _: Any, momentum: Matrix, u: Matrix, tau: Matrix, thd: Matrix, B: Matrix, gain: Matrix, period: Matrix
) -> Any:
    """Momentum z+ [N m s] and friction [N m] at the end of a sample, and the guards."""
    free = momentum[0] + period[0] * (u[0] - tau[0])
    friction = gain[0] * (free - B[0] * thd[0]) / (1 + gain[0] * period[0])
    return free - period[0] * friction, friction, [B[0], gain[0], period[0]]
