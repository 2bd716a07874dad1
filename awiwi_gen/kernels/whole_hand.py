"""The tendons of the whole hand: 38 of them and 19 joints in the Awiwi hand, in the order of its fingers.

`Hand.blocks` has the rows (tendons) and columns (joints) of each finger. Outside these blocks the coupling and the
stiffness are constant zeros, since a finger's tendons do not depend on the joints of other fingers. The wrist changes
tendon lengths only; its coupling has two columns of its own, in `wrist_coupling`.

Where a motor pulls tendons of several fingers, `motor_*` have one element for each motor instead of each tendon;
`Hand.motors` tells which tendons each pulls.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.fingers import input_ports
from awiwi_gen.kernels.joints import with_slides
from awiwi_gen.kernels.routing import wraps_hold
from awiwi_gen.kernels.sizes import Size, arms, stiffness, torque
from awiwi_gen.kernels.wrist import bars_close, wrist_ports
from awiwi_gen.units import m

of_hand: Family[Size] = Family("hand_tendons")
of_motors: Family[Size] = Family("hand_tendons")  # of hands whose motors pull tendons of several fingers


def hand_kernels(hand: Hand) -> list[Kernel]:
    """The kernels of all tendons together."""
    sizes = {name: Size.of(finger) for name, finger in hand.fingers.items()}
    fingers = [input_ports(hand, finger, sizes[name]) for name, finger in hand.fingers.items()]
    ports = {name: joined([of_finger[name] for of_finger in fingers]) for name in ("q", "f", "k")}
    if hand.wrist:
        ports["wrist"] = joined([*wrist_ports(hand.wrist).values()])
    sliding = tuple(slides for size in sizes.values() for slides in size.sliding)
    whole = Size(sliding, ports["f"].size, sum(size.links for size in sizes.values()))
    joints = [(joint, finger) for finger in hand.fingers.values() for joint in finger.joints]
    slides = [f"{index} ({joint})" for index, (joint, finger) in enumerate(joints) if joint in finger.sliding]
    made = of_hand.kernels("hand", hand, "", hand.structure(), ports, whole)
    if hand.across:
        motors = Size(sliding, len(hand.motors), whole.links)
        first = [tendons[0] for tendons in hand.motors]
        ports |= {f"{name}_motor": ports[name].subset(first) for name in ("f", "k")}
        made += of_motors.kernels("hand", hand, "", hand.structure(), ports, motors)
    kernels = with_slides(made, slides)
    wraps = tuple(each for name, finger in hand.fingers.items() for each in wraps_hold(finger, f"{name}."))
    return [
        replace(kernel, guards=(bars_close(hand.wrist) if hand.wrist and "wrist" in kernel.inputs else ()) + wraps)
        for kernel in kernels
    ]


def joined(ports: list[Port]) -> Port:
    """Several ports joined into one vector."""
    bounds = [bound for port in ports for bound in port.bounds()]
    low, high = tuple(low for low, _ in bounds), tuple(high for _, high in bounds)
    return Port((len(bounds),), tuple(unit for port in ports for unit in port.units), low, high)


@of_hand(
    lambda z: {"h": Port((z.tendons,), m)},
    "eq. 5.1, 5.5, 6.9",
)
def tendon_lengths(hand: Any, q: Any, wrist: Any = None) -> Any:
    """Path length of every tendon in its finger and in the wrist, at its internal angles wrist = (q71, q73)."""


@of_hand(lambda z: {"P": arms(z)}, "eq. 5.6, 5.9, 5.21")
def coupling(hand: Any, q: Any) -> Any:
    """Coupling matrix P = dh/dq of all tendons and joints; zero outside the blocks of the fingers."""


@of_hand(lambda z: {"tau": torque(z)}, "eq. 5.8")
def joint_torque(hand: Any, q: Any, f: Any) -> Any:
    """Joint torques -P' f of the tendon forces f."""


@of_hand(
    lambda z: {"K": stiffness(z)},
    "eq. 5.12, 5.23",
)
def joint_stiffness(hand: Any, q: Any, f: Any, k: Any) -> Any:
    """Joint stiffness -d tau/dq of tendons with the stiffnesses k and the forces f; zero outside the blocks."""


@of_motors(lambda z: {"h": Port((z.tendons,), m)}, "eq. 5.1, 5.5, 6.9, summed over a motor's tendons")
def motor_lengths(hand: Any, q: Any) -> Any:
    """Path length in the fingers of all that each motor pulls."""


@of_motors(lambda z: {"P": arms(z)}, "eq. 5.6, 5.9, 5.21, summed over a motor's tendons")
def motor_coupling(hand: Any, q: Any) -> Any:
    """Coupling matrix P = dh/dq of all motors and joints."""


@of_motors(lambda z: {"tau": torque(z)}, "eq. 5.8, by the motors' forces")
def motor_joint_torque(hand: Any, q: Any, f_motor: Any) -> Any:
    """Joint torques -P' f of the motors' forces f_motor."""


@of_motors(lambda z: {"K": stiffness(z)}, "eq. 5.12, 5.23, by the motors' forces")
def motor_joint_stiffness(hand: Any, q: Any, f_motor: Any, k_motor: Any) -> Any:
    """Joint stiffness -d tau/dq of motors with the stiffnesses k_motor and the forces f_motor.

    Fingers of one motor are coupled: it pulls less at one as another gives way.
    """
