"""A hand file as text, from a draft: commented, with the source of each number."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from decimal import Decimal

from awiwi_gen.interchange.draft import DraftFinger, DraftHand, DraftLink, DraftPalm, DraftTendon
from awiwi_gen.interchange.frames import rpy_of
from awiwi_gen.interchange.loss import loss_lines
from awiwi_gen.interchange.mimics import Followed
from awiwi_gen.interchange.model import Array, Place
from awiwi_gen.units import m, rad

NOISE = 2e-15
"""What rounding leaves of a number, relative to the largest in its vector."""
_LIMITS = {
    "joint_velocity": "20 rad/s",
    "joint_acceleration": "2000 rad/s^2",
    "joint_torque": "1 N m",
    "tendon_force": "100 N",
    "tendon_stiffness_low": "1000 N/m",
    "tendon_stiffness_high": "50000 N/m",
    "gravity": "9.81 m/s^2",
}
_SLIDE_LIMITS = {"slide_velocity": "0.5 m/s", "slide_acceleration": "50 m/s^2", "slide_force": "50 N"}
_MOST_EFFORT = 1000.0  # N m, or N of a slide; larger ones stand in files for joints without a limit
_FRICTION_VELOCITY, _SLIDE_FRICTION_VELOCITY = "0.05 rad/s", "2 mm/s"
_POWERS = ("square", "cube", "fourth")
_RULE = "# " + "-" * 100


def hand_text(hand: DraftHand, command: str = "") -> str:
    """The hand file of a draft."""
    lines = [f"# {hand.name}, imported from {hand.file}{' by ' + command if command else ''}."]
    lines += [f"# The palm is the body {hand.palm}; each finger's base frame is given in the palm's frame.", "#"]
    lines += [f"# name: {old} -> {new}" for old, new in hand.names.items()]
    lines += [f"# taken: {note}" for note in hand.notes]
    lines += [f"# {line}" for line in loss_lines(hand.losses)]
    lines += ["", f"prefix = {_text(hand.prefix)}", f"name = {_text(cite(hand.name))}", "", "[limits]"]
    lines += _limit_lines(hand)
    if hand.wrist is not None:
        lines += ["", _RULE, *_palm_lines(hand.wrist, hand)]
    for finger in hand.fingers:
        lines += ["", _RULE, *_finger_lines(finger, hand.file)]
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _limit_lines(hand: DraftHand) -> list[str]:
    """Ranges of the kernels' inputs: what the model says of motors and joints, and guesses."""
    links = [link for finger in hand.fingers for link in finger.links]
    limits = _LIMITS | (_SLIDE_LIMITS if any(finger.sliding for finger in hand.fingers) else {})
    known = {}
    for key, unit, slides in (("joint_torque", "N m", False), ("slide_force", "N", True)):
        most = max((_effort(link) for link in links if link.slides == slides), default=0.0)
        if most > 0:
            limits[key], known[key] = quantity(most, unit), cite(f"{hand.file} joints")
    if hand.tendon_force:
        limits["tendon_force"], known["tendon_force"] = quantity(hand.tendon_force, "N"), cite(f"{hand.file} actuators")
    lines = [f"{key} = {_text(value)}" for key, value in limits.items()]
    return [*lines, f"source = {_sources(known, 'assumed')}"]


def _effort(link: DraftLink) -> float:
    """The largest torque [N m] or force [N] of an independent joint.

    It is 0 where the model says none, or one that no joint of a hand has.
    """
    effort = link.published.effort if link.limits else 0.0
    return effort if effort <= _MOST_EFFORT else 0.0


def cite(text: str) -> str:
    """Text that may stand in a comment of C, at most 80 characters."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    for bad, good in (("*/", "* /"), ("/*", "/ *"), ("\\", "/"), ("??", "?")):
        shown = shown.replace(bad, good)
    return (shown if len(shown) <= 80 else shown[:77] + "...") or "unnamed"


def _palm_lines(palm: DraftPalm, hand: DraftHand) -> list[str]:
    source = _text(cite(f"{hand.file} body {palm.carrier}"))
    lines = [f"# the wrist: {len(palm.joints)} joints between the body {palm.carrier} and the palm", "", "[palm]"]
    lines += [f"rpy = {_rpy(palm.end)}", f"source = {_text(cite(f'{hand.file} body {hand.palm}'))}"]
    lines += ["", "[palm.base]", f"position = {_lengths(palm.position)}", f"rpy = {_rpy(palm.axes)}"]
    lines += [f"source = {source}"]
    for joint in palm.joints:
        sources = dict.fromkeys(joint.assumed, "assumed")
        lines += ["", "[[palm.joints]]", *_place_lines(joint)]
        lines += [f"source = {_sources(sources, cite(f'{hand.file} joint {joint.published.name}'))}"]
    return lines


def _rpy(axes: Array) -> str:
    return _listed(angle(each, NOISE) for each in tidy(rpy_of(axes), 1.0))


def _finger_lines(finger: DraftFinger, file: str) -> list[str]:
    head = f"fingers.{finger.name}"
    lines = [f"# {finger.name}: {len(finger.links)} links, {len(finger.tendons)} tendons", "", f"[{head}]"]
    if finger.followed:
        lines += ["couplings = [", *(f"    {{ {_coupling(each, finger.sliding)} }}," for each in finger.followed), "]"]
    if finger.pulleys:
        source = _text(cite(f"{file} arms of tendons"))
        rows = (f"joint = {_text(joint)}, radius = {_text(length(r))}" for joint, r in finger.pulleys.items())
        lines += ["pulleys = [", *(f"    {{ {row}, source = {source} }}," for row in rows), "]"]
    lines += ["", f"[{head}.base]", f"position = {_lengths(finger.position)}"]
    lines += [f"rpy = {_rpy(finger.axes)}"]
    lines += [f"source = {_text(cite(f'{file} body {finger.carrier}'))}"]
    for link in finger.links:
        lines += ["", f"[[{head}.links]]", *_link_lines(link, file)]
    for tendon in finger.tendons:
        lines += ["", f"[[{head}.tendons]]", *_tendon_lines(tendon, file, finger.sliding)]
    return lines


def _coupling(mimic: Followed, sliding: set[str]) -> str:
    follower, leader = (m if joint in sliding else rad for joint in (mimic.follower, mimic.leader))

    def coefficient(value: float, power: int) -> str:
        return quantity(value, (follower / leader**power).label).removesuffix(" 1")

    ratio, offset = coefficient(mimic.ratio, 1), mimic.offset
    more = f', offset = "{place(offset, mimic.follower in sliding)}"' if offset else ""
    for power, (key, value) in enumerate(zip(_POWERS, mimic.powers, strict=False), start=2):
        more += f', {key} = "{coefficient(value, power)}"' if value else ""
    return f'follower = "{mimic.follower}", leader = "{mimic.leader}", ratio = "{ratio}"{more}'


def _place_lines(link: DraftLink) -> list[str]:
    """The joint of a link: its name, what leads to its frame, its limits, and its offset."""
    lines = [f"joint = {_text(link.joint)}", *(['kind = "slide"'] if link.slides else [])]
    if link.frame.turn != "none" or not link.frame.roll:
        lines += [f"turn = {_text(link.frame.turn)}"]
    roll, yaw = tidy([link.frame.roll, link.frame.yaw], 1.0)
    if roll or yaw:
        lines += [f"rpy = {_listed(map(angle, (roll, 0.0, yaw)))}"]
    if reference := tidy([link.reference], 1.0)[0]:
        lines += [f"reference = {_text(place(reference, link.slides))}"]
    if link.limits:
        ends = zip(("low", "high"), link.limits, strict=True)
        lines += [f"{key} = {_text(place(x, link.slides))}" for key, x in ends]
    return [*lines, f"offset = {_lengths(link.offset)}"]


def _link_lines(link: DraftLink, file: str) -> list[str]:
    joint, body = link.published, cite(f"{file} body {link.body}")
    lines = _place_lines(link)
    sources = dict.fromkeys(link.assumed, "assumed")
    if link.mass is not None:
        lines += [f"{key} = {each}" for key, each in mass_and_inertia(link.mass, link.com, link.inertia).items()]
        sources |= {key: sources.get(key, body) for key in ("mass", "com", "inertia")}
    inertia, torque, unit = ("kg", "N", "m") if link.slides else ("kg m^2", "N m", "rad")
    if joint.armature:
        lines += [f"armature = {_text(quantity(joint.armature, inertia))}"]
    if joint.damping:
        lines += [f"damping = {_text(quantity(joint.damping, f'{torque} s/{unit}'))}"]
    if joint.friction:
        key, velocity = ("force", _SLIDE_FRICTION_VELOCITY) if link.slides else ("torque", _FRICTION_VELOCITY)
        lines += [f'friction = {{ {key} = "{quantity(joint.friction, torque)}", velocity = "{velocity}" }}']
        sources["friction.velocity"] = "assumed"
    if joint.stiffness:
        reference_text = place(tidy([link.spring_reference], 1.0)[0], link.slides)
        stiffness = quantity(joint.stiffness, f"{torque}/{unit}")
        lines += [f'spring = {{ stiffness = "{stiffness}", reference = "{reference_text}" }}']
    if effort := _effort(link):
        lines += [f"effort = {_text(quantity(effort, torque))}"]
    if joint.measured:
        lines += ["sensor = {}"]
    return [*lines, f"source = {_sources(sources, cite(f'{file} joint {joint.name}'))}"]


def _tendon_lines(tendon: DraftTendon, file: str, sliding: set[str]) -> list[str]:
    lines = [f"rest = {_text(length(tidy([tendon.rest], 0.1)[0]))}"]
    if tendon.over:
        lines += [f"over = {_listed(tendon.over)}"]
    if tendon.arms:
        arms = ", ".join(
            f"{joint} = {_text(quantity(arm, '').rstrip() if joint in sliding else length(arm))}"
            for joint, arm in tendon.arms.items()
        )
        lines += [f"arms = {{ {arms} }}"]
    if tendon.path:
        lines += ["path = ["]
        lines += [f"    {_place(*each)}," for each in tendon.path]
        lines += ["]"]
    if tendon.stiffness:
        stiffness, rest = quantity(tendon.stiffness, "N/m"), length(tendon.slack)
        lines += [f'spring = {{ stiffness = "{stiffness}", rest = "{rest}" }}']
    if tendon.motor:
        name, ratio = tendon.motor
        lines += [f'motor = {{ name = "{name}", ratio = "{quantity(ratio, "").strip()}" }}']
    return [*lines, f"source = {_text(cite(f'{file} tendon {tendon.name}'))}"]


def _place(link: str, place: Place, side_link: str | None) -> str:
    keys = {"link": _text(link), "at": _lengths(place.at)}
    if place.radius is not None:
        keys["radius"] = _text(length(place.radius))
    if place.axis is not None:
        keys["axis"] = _listed(quantity(each, "").rstrip() for each in tidy(place.axis, 1.0))
    if place.side is not None:
        keys["side"] = _lengths(place.side)
    if side_link is not None:
        keys["side_link"] = _text(side_link)
    if place.inside:
        keys["inside"] = "true"
    if place.divisor is not None:
        keys["divisor"] = _text(quantity(place.divisor, "").rstrip())
    return f"{{ {', '.join(f'{key} = {value}' for key, value in keys.items())} }}"


def _sources(special: dict[str, str], default: str) -> str:
    if not special:
        return _text(default)
    rows = [f"{key} = {_text(value)}" for key, value in special.items()]
    return f"{{ {', '.join(rows)}, default = {_text(default)} }}"


# -- numbers ---------------------------------------------------------------------------------------------------------


def tidy(values: Iterable[float] | Array, scale: float = 0.0) -> list[float]:
    """Numbers without what rounding left: -3e-18 beside 0.045 is zero, 0.04500000000000001 is 0.045."""
    numbers = [float(value) for value in values]
    noise = NOISE * max([scale, *map(abs, numbers)])
    short = [next(s for digits in (12, 17) if abs((s := float(f"{x:.{digits}g}")) - x) <= noise) for x in numbers]
    return [0.0 if abs(x) <= noise else x for x in short]


def quantity(value: float, unit: str, power: int = 0) -> str:
    """A number of an SI unit in a unit that is 10^power times smaller, to the last digit of the double."""
    exact = Decimal(repr(float(value))).scaleb(power)
    text = f"{exact.normalize():f}" if exact and -8 < exact.adjusted() < 12 else f"{exact.normalize() + 0:e}"
    return f"{'0' if not exact else text} {unit}"


def length(metres: float) -> str:
    """A length in millimetres."""
    return quantity(metres, "mm", 3)


def mass(kilograms: float) -> str:
    """A mass in grams."""
    return quantity(kilograms, "g", 3)


def angle(radians: float, noise: float = 2e-16) -> str:
    """An angle in degrees if it has at most ten digits there, up to noise, else in radians."""
    degrees = float(f"{math.degrees(radians):.10g}")
    if abs(math.radians(degrees) - radians) <= noise * max(1.0, abs(radians)):
        return quantity(degrees, "deg")
    return quantity(radians, "rad")


def place(value: float, slides: bool) -> str:
    """An angle [rad], or the position of a slide [m]."""
    return length(value) if slides else angle(value)


def mass_and_inertia(kilograms: float, com: Array, inertia: Array) -> dict[str, str]:
    """The keys of a body, as TOML: mass, com (3) and the tensor about it (3 x 3), in SI."""
    return {"mass": _text(mass(kilograms)), "com": _lengths(com), "inertia": _tensor(inertia)}


def _lengths(values: Array) -> str:
    return _listed(map(length, tidy(values, 0.01)))


def _tensor(tensor: Array) -> str:
    symmetric = (tensor + tensor.T) / 2
    names = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    values = tidy([symmetric[place] for place in names.values()])
    rows = [f'{name} = "{quantity(value, "g mm^2", 9)}"' for name, value in zip(names, values, strict=True)]
    return f"{{ {', '.join(rows)} }}"


def _listed(texts: Iterable[str]) -> str:
    return f"[{', '.join(map(_text, texts))}]"


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)
