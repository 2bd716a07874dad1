"""Physics and cross-references: what no hand can have, although every single value of its file is valid.

Each check yields complaints, `(keys, predicate)` pairs, relative to the table it is given.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol

from awiwi_gen.hand.lint_motors import motor_complaints
from awiwi_gen.hand.lint_paths import misplaced, told, without_length
from awiwi_gen.hand.lint_slides import limit_complaints, link_complaints, misfits
from awiwi_gen.hand.lint_tick import joint_complaints
from awiwi_gen.hand.massless import without_inertia
from awiwi_gen.hand.parts import PALM, Finger, FourBar, Keys, Limits, Link, Part, covers
from awiwi_gen.hand.pose import Chain
from awiwi_gen.hand.tensors import tensor_complaints
from awiwi_gen.hand.wrist import Wrist, closure
from awiwi_gen.units import Quantity

__all__ = ["Complaint", "below", "complaints", "sources"]

Complaint = tuple[Keys, str]

_CLOSURE_STEPS = 1000
_NARROWEST_RANGE = 0.01  # deg; less than the backlash of any joint
_SHORTEST_TRAVEL = 1e-6  # m; the same of a slide
_BODY = {
    "mass": 'a mass such as "1.5 g"',
    "com": 'a point such as ["6 mm", "0 mm", "0 mm"]',
    "inertia": 'a tensor such as { xx = "35 g mm^2", ... }',
}
_LEAST_ARM = 1e-7  # m; a tendon with less than this about every joint pulls nothing


def complaints(limits: Limits, fingers: Mapping[str, Finger], wrist: Wrist | None = None) -> Iterator[Complaint]:
    """All faults of a hand whose single values are valid."""
    yield from below(("limits",), _limits(limits))
    yield from below(("limits",), limit_complaints(limits, fingers))
    for name, finger in fingers.items():
        yield from below(("fingers", name), _finger(finger))
    yield from tensor_complaints(fingers)
    if wrist:
        yield from below(("wrist",), _wrist(wrist, sum(len(finger.transmissions) for finger in fingers.values())))


class Sourced(Protocol):
    """A part of a hand that has the sources of its numbers."""

    @property
    def source(self) -> str | dict[str, str]:
        """One source for all numbers, or one for each key."""

    def sources(self) -> dict[str, str]:
        """The source of every number below, by path."""


def below(keys: Keys, found: Iterable[Complaint]) -> Iterator[Complaint]:
    """The complaints about a part, with `keys`, the path of the part, in front of their own."""
    return (((*keys, *inner), message) for inner, message in found)


def _limits(limits: Limits) -> Iterator[Complaint]:
    yield from sources(limits)
    yield from _upside_down(limits, "tendon_stiffness_low", "tendon_stiffness_high")


def _upside_down(part: Part, low: str, high: str) -> Iterator[Complaint]:
    bottom, top = getattr(part, low), getattr(part, high)
    if bottom.value >= top.value:
        yield (low,), f'= "{bottom}" is not below {high} = "{top}"'


def _range(part: Part, slides: bool = False) -> Iterator[Complaint]:
    """The range of an angle, or of the position of a slide, from `low` to `high`."""
    yield from _upside_down(part, "low", "high")
    low, high = part.low, part.high  # type: ignore[attr-defined]
    width = float(high.value - low.value)
    shown, least, unit = (
        (width * 1e3, _SHORTEST_TRAVEL * 1e3, "mm") if slides else (math.degrees(width), _NARROWEST_RANGE, "deg")
    )
    if 0 < shown < least:
        found = f'= "{high}" leaves a range of {shown:.2g} {unit} from low = "{low}"'
        yield ("high",), f"{found}; expected {least:g} {unit} or more"


def _wrist(wrist: Wrist, tendons: int) -> Iterator[Complaint]:
    yield from sources(wrist)
    if len(wrist.tendons) != tendons:
        yield ("tendons",), f"has {len(wrist.tendons)} entries, but {tendons} tendons of the fingers pass here"
    swings = {"q71": wrist.q71, "q73": wrist.q73}.items()
    backwards = [fault for key, swing in swings for fault in below((key,), _range(swing))]
    yield from backwards or closure(wrist)


def _finger(finger: Finger) -> Iterator[Complaint]:
    for index, link in enumerate(finger.links):
        yield from below(("links", index), _link(link, link.joint in finger.leaders))
    for index, pulley in enumerate(finger.pulleys):
        yield from below(("pulleys", index), sources(pulley))
    for index, tendon in enumerate(finger.tendons):
        yield from below(("tendons", index), sources(tendon))
    if finger.base:
        yield from below(("base",), sources(finger.base))
    misnamed = [*_names(finger), *misfits(finger)]
    yield from misnamed
    unfit = [complaint for link in finger.links for complaint in link_complaints(link)]
    limited = all(link.low and link.high for link in finger.links if link.joint in finger.joints)
    if limited and not (misnamed or unfit):
        yield from _tendons(finger)
        yield from _singular(finger)


# ---------------------------------------------------------------------------------------------------- names


def _names(finger: Finger) -> Iterator[Complaint]:
    """Joints are unique, and whatever names a joint or a pulley names one that exists."""
    joints = [link.joint for link in finger.links]
    for index, joint in enumerate(joints):
        if joint in joints[:index]:
            yield ("links", index, "joint"), f'= "{joint}" is the joint of links[{joints.index(joint)}] already'
    pulleys = [pulley.joint for pulley in finger.pulleys]
    for index, joint in enumerate(pulleys):
        keys: Keys = ("pulleys", index, "joint")
        if joint in pulleys[:index]:
            yield keys, f'= "{joint}" has a pulley already, pulleys[{pulleys.index(joint)}]'
        yield from _known(keys, joint, joint, joints, "joint")
    for number, tendon in enumerate(finger.tendons):
        over = [name[1:] for name in tendon.over]
        for index, name in enumerate(tendon.over):
            keys = ("tendons", number, "over", index)
            if name[1:] in over[:index]:
                yield keys, f'= "{name}" comes twice in one tendon'
            if name[1:] not in finger.sliding:
                yield from _known(keys, name, name[1:], pulleys, "pulley")
        for name in tendon.arms:
            yield from _known(("tendons", number, "arms", name), name, name, joints, "joint")
        for index, point in enumerate(tendon.path):
            keys = ("tendons", number, "path", index, "link")
            yield from _known(keys, point.link, point.link, [*joints, PALM], "link")
            if point.side_link is not None:
                side_keys = (*keys[:-1], "side_link")
                yield from _known(side_keys, point.side_link, point.side_link, [*joints, PALM], "link")
            if point.link == PALM in joints:
                yield keys, f'= "{PALM}" is the base frame, and a joint of this finger; rename the joint'
        yield from below(("tendons", number), misplaced(tendon))
        if not (tendon.over or tendon.arms or tendon.span or tendon.path):
            yield ("tendons", number), "has neither over nor arms nor span nor path; it would pull nothing"
        if tendon.span:
            keys, end = ("tendons", number, "span", "joint"), tendon.span.joint
            yield from _known(keys, end, end, joints, "joint")
            if end == joints[0]:
                yield keys, f'= "{end}" is fixed in the palm; no joint moves it'
    yield from _couplings(finger, joints, pulleys)


def _couplings(finger: Finger, joints: list[str], pulleys: list[str]) -> Iterator[Complaint]:
    followers = [coupling.follower for coupling in finger.couplings]
    for index, coupling in enumerate(finger.couplings):
        for role, joint in (("follower", coupling.follower), ("leader", coupling.leader)):
            keys: Keys = ("couplings", index, role)
            yield from _known(keys, joint, joint, joints, "joint")
            if joint in joints and joint not in finger.sliding and coupling.ratio is None:
                yield from _known(keys, joint, joint, pulleys, "pulley")
        if coupling.powers and coupling.ratio is None:
            yield ("couplings", index), 'has powers without a ratio; expected one, such as "1", or "0"'
        if coupling.ratio is not None and coupling.ratio.value == 0 and not coupling.powers:
            yield ("couplings", index, "ratio"), f'= "{coupling.ratio}" holds the follower; expected another number'
        if coupling.follower in followers[:index]:
            yield ("couplings", index, "follower"), f'= "{coupling.follower}" follows another joint already'
        if coupling.leader == coupling.follower:
            yield ("couplings", index, "leader"), f'= "{coupling.leader}" is its own follower'
        elif coupling.leader in followers:
            yield ("couplings", index, "leader"), f'= "{coupling.leader}" follows another joint itself; name that one'


def _known(keys: Keys, shown: str, name: str, known: list[str], kind: str) -> Iterator[Complaint]:
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f'did you mean "{near[0]}"?' if near else f"known here: {', '.join(dict.fromkeys(known)) or 'none'}"
        yield keys, f'= "{shown}" names no {kind} of this finger; {hint}'


def sources(part: Sourced) -> Iterator[Complaint]:
    """Each number has a source, and each source has a number."""
    known = part.sources()
    if isinstance(part.source, dict):
        for key in part.source:
            if key != "default" and not any(covers(key, path) for path in known):
                near = difflib.get_close_matches(key, [path.partition("[")[0] for path in known], n=1)
                hint = f'; did you mean "{near[0]}"?' if near else ""
                yield ("source", *key.split(".")), f"is the source of no number here{hint}"
        if silent := [path for path, text in known.items() if not text]:
            yield ("source",), f'has no entry for "{silent[0]}"; add it, or a default'


# ---------------------------------------------------------------------------------------------------- links


def _link(link: Link, follows: bool) -> Iterator[Complaint]:
    yield from sources(link)
    wrong = [*link_complaints(link)]
    yield from wrong
    for key in ("low", "high"):
        given = getattr(link, key)
        if given is None and not follows:
            expected = 'a length such as "12 mm"' if link.slides else 'an angle such as "20 deg"'
            yield (key,), f"is missing; expected {expected} (only a joint that follows another has none)"
        if given is not None and follows:
            yield (key,), f'= "{given}" is one too many: this joint follows another, which has the range'
    if link.low and link.high and not follows and not wrong:
        yield from _range(link, link.slides)
    yield from _body(link)
    if not wrong:
        yield from joint_complaints(link, follows)
    if link.four_bar and not wrong:
        yield from below(("four_bar",), sources(link.four_bar))
        if link.reference is not None:
            yield ("reference",), f'= "{link.reference}" is at a four-bar, whose angles count from four_bar.reference'
        if follows:
            yield ("four_bar",), "is at a joint that follows another; it needs an independent joint"
        elif link.low and link.high:
            yield from below(("four_bar",), _closure(link.four_bar, link.low, link.high))


def _body(link: Link) -> Iterator[Complaint]:
    """A link has all that makes a body, or nothing of it."""
    present = [key for key in _BODY if getattr(link, key) is not None]
    if present:
        for key in (key for key in _BODY if key not in present):
            beside = " and ".join(present)
            yield (key,), f"is missing; expected {_BODY[key]} beside {beside} (a link without mass has none of them)"


def _closure(bar: FourBar, low: Quantity, high: Quantity) -> Iterator[Complaint]:
    """The linkage closes, short of its dead points, over the whole range of its joint."""
    ground, crank, coupler, rocker = (float(side) for side in (bar.ground, bar.crank, bar.coupler, bar.rocker))
    shortest, longest = abs(coupler - rocker), coupler + rocker
    for step in range(_CLOSURE_STEPS + 1):
        joint = float(low) + (float(high) - float(low)) * step / _CLOSURE_STEPS
        angle = float(bar.reference) + joint
        gap = math.sqrt(max(0.0, ground**2 + crank**2 - 2 * ground * crank * math.cos(angle)))
        if not shortest * (1 + 1e-6) < gap < longest * (1 - 1e-6):
            angles = f"a joint angle of {math.degrees(joint):.4g} deg (crank at {math.degrees(angle):.4g} deg)"
            bridge = f"coupler and rocker bridge {shortest * 1e3:.4g} to {longest * 1e3:.4g} mm, not {gap * 1e3:.4g} mm"
            yield (), f"does not close at {angles}: {bridge}"
            return


def _singular(finger: Finger) -> Iterator[Complaint]:
    """Every motion moves some inertia: else accelerations do not exist."""
    if found := without_inertia(finger):
        joint, q = found
        keys: Keys = ("links", [link.joint for link in finger.links].index(joint), "joint")
        need = "expected mass, com and inertia for a link that only this joint moves, or armature"
        yield keys, f'= "{joint}" moves no inertia of its own at {told(finger, q)}; {need}'


# ---------------------------------------------------------------------------------------------------- tendons


def _tendons(finger: Finger) -> Iterator[Complaint]:
    """Every tendon moves with some joint, and straight lines have a length in every pose, as derivatives need."""
    chain = Chain(finger)
    arms = [*chain.couplings()]
    for index, tendon in enumerate(finger.tendons):
        short = [*without_length(chain, index)]
        yield from below(("tendons", index), short)
        if not short and max(abs(arm) for coupling in arms for arm in coupling[index]) < _LEAST_ARM:
            yield ("tendons", index), "pulls nothing: its length is the same in every pose"
        if tendon.spring and not short and (longest := chain.longest(index)) <= float(tendon.spring.rest):
            slack = f'= "{tendon.spring.rest}" leaves the string slack in every pose'
            yield (
                ("tendons", index, "spring", "rest"),
                f"{slack}; expected less than its length, {longest * 1e3:.4g} mm",
            )
    yield from motor_complaints(finger, arms)
