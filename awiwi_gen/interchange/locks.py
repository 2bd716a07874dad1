"""Joints that follow others. A hand file's follower turns to the same side as its leader, both from zero.

So the angle of a follower that turns to the other side, or with an offset, is counted anew:
new angle = sign * (published angle - offset), which is |ratio| times the leader's angle.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from awiwi_gen.interchange.model import Lock, Loss


@dataclass(frozen=True)
class Followed:
    """A follower by its published name, both names in the hand file, and how its angle is counted."""

    published: str
    follower: str
    leader: str
    ratio: float
    sign: int
    offset: float

    @property
    def moved(self) -> bool:
        """Whether the angle is counted in another way than published."""
        return self.sign < 0 or self.offset != 0

    def angle(self, published: float) -> float:
        """The hand file's angle [rad] of a published one."""
        return self.sign * (published - self.offset)


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
        sign = 1 if ratio > 0 else -1
        found.append(Followed(name, names[name], names[leader], abs(ratio), sign, offset))
    what = "couplings of joints that are in two fingers, in none, or in a loop"
    return found, [Loss(what, tuple(lost))] if lost else []


def _loops(lock: Lock, direct: Mapping[str, Lock]) -> bool:
    leader = lock.leader
    while leader in direct:
        leader = direct[leader].leader
    return leader == lock.follower
