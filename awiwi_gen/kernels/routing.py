"""What the routing of a finger's tendons tells: which joints each pulls, how, and which tendons depend on one another."""

from __future__ import annotations

from collections import Counter

from awiwi_gen.hand import Finger
from awiwi_gen.hand.parts import Limits, Tendon, Transmission
from awiwi_gen.structure import link_number, loose_ends, rolls, wraps


def senses(finger: Finger, tendon: Tendon) -> Counter[str]:
    """Signed number of pulleys of each independent joint that a tendon runs over."""
    found: Counter[str] = Counter()
    for over in tendon.over:
        found[finger.leaders.get(over[1:], over[1:])] += 1 if over[0] == "+" else -1
    return Counter({joint: count for joint, count in found.items() if count})


def moved(finger: Finger, transmission: Transmission) -> set[str]:
    """The independent joints that the tendons of a motor pull."""
    return set().union(*(_moved(finger, tendon) for tendon in transmission.tendons))


def _moved(finger: Finger, tendon: Tendon) -> set[str]:
    order = [link.joint for link in finger.links]
    between = order[: order.index(tendon.span.joint)] if tendon.span else []
    for run in tendon.runs:
        touched = [link_number(finger, each.link) for each in (run.start, run.body, run.end) if each is not None]
        between += order[min(touched) + 1 : max(touched) + 1]
    return {finger.leaders.get(joint, joint) for joint in (*between, *tendon.arms, *geared(finger, tendon))} | set(
        senses(finger, tendon)
    )


def groups(finger: Finger) -> list[list[int]]:
    """The tendons in groups, those of one motor as one; tendons that share a joint are in one group."""
    found: list[tuple[set[str], list[int]]] = []
    for i, transmission in enumerate(finger.transmissions):
        joints, members = moved(finger, transmission), [i]
        for other in [group for group in found if group[0] & joints]:
            found.remove(other)
            joints, members = joints | other[0], other[1] + members
        found.append((joints, members))
    return [sorted(members) for _, members in found]


def geared(finger: Finger, tendon: Tendon) -> list[str]:
    """The joints under a tendon that follow others by a ratio or with an offset, not by rolling on pulleys."""
    return [over[1:] for over in tendon.over if over[1:] in finger.leaders and not rolls(finger, over[1:])]


def is_curved(finger: Finger) -> bool:
    """Whether the coupling depends on the pose, as that of lines from link to link does."""
    return any(is_bent(finger, transmission) for transmission in finger.transmissions)


def is_bent(finger: Finger, transmission: Transmission) -> bool:
    """Whether a motor's tendons have lines from point to point, straight or round bodies, or joints that follow a curve."""
    curves = {coupling.follower for coupling in finger.couplings if coupling.powers}
    return any(
        tendon.span or tendon.path or curves & {*tendon.arms, *(over[1:] for over in tendon.over)}
        for tendon in transmission.tendons
    )


def least_forces(finger: Finger, limits: Limits) -> tuple[float, ...]:
    """The least force of every motor [N]: zero, or minus the largest one of a motor that pulls both ways."""
    most = float(limits.tendon_force)
    return tuple(-most if transmission.two_way else 0.0 for transmission in finger.transmissions)


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
