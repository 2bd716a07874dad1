"""What the page must know of a hand to draw and move it, as plain data: fingers, joints, tendons, wrist, kernels.

Points are pairs of a link's number (-1: the finger's base) and coordinates [m] in its frame, to be placed by the kernel
``link_poses``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from awiwi_gen.drawing import skeleton
from awiwi_gen.emit.names import function_name
from awiwi_gen.hand import Finger, Hand
from awiwi_gen.hand.parts import Tendon
from awiwi_gen.hand.pose import Chain, Frame, Spot, fixed_rotation, seen
from awiwi_gen.hand.wraps import Vector

Array = np.ndarray[Any, Any]
Point = tuple[int, Vector]

FAMILIES = (
    "link_poses", "pose_and_jacobian", "tendon_lengths", "coupling", "joint_stiffness", "tendon_stiffness", "gravity",
    "mass_matrix", "forward_dynamics", "return_torque",
)  # fmt: skip
OF_HAND = ("wrist_points", "wrist_palm_pose", "hand_tendon_lengths", "palm_pose")
BACK = 0.3  # of the longest reach: how far tendons are drawn behind the first joint
APART, AHEAD = 0.24, 0.5  # of the longest reach: where fingers without a place in the file are drawn in the palm
SLIM, WIDE = 0.03, 0.07  # of a finger's reach: the radius of links without and at most with a pulley


def kernels_of(hand: Hand, manifest: Mapping[str, Any]) -> list[str]:
    """The kernels that the page calls, of those that a hand has."""
    wanted = {f"{name}_{family}" for name in hand.fingers for family in FAMILIES} | set(OF_HAND)
    return [entry["name"] for entry in manifest["kernels"] if entry["name"] in wanted]


def scene(hand: Hand, manifest: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """All that the page must know, with the signatures of the kernels in its module."""
    chosen = set(names)
    chains = {name: Chain(finger) for name, finger in hand.fingers.items()}
    reach = max(_reach(chain) for chain in chains.values())
    placed = all(finger.base for finger in hand.fingers.values())
    return {
        "name": hand.name,
        "reach": reach,
        "placed": placed,
        "gravity": float(hand.limits.gravity),
        "force": float(hand.limits.tendon_force),
        "fingers": [
            _finger(name, chain, _base(chain.finger, index, len(chains), reach, placed), reach)
            for index, (name, chain) in enumerate(chains.items())
        ],
        "wrist": _wrist(hand),
        "kernels": {e["name"]: _signature(hand.prefix, e) for e in manifest["kernels"] if e["name"] in chosen},
    }


def _signature(prefix: str, entry: Mapping[str, Any]) -> dict[str, Any]:
    """The C function of a kernel, and its arrays in order: name and number of elements."""
    ports = {kind: [[p["name"], int(np.prod(p["shape"]))] for p in entry[kind]] for kind in ("inputs", "outputs")}
    return {"function": function_name(prefix, entry["name"]), **ports}


def _finger(name: str, chain: Chain, base: list[list[float]], reach: float) -> dict[str, Any]:
    finger, own = chain.finger, _reach(chain)
    radii = [float(finger.radii.get(link.joint, 0)) for link in finger.links]
    joints = [
        {"name": joint, "low": low, "high": high, "slides": joint in finger.sliding}
        for joint, low, high in zip(finger.joints, chain.low, chain.high, strict=True)
    ]
    return {
        "name": name,
        "base": base,
        "joints": joints,
        "middle": chain.poses()[0],
        "links": [
            {"joint": link.joint, "radius": radius, "width": min(max(0.7 * radius, SLIM * own), WIDE * own)}
            for link, radius in zip(finger.links, radii, strict=True)
        ],
        "tip": [float(x) for x in finger.links[-1].offset],
        "tendons": list(_tendons(chain, BACK * reach)),
        "pulled": [list(each.members) for each in finger.transmissions],
    }


def _reach(chain: Chain) -> float:
    """The length of a finger along its bones [m], in the middle pose."""
    return float(np.linalg.norm(np.diff(skeleton(chain, chain.poses()[0]), axis=0), axis=1).sum()) or 1.0


def _base(finger: Finger, index: int, fingers: int, reach: float, placed: bool) -> list[list[float]]:
    """Where a finger's base frame stands in the palm (4, 4): as the file says for all fingers, else side by side."""
    pose = np.eye(4)
    if placed and finger.base:
        pose[:3, :3] = np.array(fixed_rotation(finger.base)).T
        pose[:3, 3] = [float(x) for x in finger.base.position]
    else:
        pose[:2, 3] = AHEAD * reach, ((fingers - 1) / 2 - index) * APART * reach
    return [[float(x) for x in row] for row in pose]


def _tendons(chain: Chain, back: float) -> Iterator[dict[str, Any]]:
    """Every tendon as lines of points; those that motors do not pull are return strings."""
    for tendon, lines in zip(chain.finger.tendons, chain.lines, strict=True):
        drawn = [[_fixed(chain, line.start), _fixed(chain, line.end)] for line in lines]
        if over := _over_pulleys(chain, tendon, back):
            drawn.append(over)
        yield {"lines": drawn, "returns": tendon.spring is not None}


def _fixed(chain: Chain, spot: Spot) -> Point:
    """A point of a tendon in the frame of the link that it is fixed to."""
    if spot.rotated or spot.link < 0:
        return spot.link, spot.at
    middle, link = chain.poses()[0], spot.link - 1  # the frame before a joint's motion belongs to the link before it
    place = chain.place(middle, spot)
    return link, place if link < 0 else seen(*_frames(chain, middle)[link], place)


def _frames(chain: Chain, q: Sequence[float]) -> list[Frame]:
    return [own for _, own in chain.frames(q)]


def _over_pulleys(chain: Chain, tendon: Tendon, back: float) -> list[Point]:
    """A tendon along the links: past each pulley at its radius, on the side that its sense says, to the last link's middle.

    Joints at one place share a point, as the base joints of a finger whose tendons move both.
    """
    finger, middle = chain.finger, chain.poses()[0]
    frames, ends = _frames(chain, middle), skeleton(chain, middle)
    senses = {over[1:]: float(f"{over[0]}1") for over in tendon.over}
    asides: dict[tuple[float, ...], tuple[int, Array]] = {}  # by place: the last link there, and how far it is passed
    for number, link in enumerate(finger.links):
        if link.joint in senses:
            place = tuple(np.round(ends[number], 9))
            aside = -senses[link.joint] * float(finger.radii[link.joint]) * np.array(frames[number][0][1])
            asides[place] = number, aside + (asides[place][1] if place in asides else 0)
    if not asides:
        return []
    along = (ends[-1] - ends[0]) / (np.linalg.norm(ends[-1] - ends[0]) or 1.0)
    first, (_, aside) = next(iter(asides.items()))
    points = [(-1, _coordinates(np.array(first) + aside - back * along))]
    for place, (number, aside) in asides.items():
        points.append((number, seen(*frames[number], _coordinates(np.array(place) + aside))))
    bone = (ends[number] + ends[number + 1]) / 2
    return [*points, (number, seen(*frames[number], _coordinates(bone + aside / 3)))]


def _coordinates(place: Array) -> Vector:
    x, y, z = map(float, place)
    return x, y, z


def _wrist(hand: Hand) -> dict[str, Any] | None:
    """The angles that move the palm, with the kernel of its pose; the bars of a wrist of bars."""
    if hand.wrist:
        bars = [[float(x) for x in hand.wrist.a0], [0.0, 0.0, 0.0], list(hand.wrist.far_bar[0])]
        more = {"bars": bars, "kernel": "wrist_palm_pose"}
        return _moving(("q71", "q73"), hand.wrist.range, hand.wrist.neutral) | more
    if hand.palm:
        low, high = hand.palm.range
        middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
        return _moving([joint.joint for joint in hand.palm.joints], (low, high), middle) | {"kernel": "palm_pose"}
    return None


def _moving(names: Sequence[str], ends: Sequence[Sequence[float]], middle: Sequence[float]) -> dict[str, Any]:
    """Joints with their ranges, and where they begin."""
    ranges = zip(names, *ends, strict=True)
    joints = [{"name": name, "low": low, "high": high, "slides": False} for name, low, high in ranges]
    return {"joints": joints, "middle": list(middle)}
