"""Fingers in a tree of bodies: serial chains below the palm, the last body that all of them hang from.

Bodies without joints are welded to what carries them. A body with several joints becomes several links, of which the
last has the mass.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from awiwi_gen.errors import Fault, InputError, unknown
from awiwi_gen.hand.palm import MOST_AXES
from awiwi_gen.interchange.model import Array, Joint, Loss, Model

__all__ = ["Chain", "Segment", "find", "palm_of", "wrist_joints"]


@dataclass(frozen=True)
class Segment:
    """A rigid part of a finger: the body whose joints move it, and all bodies welded to it."""

    body: int
    joints: tuple[Joint, ...]
    members: tuple[int, ...]


@dataclass(frozen=True)
class Chain:
    """A finger: the body that carries it, which the palm holds, and its segments from base to tip."""

    name: str
    carrier: int
    segments: tuple[Segment, ...]

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints from base to tip."""
        return tuple(joint for segment in self.segments for joint in segment.joints)


def palm_of(model: Model, name: str = "") -> int:
    """The body of this name, or the last one that carries all fingers of the hand with the most joints.

    Raises `InputError` for an unknown name, and where two hands have equally many joints.
    """
    if name:
        found = model.find(name)
        if found is None:
            raise unknown("body", name, [body.name for body in model.bodies], "see the names in the file")
        return found
    counts = {child: _hinges(model, child) for child in model.children[0]}
    most = max(counts.values(), default=0)
    if not most:
        raise _fault(model, "", "has no joint; expected a hand")
    hands = [child for child, count in counts.items() if count == most]
    if len(hands) > 1 and not model.joints_of[hands[0]]:
        names = " and ".join(model.bodies[hand].name for hand in hands)
        raise _fault(model, "", f"has two hands of {most} joints, below {names}; choose one with --palm BODY")
    return _branching(model, 0 if len(hands) > 1 else hands[0])


def _branching(model: Model, top: int) -> int:
    """The first body below `top` that carries several moving parts.

    In a single chain, the last body with "palm" in its name that carries others, else `top`, or what carries it.
    """
    at, palm = top, None
    while len(moving := [child for child in model.children[at] if _hinges(model, child)]) == 1:
        palm = at if "palm" in model.bodies[at].name.lower() else palm
        at = moving[0]
    if moving:
        return at
    if palm is not None:
        return palm
    return model.bodies[top].parent if model.joints_of[top] else top


def _hinges(model: Model, body: int) -> int:
    return sum(joint.kind != "free" for each in model.below(body) for joint in model.joints_of[each])


def find(model: Model, palm: int, named: Mapping[str, str]) -> tuple[list[Chain], list[Loss]]:
    """The fingers below the palm, or those that `named` gives by their first or last body, and what else moves.

    Chains found in the tree have no names yet. Raises `InputError` for branches, joints that are neither hinges nor
    slides, and unknown bodies.
    """
    if named:
        chains = [_named(model, palm, name, body) for name, body in named.items()]
    else:
        chains = [Chain("", palm, tuple(_segments(model, start))) for start in _starts(model, palm)]
    if not chains:
        raise _fault(
            model, f"body {model.bodies[palm].name}", "carries no moving body; expected fingers below the palm"
        )
    for chain in chains:
        for joint in chain.joints:
            if joint.kind not in ("hinge", "slide"):
                message = f"is a {joint.kind} joint; a finger's joints are hinges and slides"
                raise _fault(model, f"joint {joint.name}", f"{message}; leave the finger out by naming the others")
    held = {joint.name for chain in chains for joint in chain.joints}
    above = set(model.above(palm))
    held |= {joint.name for joint in wrist_joints(model, palm)}
    others = [joint for joint in model.joints if joint.name not in held]
    losses = [
        Loss("joints above the palm: the palm is held as drawn", _names(j for j in others if j.body in above)),
        Loss("joints that are not of the fingers: held as drawn", _names(j for j in others if j.body not in above)),
    ]
    return chains, [loss for loss in losses if loss.places]


def wrist_joints(model: Model, palm: int) -> list[Joint]:
    """The joints that move the palm, from the outermost on; none where they are more than a wrist has, or no hinges."""
    joints = [joint for body in reversed(model.above(palm)) for joint in model.joints_of[body]]
    wrist = len(joints) <= MOST_AXES and all(joint.kind == "hinge" for joint in joints)
    return joints if wrist else []


def _names(joints: Iterator[Joint]) -> tuple[str, ...]:
    return tuple(joint.name for joint in joints)


def _starts(model: Model, body: int) -> Iterator[int]:
    """The first moving bodies below a body."""
    for child in model.children[body]:
        if model.joints_of[child]:
            yield child
        else:
            yield from _starts(model, child)


def _segments(model: Model, start: int) -> Iterator[Segment]:
    at: int | None = start
    while at is not None:
        members = tuple(_welded(model, at))
        yield Segment(at, model.joints_of[at], members)
        following = list(_starts(model, at))
        if len(following) > 1:
            names = ", ".join(model.bodies[body].name for body in following)
            message = f"carries {len(following)} moving bodies ({names}), but a finger is a serial chain"
            fix = "name one chain by its last body, --finger NAME=BODY, or another palm, --palm BODY"
            raise _fault(model, f"body {model.bodies[at].name}", f"{message}; {fix}")
        at = following[0] if following else None


def _welded(model: Model, body: int) -> Iterator[int]:
    yield body
    for child in model.children[body]:
        if not model.joints_of[child]:
            yield from _welded(model, child)


def _named(model: Model, palm: int, name: str, body_name: str) -> Chain:
    body = model.find(body_name)
    if body is None:
        raise unknown("body", body_name, [each.name for each in model.bodies], "see the names in the file")
    above = model.above(body)
    if palm not in above or body == palm:
        raise _fault(model, f"body {body_name}", f"is not below the palm {model.bodies[palm].name}; see --palm")
    road = [each for each in reversed(above[: above.index(palm)]) if model.joints_of[each]]
    segments = [Segment(each, model.joints_of[each], tuple(_welded(model, each))) for each in road]
    last = road[-1] if road else palm
    rest = [start for start in _starts(model, last) if body in model.above(start) or last == body or not road]
    if len(rest) == 1:
        segments += _segments(model, rest[0])
    elif len(rest) > 1:
        raise _fault(model, f"body {body_name}", "carries several moving bodies; name the last body of one chain")
    if not segments:
        raise _fault(model, f"body {body_name}", "has no joint above or below it; expected a body of a finger")
    return Chain(name, palm, tuple(segments))


def composite(model: Model, segment: Segment) -> tuple[float, Array, Array]:
    """Mass, centre of mass (3) and tensor about it (3 x 3) of a segment, in the world's axes as drawn."""
    parts = []
    for index in segment.members:
        body, (axes, position) = model.bodies[index], model.poses[index]
        parts.append((body.mass, position + axes @ body.com, axes @ body.inertia @ axes.T))
    mass = sum(part[0] for part in parts)
    if not mass:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    if sum(part[0] > 0 for part in parts) == 1:
        return next(part for part in parts if part[0] > 0)
    com = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for m, c, inertia in parts:
        d = c - com
        tensor += inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, com, tensor


def _fault(model: Model, element: str, message: str) -> InputError:
    return InputError(Fault(file=model.file, key=element or None, message=message))
