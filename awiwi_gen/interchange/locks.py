"""Joints that follow others: the couplings of a hand file from those of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from awiwi_gen.interchange.model import Lock, Loss


@dataclass(frozen=True)
class Followed:
    """A follower by its published name and both names in the hand file: its angle is ratio * leader + offset [rad]."""

    published: str
    follower: str
    leader: str
    ratio: float
    offset: float


def followed(
    locks: Iterable[Lock], owner: Mapping[str, str], names: Mapping[str, str]
) -> tuple[list[Followed], list[Loss]]:
    """The couplings of joints within their finger, each to an independent leader; and those that are lost."""
    direct: dict[str, Lock] = {}
    lost = []
    for lock in locks:
        together = lock.follower in owner and owner[lock.follower] == owner.get(lock.leader)
        if not together or not lock.ratio or lock.follower in direct or _loops(lock, direct):
            lost.append(f"{lock.follower} to {lock.leader}")
        else:
            direct[lock.follower] = lock
    found = []
    for name, lock in direct.items():
        ratio, offset, leader = lock.ratio, lock.offset, lock.leader
        while leader in direct:
            further = direct[leader]
            ratio, offset, leader = ratio * further.ratio, offset + ratio * further.offset, further.leader
        found.append(Followed(name, names[name], names[leader], ratio, offset))
    what = "couplings of joints that are in two fingers, in none, or in a loop"
    return found, [Loss(what, tuple(lost))] if lost else []


def _loops(lock: Lock, direct: Mapping[str, Lock]) -> bool:
    leader = lock.leader
    while leader in direct:
        leader = direct[leader].leader
    return leader == lock.follower
