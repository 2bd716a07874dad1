"""Paths of tendons from point to point: what no tendon can have, although every single value is valid."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

from awiwi_gen.hand.parts import Finger, Keys, PathPoint, Run, Tendon
from awiwi_gen.hand.pose import Chain, Line
from awiwi_gen.hand.wraps import INSIDE_CLEARANCE, Body, Turn

__all__ = ["misplaced", "told", "without_length"]

Complaint = tuple[Keys, str]

_SHORTEST = 1e-4  # m; less than the thickness of a tendon
_NO_DIRECTION = 1e-6  # of a cylinder's axis, and [m] of a side point from that axis


def misplaced(tendon: Tendon) -> Iterator[Complaint]:
    """Bodies that a path cannot wrap round: at an end of it or of a branch, two in a row, or of no shape."""
    for index, each in enumerate(tendon.path):
        keys: Keys = ("path", index)
        after = tendon.path[index + 1] if index + 1 < len(tendon.path) else None
        ends = after is None or after.divisor is not None
        if each.radius is None:
            for key in ("axis", "side", "side_link", "inside"):
                if getattr(each, key) not in (None, False):
                    yield (*keys, key), 'is at a point; expected a radius such as "6.2 mm" beside it'
            if ends and (index == 0 or each.divisor is not None):
                yield keys, "is a branch of one point; expected two or more"
            continue
        if each.divisor is not None:
            yield (*keys, "divisor"), f"is at a {each.kind}; expected it at the point where the branch begins"
        if index == 0 or ends:
            yield keys, f"is a {each.kind} at the end of the path; expected a point before it and one after it"
        elif after is not None and after.radius is not None:
            yield keys, f"is a {each.kind} with another body after it; expected a point between the two"
        if each.axis is not None and math.hypot(*map(float, each.axis)) < _NO_DIRECTION:
            yield (*keys, "axis"), 'has no direction; expected such as ["0", "0", "1"]'
        elif each.side_link is not None and each.side is None:
            yield (*keys, "side_link"), "is without a side; expected the point that it carries beside it"
        elif each.side is not None and each.inside:
            yield (*keys, "inside"), "is beside a side; expected one of the two"
        elif each.side is not None and each.carrier is None:
            yield from ((("path", index, "side"), message) for message in _side(each))


def _side(body: PathPoint) -> Iterator[str]:
    """A side point is outside the body, where it tells a side."""
    side = [float(a) - float(b) for a, b in zip(body.side or (), body.at, strict=True)]
    away, radius = math.hypot(*side), float(body.radius or 0)
    if away < radius:
        found = f"is {away * 1e3:.4g} mm from the centre of a {body.kind} of radius {radius * 1e3:.4g} mm"
        yield f"{found}, so the tendon would wrap round its inside; expected inside = true instead, or a point outside"
    if body.axis is not None:
        axis = [float(each) / math.hypot(*map(float, body.axis)) for each in body.axis]
        if away**2 - sum(a * b for a, b in zip(axis, side, strict=True)) ** 2 < _NO_DIRECTION**2:
            yield "is on the cylinder's axis; expected a point on one side of it"


def without_length(chain: Chain, number: int) -> Iterator[Complaint]:
    """The first line of a tendon whose ends meet in some pose, or lie inside the body between them."""
    tendon = chain.finger.tendons[number]
    runs = [None] * bool(tendon.span) + tendon.runs
    for run, line in zip(runs, chain.lines[number], strict=True):
        length, q = chain.shortest(Line(line.start, line.end, None))
        if length < _SHORTEST:
            keys: Keys = ("span",) if run is None else ("path", run.last)
            what = "has a length of" if run is None else "lies behind the point before it by"
            least = f"expected at least {_SHORTEST * 1e3:g} mm in every pose"
            yield keys, f"{what} {length * 1e3:.2g} mm at {told(chain.finger, q)}; {least}"
            return
        if run is not None and line.body is not None:
            near = _too_near if line.body.inside else _touching
            found = [*near(chain, run, line, line.body)]
            yield from found
            if found:
                return


def _touching(chain: Chain, run: Run, line: Line, body: Body) -> Iterator[Complaint]:
    """Points inside the body that a run wraps round, and a side that changes."""
    kind = "sphere" if body.axis is None else "cylinder"
    for end, index in enumerate((run.first, run.last)):
        distance, q = chain.least(partial(_distance, chain, body, line, end))
        if distance < body.radius:
            depth, pose = (body.radius - distance) * 1e3, told(chain.finger, q)
            inside = f"lies {depth:.2g} mm inside the {kind} path[{run.between}] at {pose}"
            yield ("path", index), f"{inside}; expected a point outside it in every pose"
            return
    if line.side is not None:
        depth, q = chain.least(partial(_side_distance, chain, body, line))
        if depth < body.radius:
            found = f"comes within {depth * 1e3:.2g} mm of the {kind}'s centre at {told(chain.finger, q)}"
            yield ("path", run.between or 0, "side"), f"{found}; expected a point outside the radius in every pose"
            return
    middle, *poses = chain.poses()
    there = _turn(chain, body, middle, line)
    for q in poses:
        if not _turn(chain, body, q, line).is_like(there):
            jump = f"is passed on the other side at {told(chain.finger, q)} than at {told(chain.finger, middle)}"
            yield ("path", run.between or 0), f"{jump}; the tendon would jump over the {kind}: expected one side"
            return


def _side_distance(chain: Chain, body: Body, line: Line, q: Sequence[float]) -> float:
    """Distance [m] of a line's side point from the centre of its body."""
    return math.dist(chain.posed(body, q, line).side or body.centre, body.centre)


def _turn(chain: Chain, body: Body, q: Sequence[float], line: Line) -> Turn:
    """How a line passes its body in a pose."""
    return chain.posed(body, q, line).turn(*chain.seen_by(body, q, line))


def _too_near(chain: Chain, run: Run, line: Line, body: Body) -> Iterator[Complaint]:
    """Poses in which a string bends inside a body and has an end so near the surface that its kernels do not converge."""
    for q in chain.poses():
        ends = chain.seen_by(body, q, line)
        if body.bends(*ends) and body.clearance(*ends) <= INSIDE_CLEARANCE:
            nearest = min(map(body.distance, ends)) - body.radius
            where = f"ends {nearest * 1e3:.2g} mm from the surface at {told(chain.finger, q)}, where the string bends"
            yield ("path", run.between or 0), f"{where}; expected 1 % of the radius or more"
            return


def _distance(chain: Chain, body: Body, line: Line, end: int, q: Sequence[float]) -> float:
    """Distance [m] of one end of a line from the axis of a body, or from its centre."""
    return body.distance(chain.seen_by(body, q, line)[end])


def told(finger: Finger, q: Sequence[float]) -> str:
    """A pose in words."""
    places = zip(finger.joints, q, strict=True)
    return ", ".join(
        f"{joint} = {x * 1e3:.4g} mm" if joint in finger.sliding else f"{joint} = {math.degrees(x):.4g} deg"
        for joint, x in places
    )
