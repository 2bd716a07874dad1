"""The kernels of the wrist: palm pose and tendon lengths from its two internal angles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from awiwi_gen.hand import Wrist
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.sizes import POSE
from awiwi_gen.structure import is_symmetric
from awiwi_gen.units import m, rad

BARS_CLOSE = (
    "q73 is between 0 and pi",
    "the plane of the side bars has not passed A0",
    "bar AA0 closes the loop",
)

of_wrist: Family[int] = Family("wrist")  # sized by the number of tendons


def wrist_kernels(wrist: Wrist) -> list[Kernel]:
    """All kernels of the wrist."""
    kernels = of_wrist.kernels("wrist", wrist, "wrist", wrist.structure(), wrist_ports(wrist), len(wrist.tendons))
    return [replace(kernel, guards=bars_close(wrist)) for kernel in kernels]


def bars_close(wrist: Wrist) -> tuple[str, ...]:
    """The conditions under which the bars have a pose."""
    return BARS_CLOSE if is_symmetric(wrist) else (*BARS_CLOSE, "bars BB0 and CC0 close the loop")


def wrist_ports(wrist: Wrist) -> dict[str, Port]:
    """The internal angles, with the ranges of this wrist."""
    return {name: Port((), rad, low, high) for name, low, high in zip(("q71", "q73"), *wrist.range, strict=True)}


@of_wrist(lambda _: {point: Port((3,), m) for point in "ABC"}, "eq. 6.1 to 6.8")
def points(wrist: Any, q71: Any, q73: Any) -> Any:
    """The palm's points A, B and C in frame {0} of the forearm."""


@of_wrist(lambda _: {"T": Port((4, 4), POSE)}, "fig. 6.8, eq. 6.9")
def palm_pose(wrist: Any, q71: Any, q73: Any) -> Any:
    """Pose of the palm: maps palm coordinates into frame {0} of the forearm."""


@of_wrist(lambda tendons: {"h": Port((tendons,), m)}, "eq. 6.9")
def tendon_lengths(wrist: Any, q71: Any, q73: Any) -> Any:
    """Length of every tendon's straight path through the wrist."""


@of_wrist(
    lambda tendons: {"dh": Port((tendons, 2), m / rad)},
    "eq. 6.9, differentiated",
)
def coupling(wrist: Any, q71: Any, q73: Any) -> Any:
    """Derivatives of the tendons' lengths in the wrist with respect to q71 and q73."""
