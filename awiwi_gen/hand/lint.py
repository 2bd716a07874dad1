"""Physics and cross-references: what a schema cannot see in a hand file.

Each check yields complaints, `(keys, predicate)` pairs, relative to the table it was given. Arithmetic is exact where
the numbers allow it, so that a flat plate, whose moments fulfil xx + yy = zz, is not refused for a rounding error.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Protocol

from awiwi_gen.hand.parts import Finger, FourBar, Keys, Limits, Link, Part, covers
from awiwi_gen.hand.wrist import Wrist, closure
from awiwi_gen.units import Quantity

__all__ = ["Complaint", "below", "complaints", "sources"]

Complaint = tuple[Keys, str]
Tensor = dict[str, Fraction]

_SLIPS = [Fraction(10) ** places for places in (-3, -2, -1, 1, 2, 3)]
_CLOSURE_STEPS = 1000
_WIDEST_GYRATION = 1.0  # m; with a plausible mass and a plausible moment, their ratio can still be absurd


def complaints(limits: Limits, fingers: Mapping[str, Finger], wrist: Wrist | None = None) -> Iterator[Complaint]:
    """All that is wrong with a hand whose single values are all right."""
    yield from below(("limits",), _limits(limits))
    for name, finger in fingers.items():
        yield from below(("fingers", name), _finger(finger))
    if wrist:
        yield from below(("wrist",), _wrist(wrist, sum(len(finger.tendons) for finger in fingers.values())))


class Sourced(Protocol):
    """A part of a hand that tells where its numbers come from."""

    @property
    def source(self) -> str | dict[str, str]:
        """One source for all numbers, or one for each key."""

    def sources(self) -> dict[str, str]:
        """The source of every number below, by path."""


def below(keys: Keys, found: Iterable[Complaint]) -> Iterator[Complaint]:
    """The complaints of a part, as those of the whole that has it at `keys`."""
    return (((*keys, *inner), message) for inner, message in found)


def _limits(limits: Limits) -> Iterator[Complaint]:
    yield from sources(limits)
    yield from _upside_down(limits, "tendon_stiffness_low", "tendon_stiffness_high")


def _upside_down(part: Part, low: str, high: str) -> Iterator[Complaint]:
    bottom, top = getattr(part, low), getattr(part, high)
    if bottom.value >= top.value:
        yield (low,), f'= "{bottom}" is not below {high} = "{top}"'


def _wrist(wrist: Wrist, tendons: int) -> Iterator[Complaint]:
    yield from sources(wrist)
    if len(wrist.tendons) != tendons:
        yield ("tendons",), f"has {len(wrist.tendons)} entries, but {tendons} tendons of the fingers pass here"
    swings = {"q71": wrist.q71, "q73": wrist.q73}.items()
    backwards = [fault for key, swing in swings for fault in below((key,), _upside_down(swing, "low", "high"))]
    yield from backwards or closure(wrist)


def _finger(finger: Finger) -> Iterator[Complaint]:
    for index, link in enumerate(finger.links):
        yield from below(("links", index), _link(link, follows=link.joint in finger.leaders))
    for index, pulley in enumerate(finger.pulleys):
        yield from below(("pulleys", index), sources(pulley))
    for index, tendon in enumerate(finger.tendons):
        yield from below(("tendons", index), sources(tendon))
    misnamed = [*_names(finger)]
    yield from misnamed
    if not misnamed:  # who pulls what can only be told when every name has its joint
        yield from _drive(finger)


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
            yield from _known(keys, name, name[1:], pulleys, "pulley")
        if not tendon.over and not tendon.span:
            yield ("tendons", number), "neither winds over a pulley nor has a span; it would pull nothing"
        if tendon.span:
            keys, end = ("tendons", number, "span", "joint"), tendon.span.joint
            yield from _known(keys, end, end, joints, "joint")
            if end == joints[0]:
                yield keys, f'= "{end}" stands still in the palm; no joint moves it'
    yield from _couplings(finger, joints, pulleys)


def _couplings(finger: Finger, joints: list[str], pulleys: list[str]) -> Iterator[Complaint]:
    followers = [coupling.follower for coupling in finger.couplings]
    for index, coupling in enumerate(finger.couplings):
        for role, joint in (("follower", coupling.follower), ("leader", coupling.leader)):
            keys: Keys = ("couplings", index, role)
            yield from _known(keys, joint, joint, joints, "joint")
            if joint in joints:
                yield from _known(keys, joint, joint, pulleys, "pulley")
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
    told = part.sources()
    if isinstance(part.source, dict):
        for key in part.source:
            if key != "default" and not any(covers(key, path) for path in told):
                near = difflib.get_close_matches(key, [path.partition("[")[0] for path in told], n=1)
                hint = f'; did you mean "{near[0]}"?' if near else ""
                yield ("source", *key.split(".")), f"is the source of no number here{hint}"
        if silent := [path for path, text in told.items() if not text]:
            yield ("source",), f'says nothing of "{silent[0]}"; add it, or a default'


# ---------------------------------------------------------------------------------------------------- links


def _link(link: Link, follows: bool) -> Iterator[Complaint]:
    yield from sources(link)
    for key in ("low", "high"):
        given = getattr(link, key)
        if given is None and not follows:
            yield (key,), 'is missing; expected an angle such as "20 deg" (only a joint that follows another has none)'
        if given is not None and follows:
            yield (key,), f'= "{given}" is one too many: this joint follows another, which has the range'
    if link.low and link.high and not follows:
        yield from _upside_down(link, "low", "high")
    yield from below(("inertia",), _inertia(link))
    if link.four_bar:
        yield from below(("four_bar",), sources(link.four_bar))
        if follows:
            yield ("four_bar",), "turns with a joint that follows another; it needs a joint of its own"
        elif link.low and link.high:
            yield from below(("four_bar",), _closure(link.four_bar, link.low, link.high))


def _inertia(link: Link) -> Iterator[Complaint]:
    given: dict[str, Quantity] = {key: getattr(link.inertia, key) for key, _, _ in link.inertia.entries()}
    tensor = {key: quantity.value for key, quantity in given.items()}
    gyration = math.sqrt((tensor["xx"] + tensor["yy"] + tensor["zz"]) / (2 * link.mass.value))
    if gyration > _WIDEST_GYRATION:
        yield (), f"is too large for a mass of {link.mass}: radius of gyration {gyration:.3g} m"
    if _is_of_a_body(tensor):
        return
    # Moving one decimal point may mend it. Of several ways the likeliest moves it by one place, in a moment rather than
    # a product, and leaves a bone: a rod from the joint, with its centre c half way, has m (2 c)^2 / 12 across.
    rod = link.mass.value * sum(c.value**2 for c in link.com) / 3 or Fraction(1)
    ways = []
    for key, value in tensor.items():
        for factor in _SLIPS:
            mended = tensor | {key: value * factor}
            if _is_of_a_body(mended):
                across = (mended["xx"] + mended["yy"] + mended["zz"]) / 2
                by_one = factor in (10, Fraction(1, 10))
                ways.append((not by_one, key[0] != key[1], abs(math.log(across / rod)), key, factor))
    message = "breaks the triangle inequality of the principal moments: no body is like that"
    if not ways:
        yield (), message
        return
    *_, key, factor = min(ways)
    much = f"{1 / factor} times too large" if factor < 1 else f"{factor} times too small"
    yield (key,), f'= "{given[key]}" {message}; {key} is probably {much} (a slipped decimal point?)'


def _is_of_a_body(inertia: Tensor) -> bool:
    """Whether some distribution of mass has this tensor.

    I = tr(S) E - S with the second moments S = integral of r r^T dm, so a body has S >= 0: that is the triangle
    inequality of the principal moments, without finding them. The sums of products of the eigenvalues of S (its
    invariants) tell: none may be negative, and the second one is zero only for a needle, whose inertia is singular.
    """
    d, e, f = (-inertia[key] for key in ("xy", "xz", "yz"))
    total = (inertia["xx"] + inertia["yy"] + inertia["zz"]) / 2
    a, b, c = (total - inertia[key] for key in ("xx", "yy", "zz"))
    pairs = a * b + a * c + b * c - d**2 - e**2 - f**2
    determinant = a * b * c + 2 * d * e * f - a * f**2 - b * e**2 - c * d**2
    return total > 0 and pairs > 0 and determinant >= 0


def _closure(bar: FourBar, low: Quantity, high: Quantity) -> Iterator[Complaint]:
    """The linkage closes, short of its dead points, over the whole range of its joint."""
    ground, crank, coupler, rocker = (float(side) for side in (bar.ground, bar.crank, bar.coupler, bar.rocker))
    shortest, longest = abs(coupler - rocker), coupler + rocker
    for step in range(_CLOSURE_STEPS + 1):
        joint = float(low) + (float(high) - float(low)) * step / _CLOSURE_STEPS
        turned = float(bar.reference) + joint
        gap = math.sqrt(max(0.0, ground**2 + crank**2 - 2 * ground * crank * math.cos(turned)))
        if not shortest * (1 + 1e-6) < gap < longest * (1 - 1e-6):
            angles = f"a joint angle of {math.degrees(joint):.4g} deg (crank at {math.degrees(turned):.4g} deg)"
            bridge = f"coupler and rocker bridge {shortest * 1e3:.4g} to {longest * 1e3:.4g} mm, not {gap * 1e3:.4g} mm"
            yield (), f"does not close at {angles}: {bridge}"
            return


# ---------------------------------------------------------------------------------------------------- tendons


def _drive(finger: Finger) -> Iterator[Complaint]:
    """Tendons only pull, so each independent joint needs one on either side; together they must tell joints apart."""
    order = [link.joint for link in finger.links]
    spanned = {joint for tendon in finger.tendons if tendon.span for joint in order[: order.index(tendon.span.joint)]}
    by_pulleys = [joint for joint in finger.joints if joint not in spanned]
    # A follower turns by r_leader / r_follower, so on its pulley a tendon runs as far as on its leader's: senses add.
    senses = [[0] * len(by_pulleys) for _ in finger.tendons]
    for row, tendon in zip(senses, finger.tendons, strict=True):
        for name in tendon.over:
            joint = finger.leaders.get(name[1:], name[1:])
            if joint in by_pulleys:
                row[by_pulleys.index(joint)] += 1 if name[0] == "+" else -1
    idle = False
    for column, joint in enumerate(by_pulleys):
        pulls = {"+": any(row[column] > 0 for row in senses), "-": any(row[column] < 0 for row in senses)}
        missing = [f'"{sign}{joint}"' for sign, pulled in pulls.items() if not pulled]
        if missing:
            idle = True
            need = f"has no tendon over {' nor '.join(missing)}; tendons only pull, so a joint needs both senses"
            yield ("links", order.index(joint), "joint"), f'= "{joint}" {need}'
    rank = _rank([[Fraction(sense) for sense in row] for row in senses])
    if not idle and rank < len(by_pulleys):
        joints = f"{rank} of the {len(by_pulleys)} joints {', '.join(by_pulleys)}"
        yield ("tendons",), f"move only {joints} independently; their lengths would not tell the joint angles"


def _rank(rows: list[list[Fraction]]) -> int:
    """Rank of a matrix, by elimination without rounding."""
    rank = 0
    for column in range(len(rows[0]) if rows else 0):
        pivot = next((row for row in rows[rank:] if row[column]), None)
        if pivot is None:
            continue
        rows.remove(pivot)
        rows.insert(rank, pivot)
        for below in range(rank + 1, len(rows)):
            factor = rows[below][column] / pivot[column]
            rows[below] = [a - factor * b for a, b in zip(rows[below], pivot, strict=True)]
        rank += 1
    return rank
