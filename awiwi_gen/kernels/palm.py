"""The kernels of a palm on joints in series: its pose in the forearm, its Jacobian, and gravity in its axes."""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.hand.palm import Palm
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.sizes import POSE
from awiwi_gen.units import m, rad, s

of_palm: Family[int] = Family("forearm")  # sized by the number of joints


def palm_kernels(hand: Hand, palm: Palm) -> list[Kernel]:
    """All kernels of the palm."""
    limit = float(hand.limits.gravity)
    ports = {
        "q": Port((len(palm.joints),), rad, *palm.range),
        "g_forearm": Port((3,), m / s**2, -limit, limit),
    }
    return of_palm.kernels("palm", palm, "palm", palm.structure(), ports, len(palm.joints))


@of_palm(lambda _: {"T": Port((4, 4), POSE)}, "eq. 5.2")
def pose(palm: Any, q: Any) -> Any:
    """Pose of the palm: maps palm coordinates into the forearm's frame. q are the angles of the wrist's joints."""


@of_palm(lambda n: {"J": Port((6, n), (m / rad,) * (3 * n) + (rad / rad,) * (3 * n))}, "eq. 5.2, differentiated")
def jacobian(palm: Any, q: Any) -> Any:
    """Velocity and angular velocity of the palm's frame per unit velocity of each wrist joint, in forearm axes."""


@of_palm(lambda _: {"g": Port((3,), m / s**2)}, "eq. 5.2")
def gravity(palm: Any, q: Any, g_forearm: Any) -> Any:
    """Gravity in the palm's axes, from gravity in the forearm's: the input g_palm of the fingers' palm_gravity.

    So one sensor in the forearm serves all fingers.
    """
