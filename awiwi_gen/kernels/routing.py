"""What the routing of a finger's tendons tells: which joints each pulls, and which tendons depend on one another."""

from __future__ import annotations

from collections import Counter

from awiwi_gen.hand import Finger
from awiwi_gen.hand.parts import Tendon
from awiwi_gen.structure import link_number, loose_ends, rolls, wraps


def senses(finger: Finger, tendon: Tendon) -> Counter[str]:
    """Signed number of pulleys of each independent joint that a tendon runs over."""
    found: Counter[str] = Counter()
    for over in tendon.over:
        found[finger.leaders.get(over[1:], over[1:])] += 1 if over[0] == "+" else -1
    return Counter({joint: count for joint, count in found.items() if count})


def moved(finger: Finger, tendon: Tendon) -> set[str]:
    """The independent joints that a tendon pulls."""
    order = [link.joint for link in finger.links]
    between = order[: order.index(tendon.span.joint)] if tendon.span else []
    for run in tendon.runs:
        touched = [link_number(finger, each.link) for each in (run.start, run.body, run.end) if each is not None]
        between += order[min(touched) + 1 : max(touched) + 1]
    return {finger.leaders.get(joint, joint) for joint in (*between, *tendon.arms, *geared(finger, tendon))} | set(
        senses(finger, tendon)
    )


def groups(finger: Finger) -> list[list[int]]:
    """The tendons in groups; tendons that share a joint are in one group."""
    found: list[tuple[set[str], list[int]]] = []
    for i, tendon in enumerate(finger.pulled):
        joints, members = moved(finger, tendon), [i]
        for other in [group for group in found if group[0] & joints]:
            found.remove(other)
            joints, members = joints | other[0], other[1] + members
        found.append((joints, members))
    return [sorted(members) for _, members in found]


def geared(finger: Finger, tendon: Tendon) -> list[str]:
    """The joints under a tendon that follow others by a ratio or with an offset, not by rolling on pulleys."""
    return [over[1:] for over in tendon.over if over[1:] in finger.leaders and not rolls(finger, over[1:])]


def wraps_hold(finger: Finger, owner: str = "") -> tuple[str, ...]:
    """The conditions under which tendons wrap round bodies as they do in the middle of the joints' ranges."""
    found = []
    for number, run in wraps(finger):
        body = f"path[{run.between}] of {owner}tendons[{number}]"
        if run.body.inside:
            found.append(f"the ends of the string are away from the surface of {body}, or it is straight there")
            continue
        found += [f"path[{index}] is outside {body}" for index in loose_ends(run)]
        found += [f"path[{run.between}].side is outside {body}"] if run.body.carrier else []
        found.append(f"the string passes {body} on the side where it does at the middle of the joints' ranges")
    return tuple(found)
