"""The kernels of a tendon's fibre and of its guidings."""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Fibre, Hand
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.units import N, m, rad

of_fibre: Family[None] = Family("fibre")
of_guidings: Family[None] = Family("fibre")


def fibre_kernels(hand: Hand, fibre: Fibre) -> list[Kernel]:
    """All kernels of the fibre and its guidings."""
    ports = fibre_ports(hand, fibre)
    return [
        *of_fibre.kernels("tendon", fibre, "tendon", {"fibre": "whole"}, ports, None),
        *of_guidings.kernels("guiding", fibre, "tendon", {"fibre": "guidings"}, ports, None),
    ]


def fibre_ports(hand: Hand, fibre: Fibre) -> dict[str, Port]:
    """The input ports by argument name, with the ranges of this hand."""
    limits = hand.limits
    return {
        "f": Port((), N, 0.0, float(limits.tendon_force)),
        "k": Port((), N / m, float(limits.tendon_stiffness_low), float(limits.tendon_stiffness_high)),
        "bend": Port((), rad, 0.0, float(fibre.bend)),
    }


@of_fibre(lambda _: {"x": Port((), m)}, "section 5.1")
def stretch(fibre: Any, f: Any) -> Any:
    """Elongation of the fibre under the force f."""


@of_fibre(lambda _: {"stiffness": Port((), N / m)}, "section 4.3")
def stiffness(fibre: Any, k: Any) -> Any:
    """Stiffness of a whole tendon: the fibre in series with a spring mechanism of stiffness k."""


@of_guidings(lambda _: {"loss": Port((), N)}, "eq. 4.1")
def friction(fibre: Any, f: Any, bend: Any) -> Any:
    """Friction loss in the guidings of a tendon under the force f that they bend by the total angle bend."""
