"""Names and structure of a finger's chain, no physics: all that both wings share besides the numbers.

A finger is anything with these attributes (the hand file's `Finger` and its symbolic copies are):

    links[i]      joint, slides, turn, offset[3], mass, com[3], inertia.{xx,yy,zz,xy,xz,yz} (or None of the three), start;
                  quarters[3], and None or rpy[3], reference, four_bar, armature, damping, friction, spring
    pulleys[i]    joint, radius
    tendons[i]    rest, over (senses and joints: "+flexion", "-pip"), arms (joint -> arm), span (None or from_[3], to[3],
                  joint), path (points: link, at[3]; bodies also radius, axis (None or [3]), side (None or [3]),
                  carrier of the side (None or a link), inside, and kind), runs (path from point to point:
                  start, body or None, end, counted()), spring (None or stiffness, rest)
    pulled, strings   the tendons without a spring, and those with one
    transmissions[i]  what each motor pulls: members (indices in pulled), and ratios of all of them, or none by which
                      the motor's length is that of its only tendon
    measured          indices in q of the joints with a sensor of their angle
    couplings[i]  follower, leader, ratio (or None), offset (or None), powers (none, or the coefficients of the second
                  to the fourth)
    base          None or position[3], turn, quarters[3], rpy[3]

A palm on joints in series has `joints` (also called `links`) with joint, slides (False), turn, quarters[3], rpy[3],
reference and offset[3]; `base`; and `turn`, `quarters[3]` and `rpy[3]` of its own.

An angle of a joint that slides is its position [m], along z.

The numbers may be symbols of either library. Independent joints are counted along the chain, base to tip.
"""

from collections import Counter
from fractions import Fraction
from typing import Any

Finger = Any
Palm = Any
Wrist = Any


def leaders(finger: Finger) -> dict[str, str]:
    """Follower -> leader, for each coupled joint."""
    return {coupling.follower: coupling.leader for coupling in finger.couplings}


def coordinates(finger: Finger) -> dict[str, int]:
    """Joint -> index in q of the coordinate that moves it; a follower has the index of its leader."""
    follows = leaders(finger)
    free = [link.joint for link in finger.links if link.joint not in follows]
    return {link.joint: free.index(follows.get(link.joint, link.joint)) for link in finger.links}


def unmeasured(finger: Finger) -> list[int]:
    """Indices in q of the joints without a sensor of their angle."""
    follows = leaders(finger)
    free = [link.joint for link in finger.links if link.joint not in follows]
    return [index for index in range(len(free)) if index not in finger.measured]


def straight(finger: Finger) -> list[Any]:
    """The independent joint angles [rad] of the straight finger: zero, but for four-bars that cannot close there.

    These stand where their couplers start, at the end of the joint's range that is nearest to zero.
    """
    follows = leaders(finger)
    return [link.start if link.four_bar else 0 for link in finger.links if link.joint not in follows]


def link_number(finger: Finger, name: str) -> int:
    """Index of the link that a joint moves; -1 for "palm", the base frame."""
    return -1 if name == "palm" else next(i for i, link in enumerate(finger.links) if link.joint == name)


def wraps(finger: Finger) -> list[tuple[int, Any]]:
    """The runs that wrap round bodies, each with the index of its tendon in the file."""
    return [
        (number, run) for number, tendon in enumerate(finger.tendons) for run in tendon.runs if run.body is not None
    ]


def loose_ends(run: Any) -> list[int]:
    """The ends of a run that move against the body between them, as indices in the path."""
    ends = {run.first: run.start, run.last: run.end}
    return [index for index, point in ends.items() if point.link != run.body.link]


def middle(finger: Finger) -> list[Any]:
    """The independent joint angles [rad] in the middle of their ranges."""
    follows = leaders(finger)
    return [(link.low + link.high) / 2 for link in finger.links if link.joint not in follows]


def radius(finger: Finger, joint: str) -> Any:
    """Radius of the pulley around a joint [m]."""
    return next(pulley.radius for pulley in finger.pulleys if pulley.joint == joint)


def motion(finger: Finger, follower: str) -> tuple[Any, ...]:
    """Coefficients of the angle of a joint that follows another, by powers of its leader's: offset [rad], ratio, ...

    A coupling tendon on pulleys keeps its length: r_leader q_leader = r_follower q_follower.
    """
    coupling = next(coupling for coupling in finger.couplings if coupling.follower == follower)
    offset = 0 if coupling.offset is None else coupling.offset
    if coupling.ratio is not None:
        return offset, coupling.ratio, *coupling.powers
    return offset, radius(finger, coupling.leader) / radius(finger, follower)


def rolls(finger: Finger, joint: str) -> bool:
    """Whether the arc on a joint's pulley is that on its leader's, so that the leader's stands for it."""
    return any(c.follower == joint and c.ratio is None and c.offset is None for c in finger.couplings)


def senses(finger: Finger, tendon: Any) -> Counter[str]:
    """Signed number of pulleys of each independent joint that a tendon runs over."""
    found: Counter[str] = Counter()
    for over in tendon.over:
        sign, joint = sense(over)
        found[leaders(finger).get(joint, joint)] += sign
    return Counter({joint: count for joint, count in found.items() if count})


def geared(finger: Finger, tendon: Any) -> list[str]:
    """The joints under a tendon that follow others by a ratio or with an offset, not by rolling on pulleys."""
    return [over[1:] for over in tendon.over if over[1:] in leaders(finger) and not rolls(finger, over[1:])]


def moved(finger: Finger, transmission: Any) -> set[str]:
    """The independent joints that the tendons of a motor pull."""
    return set().union(*(moved_by(finger, tendon) for tendon in transmission.tendons))


def moved_by(finger: Finger, tendon: Any) -> set[str]:
    """The independent joints that move a tendon."""
    order, follows = [link.joint for link in finger.links], leaders(finger)
    between = order[: order.index(tendon.span.joint)] if tendon.span else []
    for run in tendon.runs:
        touched = [link_number(finger, each.link) for each in (run.start, run.body, run.end) if each is not None]
        between += order[min(touched) + 1 : max(touched) + 1]
    paths = {follows.get(joint, joint) for joint in (*between, *tendon.arms, *geared(finger, tendon))}
    return paths | set(senses(finger, tendon))


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


def estimated_parts(finger: Finger) -> list[tuple[list[int], list[int]]]:
    """Joints whose angles are to be found and tendons, by index, that depend on no others.

    Where a part has fewer tendons than joints, springs of joints have to give the missing equations. Joints without
    tendons are the last part.
    """
    follows = leaders(finger)
    joints = [link.joint for link in finger.links if link.joint not in follows]
    found, left = [], unmeasured(finger)
    for tendons in groups(finger):
        pulled = set().union(*(moved(finger, finger.transmissions[i]) for i in tendons))
        found.append(([i for i in left if joints[i] in pulled], tendons))
    loose = [i for i in left if not any(i in part for part, _ in found)]
    return [part for part in [*found, (loose, [])] if part[0]]


def resting_parts(finger: Finger) -> list[tuple[list[int], list[int]]]:
    """Those of the estimated parts where lengths are too few, so that springs of joints have to tell the rest."""
    return [part for part in estimated_parts(finger) if len(independent(finger, part[1])[0]) < len(part[0])]


def independent(finger: Finger, tendons: list[int]) -> tuple[list[int], list[list[Fraction]]]:
    """Those of some tendons whose arms determine the others' whatever the radii are, and all rows by the rows of these.

    Tendons that only run over pulleys depend on one another where their senses do, as antagonists over the same joints.
    """
    found: list[int] = []
    rows: list[list[Fraction]] = []
    for i in tendons:
        chosen = [_turns(finger, j) for j in found]
        wanted = _turns(finger, i)
        share = None if wanted is None else _combined([each or {} for each in chosen], wanted)
        if share is None:
            found.append(i)
            share = [Fraction(j == i) for j in found]
        rows.append(share)
    return found, [row + [Fraction(0)] * (len(found) - len(row)) for row in rows]


def _turns(finger: Finger, transmission: int) -> dict[str, int] | None:
    """Signed number of pulleys of each joint under what a motor pulls; None if it is not one tendon over pulleys only."""
    tendon, *more = finger.transmissions[transmission].tendons
    others = more or finger.transmissions[transmission].ratios or tendon.arms or tendon.span or tendon.path
    return None if others or geared(finger, tendon) else dict(senses(finger, tendon))


def _combined(rows: list[dict[str, int]], wanted: dict[str, int]) -> list[Fraction] | None:
    """Shares by which the independent `rows` add up to the wanted one; None if they cannot."""
    joints = sorted({*wanted, *(joint for row in rows for joint in row)})
    table = [[Fraction(row.get(joint, 0)) for row in (*rows, wanted)] for joint in joints]
    shares, used = [Fraction(0)] * len(rows), 0
    pivots: list[int] = []
    for column in range(len(rows)):
        pivot = next((k for k in range(used, len(table)) if table[k][column]), None)
        if pivot is None:
            continue
        table[used], table[pivot] = table[pivot], table[used]
        table[used] = [x / table[used][column] for x in table[used]]
        for k in range(len(table)):
            if k != used:
                table[k] = [x - table[k][column] * y for x, y in zip(table[k], table[used], strict=True)]
        pivots.append(column)
        used += 1
    if any(row[-1] for row in table[used:]):
        return None
    for row, column in zip(table, pivots, strict=False):
        shares[column] = row[-1]
    return shares


def resting(finger: Finger) -> tuple[list[int], list[int]]:
    """The joints of all resting parts, and their tendons, by index."""
    parts = resting_parts(finger)
    return sorted(j for joints, _ in parts for j in joints), sorted(i for _, tendons in parts for i in tendons)


def determined(finger: Finger) -> tuple[list[int], list[int]]:
    """The joints whose angles tendon lengths tell by themselves, and the tendons for them, by index."""
    resting = resting_parts(finger)
    joints = [j for j in unmeasured(finger) if not any(j in part for part, _ in resting)]
    return joints, [i for i in range(len(finger.transmissions)) if not any(i in part for _, part in resting)]


def rests_in_a_bend(finger: Finger) -> bool:
    """Whether joints rest by springs, and springs or tendons do not act linearly on them: strings, or what bends with q."""
    curves = {coupling.follower for coupling in finger.couplings if coupling.powers}
    springs = [link.joint for link in finger.links if link.spring is not None]
    bends = is_curved(finger) or any(joint in curves for joint in springs)
    return bool(finger.strings or (springs and bends)) and bool(resting_parts(finger))


def is_curved(finger: Finger) -> bool:
    """Whether the coupling depends on the pose, as that of lines from link to link does."""
    return any(is_bent(finger, transmission) for transmission in finger.transmissions)


def is_bent(finger: Finger, transmission: Any) -> bool:
    """Whether a motor's tendons have lines from point to point, straight or round bodies, or joints that follow a curve."""
    curves = {coupling.follower for coupling in finger.couplings if coupling.powers}
    return any(
        tendon.span or tendon.path or curves & {*tendon.arms, *(over[1:] for over in tendon.over)}
        for tendon in transmission.tendons
    )


def quarter_turns(turn: str) -> tuple[int, int]:
    """A fixed rotation such as "x+90" as (axis, number of 90 degree rotations): (0, 1); "none" is (2, 0)."""
    return (2, 0) if turn == "none" else ("xyz".index(turn[0]), int(turn[1:]) // 90)


def fixed_turns(part: Any) -> list[tuple[int, int | None, Any]]:
    """The fixed rotations of a link in front of its joint, or of a finger's base, in order; none by zero.

    Each is (axis, quarters, angle): so many quarter turns about that axis, or by the angle [rad] if `quarters` is None.
    """
    axis, quarters = quarter_turns(part.turn)
    steps = [(axis, quarters, None)]
    if part.rpy is not None:
        steps += [(k, part.quarters[k], part.rpy[k]) for k in (2, 1, 0)]
    return [step for step in steps if step[1] != 0]


def sense(over: str) -> tuple[int, str]:
    """A pulley that a tendon runs over, "-pip", as (sign, joint): (-1, "pip")."""
    return (1 if over[0] == "+" else -1), over[1:]


def is_symmetric(wrist: Wrist) -> bool:
    """Whether the side bars of a wrist are a crossed parallelogram, with A straight across from the middle of BC."""
    return wrist.width is None and wrist.c is None
