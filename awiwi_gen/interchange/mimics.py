"""Joints that follow others: the couplings of a hand file from those of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from awiwi_gen.interchange.model import Loss, Mimic

MOST_POWERS = 3  # from the second power to the fourth


@dataclass(frozen=True)
class Followed:
    """A follower by its published name, and how it follows by both names in the hand file."""

    published: str
    mimic: Mimic

    @property
    def follower(self) -> str:
        """Its name in the hand file."""
        return self.mimic.follower

    @property
    def leader(self) -> str:
        """The name of the joint that it follows, in the hand file."""
        return self.mimic.leader


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
        follows = Mimic.of(names[name], names[leader], curve)
        if len(follows.powers) > MOST_POWERS:
            steep.append(f"{name} to {leader}")
        else:
            found.append(Followed(name, follows))
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
