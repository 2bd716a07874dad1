"""The public C interface: the kernels of a hand."""

from __future__ import annotations

from functools import lru_cache

from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out
from awiwi_gen.kernel import Kernel
from awiwi_gen.kernels.base_estimate import base_kernels
from awiwi_gen.kernels.control_antagonistic import antagonistic_laws
from awiwi_gen.kernels.control_backstepping import backstepping_laws
from awiwi_gen.kernels.control_joint import joint_laws
from awiwi_gen.kernels.control_linear import linear_laws
from awiwi_gen.kernels.control_optimal import optimal_laws
from awiwi_gen.kernels.fibres import fibre_kernels
from awiwi_gen.kernels.fingers import finger_kernels
from awiwi_gen.kernels.fingers_control import elastic_kernels, search_kernels
from awiwi_gen.kernels.four_bars import four_bar_kernels
from awiwi_gen.kernels.joints import documented, optional_kernels
from awiwi_gen.kernels.measured import measured_kernels
from awiwi_gen.kernels.motors import motor_kernels
from awiwi_gen.kernels.palm import palm_kernels
from awiwi_gen.kernels.plants import plant_kernels
from awiwi_gen.kernels.springs import spring_kernels
from awiwi_gen.kernels.whole_hand import hand_kernels
from awiwi_gen.kernels.wrist import wrist_kernels


def catalog(hand: Hand) -> list[Kernel]:
    """All kernels that a hand can have, in the order of its parts."""
    return [*_catalog(hand)]


@lru_cache(maxsize=4)  # a command asks for the hand in its file, for the kernels of its tick, for those of its gains
def _catalog(hand: Hand) -> tuple[Kernel, ...]:
    impossible = left_out(hand)
    return tuple(kernel for kernel in declared(hand) if (kernel.path, kernel.family) not in impossible)


def declared(hand: Hand) -> list[Kernel]:
    """All kernels of a hand, with those that its tendons make impossible (`hand.capability`)."""
    fingers = [
        kernel
        for name, finger in hand.fingers.items()
        for kernel in [
            *elastic_kernels(hand, name, finger),
            *documented(
                finger,
                [
                    *finger_kernels(hand, name, finger),
                    *search_kernels(hand, name, finger),
                    *optional_kernels(hand, name, finger),
                ],
            ),
            *base_kernels(hand, name, finger),
            *four_bar_kernels(name, finger),
        ]
    ]
    wrist = wrist_kernels(hand.wrist) if hand.wrist else []
    palm = palm_kernels(hand, hand.palm) if hand.palm else []
    actuators = [
        *(motor_kernels(hand, hand.motor) if hand.motor else []),
        *(spring_kernels(hand, hand.spring) if hand.spring else []),
        *(fibre_kernels(hand, hand.tendon) if hand.tendon else []),
    ]
    laws = [*joint_laws(hand), *linear_laws(), *backstepping_laws(), *optimal_laws(), *antagonistic_laws()]
    return fingers + wrist + palm + hand_kernels(hand) + measured_kernels(hand) + actuators + laws + plant_kernels()
