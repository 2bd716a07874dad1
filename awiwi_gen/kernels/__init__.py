"""The public C interface and nothing else: which kernels a hand has."""

from __future__ import annotations

from awiwi_gen.hand import Hand
from awiwi_gen.kernel import Kernel
from awiwi_gen.kernels.actuation import actuation_kernels
from awiwi_gen.kernels.fingers import finger_kernels


def catalog(hand: Hand) -> list[Kernel]:
    """All kernels of a hand, in the order of its parts."""
    fingers = [kernel for name, finger in hand.fingers.items() for kernel in finger_kernels(hand, name, finger)]
    return fingers + actuation_kernels(hand)
