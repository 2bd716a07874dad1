"""The kernels of four-bar linkages, one set per link that is mounted on a coupler, as the fifth metacarpal is."""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Finger, Link
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.units import one, rad

of_four_bar: Family[None] = Family("four_bar")


def four_bar_kernels(name: str, finger: Finger) -> list[Kernel]:
    """The kernels of all four-bars of a finger."""
    return [
        kernel
        for index, link in enumerate(finger.links)
        if link.four_bar
        for kernel in of_four_bar.kernels(
            f"{name}_{link.joint}",
            link.four_bar,
            f"fingers.{name}.links[{index}].four_bar",
            {"branch": link.four_bar.branch},
            {"q": joint_port(link)},
            None,
        )
    ]


def joint_port(link: Link) -> Port:
    """The angle of the joint that drives the crank."""
    return Port((), rad, float(link.low or 0), float(link.high or 0))


@of_four_bar(
    lambda _: {
        "coupler": Port((), rad),
        "rocker": Port((), rad),
        "coupler_ratio": Port((), rad / rad),
        "rocker_ratio": Port((), rad / rad),
        "transmission": Port((), one),
    },
    "section 5.5",
    guards=("the loop closes",),
)
def four_bar(bar: Any, q: Any) -> Any:
    """Angles of coupler and rocker at a joint angle, and their derivatives by it, the ratios.

    The transmission is the sine of the angle between coupler and rocker; at zero the linkage locks.
    """
