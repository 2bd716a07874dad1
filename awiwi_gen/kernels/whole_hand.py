"""The tendons of the whole hand: 38 of them and 19 joints in the Awiwi hand, in the order of its fingers.

`Hand.blocks` has the rows (tendons) and columns (joints) of each finger. Outside these blocks the coupling and the
stiffness are constant zeros, since a finger's tendons do not depend on the joints of other fingers. The wrist changes
tendon lengths only; its coupling has two columns of its own, in `wrist_coupling`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.fingers import Size, input_ports
from awiwi_gen.kernels.routing import wraps_hold
from awiwi_gen.kernels.wrist import BARS_CLOSE, wrist_ports
from awiwi_gen.units import N, m, rad

of_hand: Family[Size] = Family("hand_tendons")


def hand_kernels(hand: Hand) -> list[Kernel]:
    """The kernels of all tendons together."""
    sizes = {name: Size.of(finger) for name, finger in hand.fingers.items()}
    fingers = [input_ports(hand, finger, sizes[name]) for name, finger in hand.fingers.items()]
    ports = {name: joined([of_finger[name] for of_finger in fingers]) for name in ("q", "f", "k")}
    if hand.wrist:
        ports["wrist"] = joined([*wrist_ports(hand.wrist).values()])
    whole = Size(ports["q"].size, ports["f"].size, sum(size.links for size in sizes.values()))
    kernels = of_hand.kernels("hand", hand, "", hand.structure(), ports, whole)
    wraps = tuple(each for name, finger in hand.fingers.items() for each in wraps_hold(finger, f"{name}."))
    return [replace(kernel, guards=(kernel.guards if hand.wrist else ()) + wraps) for kernel in kernels]


def joined(ports: list[Port]) -> Port:
    """Several ports joined into one vector."""
    bounds = [bound for port in ports for bound in port.bounds()]
    low, high = tuple(low for low, _ in bounds), tuple(high for _, high in bounds)
    return Port((len(bounds),), tuple(unit for port in ports for unit in port.units), low, high)


@of_hand(
    lambda z: {"h": Port((z.tendons,), m)},
    "eq. 5.1, 5.5, 6.9",
    guards=BARS_CLOSE,
)
def tendon_lengths(hand: Any, q: Any, wrist: Any = None) -> Any:
    """Path length of every tendon in its finger and in the wrist, at its internal angles wrist = (q71, q73)."""


@of_hand(lambda z: {"P": Port((z.tendons, z.joints), m / rad)}, "eq. 5.6, 5.9, 5.21")
def coupling(hand: Any, q: Any) -> Any:
    """Coupling matrix P = dh/dq of all tendons and joints; zero outside the blocks of the fingers."""


@of_hand(lambda z: {"tau": Port((z.joints,), N * m)}, "eq. 5.8")
def joint_torque(hand: Any, q: Any, f: Any) -> Any:
    """Joint torques -P' f of the tendon forces f."""


@of_hand(
    lambda z: {"K": Port((z.joints, z.joints), N * m / rad)},
    "eq. 5.12, 5.23",
)
def joint_stiffness(hand: Any, q: Any, f: Any, k: Any) -> Any:
    """Joint stiffness -d tau/dq of tendons with the stiffnesses k and the forces f; zero outside the blocks."""
