"""Tendon lengths of a finger from its motors, its springs and the wrist (eq. 5.1).

The path in the finger, the path in the wrist and the motor's pulley share a tendon of length l0; the rest is its
elongation, h + w + r theta - l0. Solved for h, this is the input of `joint_estimate`.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.units import m, rad

of_driven: Family[int] = Family("joint_estimate")  # sized by the number of tendons


def measured_kernels(hand: Hand) -> list[Kernel]:
    """The kernels of every finger with its motors: each is that of a hand with this finger only."""
    alone = {name: hand.model_copy(update={"fingers": {name: hand.fingers[name]}}) for name in hand.fingers}
    return [
        kernel
        for name, single in alone.items()
        if hand.motor
        for kernel in of_driven.kernels(name, single, "", single.structure(), measured_ports(single), single.tendons)
    ]


def measured_ports(hand: Hand) -> dict[str, Port]:
    """Motor angles, elongations and path lengths in the wrist, with the ranges of this hand."""
    shape, limits = (hand.tendons,), hand.limits
    longest = float(limits.tendon_force) / float(limits.tendon_stiffness_low)
    both = [transmission.two_way for finger in hand.fingers.values() for transmission in finger.transmissions]
    ports = {"x": Port(shape, m, tuple(-longest * way for way in both) if any(both) else 0.0, longest)}
    if hand.motor:
        ports["theta"] = Port(shape, rad, -float(hand.motor.travel), float(hand.motor.travel))
    if hand.wrist:
        length = sum(float(x) ** 2 for x in hand.wrist.b) ** 0.5
        ports["w"] = Port(shape, m, -length, length)
    return ports


@of_driven(lambda tendons: {"h": Port((tendons,), m)}, "eq. 5.1")
def measured_lengths(hand: Any, theta: Any, x: Any, w: Any = None) -> Any:
    """Tendon lengths in the finger from motor angles theta, elongations x and changes w of the lengths in the wrist.

    All three are zero at the straight finger; a four-bar that does not close there stands at the end of its range that
    is nearest. A positive theta winds the tendon up.
    """
