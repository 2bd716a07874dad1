"""Joints that follow others: the couplings of a hand file from those of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from awiwi_gen.interchange.model import Loss, Mimic

MOST_POWERS = 3  # from the second power to the fourth


@dataclass(frozen=True)
class Followed(Mimic):
    """How a joint follows another one, by their names in the hand file, and the published name of the follower."""

    published: str = ""


def followed(
    mimics: Iterable[Mimic], owner: Mapping[str, str], names: Mapping[str, str]
) -> tuple[list[Followed], list[Loss]]:
    """The couplings of joints within their finger, each to an independent leader; and those that are lost."""
    direct: dict[str, Mimic] = {}
    lost = []
    for mimic in mimics:
        together = mimic.follower in owner and owner[mimic.follower] == owner.get(mimic.leader)
        if not together or not mimic.curve.deriv().coef.any() or mimic.follower in direct or _loops(mimic, direct):
            lost.append(f"{mimic.follower} to {mimic.leader}")
        else:
            direct[mimic.follower] = mimic
    found, steep = [], []
    for name, mimic in direct.items():
        curve, leader = mimic.curve, mimic.leader
        while leader in direct:
            curve, leader = curve(direct[leader].curve), direct[leader].leader
        follows = Followed.of(names[name], names[leader], curve)
        if len(follows.powers) > MOST_POWERS:
            steep.append(f"{name} to {leader}")
        else:
            found.append(replace(follows, published=name))
    losses = [
        Loss("couplings of joints that are in two fingers, in none, or in a loop", tuple(lost)),
        Loss("couplings of joints over others by more than the fourth power", tuple(steep)),
    ]
    return found, [loss for loss in losses if loss.places]


def _loops(mimic: Mimic, direct: Mapping[str, Mimic]) -> bool:
    leader = mimic.leader
    while leader in direct:
        leader = direct[leader].leader
    return leader == mimic.follower
