"""Joints that follow others: the couplings of a hand file from those of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from awiwi_gen.interchange.model import Loss, Mimic


@dataclass(frozen=True)
class Followed:
    """A follower by its published name and both names in the hand file: its angle is ratio * leader + offset [rad]."""

    published: str
    follower: str
    leader: str
    ratio: float
    offset: float


def followed(
    mimics: Iterable[Mimic], owner: Mapping[str, str], names: Mapping[str, str]
) -> tuple[list[Followed], list[Loss]]:
    """The couplings of joints within their finger, each to an independent leader; and those that are lost."""
    direct: dict[str, Mimic] = {}
    lost = []
    for mimic in mimics:
        together = mimic.follower in owner and owner[mimic.follower] == owner.get(mimic.leader)
        if not together or not mimic.ratio or mimic.follower in direct or _loops(mimic, direct):
            lost.append(f"{mimic.follower} to {mimic.leader}")
        else:
            direct[mimic.follower] = mimic
    found = []
    for name, mimic in direct.items():
        ratio, offset, leader = mimic.ratio, mimic.offset, mimic.leader
        while leader in direct:
            further = direct[leader]
            ratio, offset, leader = ratio * further.ratio, offset + ratio * further.offset, further.leader
        found.append(Followed(name, names[name], names[leader], ratio, offset))
    what = "couplings of joints that are in two fingers, in none, or in a loop"
    return found, [Loss(what, tuple(lost))] if lost else []


def _loops(mimic: Mimic, direct: Mapping[str, Mimic]) -> bool:
    leader = mimic.leader
    while leader in direct:
        leader = direct[leader].leader
    return leader == mimic.follower
