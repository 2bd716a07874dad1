"""Joints that slide: units that fit the kind of joint, and what only joints that turn can have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.parts import Coupling, Finger, Keys, Limits, Link
from awiwi_gen.hand.ranges import measures
from awiwi_gen.hand.tick import joint_numbers
from awiwi_gen.units import Quantity, Unit, m, name_of, rad

__all__ = ["limit_complaints", "link_complaints", "misfits"]

Complaint = tuple[Keys, str]

_LIMITS = {
    "slide_velocity": 'a velocity such as "0.5 m/s"',
    "slide_acceleration": 'an acceleration such as "50 m/s^2"',
    "slide_force": 'a force such as "50 N"',
}


def limit_complaints(limits: Limits, fingers: Mapping[str, Finger]) -> Iterator[Complaint]:
    """The limits that a hand with slides needs."""
    sliding = [f"{joint} of {name}" for name, finger in fingers.items() for joint in finger.sliding]
    for key, expected in _LIMITS.items():
        if sliding and getattr(limits, key) is None:
            yield (key,), f"is missing; expected {expected}, because the joint {sliding[0]} slides"


def link_complaints(link: Link) -> Iterator[Complaint]:
    """Numbers of a link in the unit of another kind of joint, friction by the wrong key, and a four-bar at a slide."""
    moves = "slides" if link.slides else "turns"
    numbers = link.quantities()
    for path, measure in measures(link).items():
        if measure.others:
            wanted = measure.others[0] if link.slides else measure
            yield from _misfit(tuple(path.split(".")), numbers[path], wanted, f"the joint {moves}")
    for keys, number, measure in joint_numbers(link):
        yield from _misfit(keys, number, measure.others[0] if link.slides else measure, f"the joint {moves}")
    if link.friction is not None:
        right, wrong = ("force", "torque") if link.slides else ("torque", "force")
        if getattr(link.friction, wrong) is not None:
            yield ("friction", wrong), f'is at a joint that {moves}; expected "{right}"'
        elif getattr(link.friction, right) is None:
            yield (
                ("friction", right),
                f"is missing; expected what dry friction takes up at speed, for the joint {moves}",
            )
    if link.slides and link.four_bar is not None:
        yield ("four_bar",), "is at a joint that slides; expected it at one that turns"


def misfits(finger: Finger) -> Iterator[Complaint]:
    """Pulleys of slides, and arms and couplings in the unit of another kind of joint."""
    for index, pulley in enumerate(finger.pulleys):
        if pulley.joint in finger.sliding:
            yield ("pulleys", index, "joint"), f'= "{pulley.joint}" slides and has no pulley; {_arms(pulley.joint)}'
    for number, tendon in enumerate(finger.tendons):
        for index, over in enumerate(tendon.over):
            if over[1:] in finger.sliding:
                yield ("tendons", number, "over", index), f'= "{over}" slides and has no pulley; {_arms(over[1:])}'
        for joint, arm in tendon.arms.items():
            measure, slides = measures(tendon)[f"arms.{joint}"], joint in finger.sliding
            wanted = measure.others[0] if slides else measure
            yield from _misfit(
                ("tendons", number, "arms", joint), arm, wanted, f"the joint {'slides' if slides else 'turns'}"
            )
    for index, coupling in enumerate(finger.couplings):
        yield from (((("couplings", index, *keys)), message) for keys, message in _coupling(finger, coupling))


def _coupling(finger: Finger, coupling: Coupling) -> Iterator[Complaint]:
    follower, leader = (m if joint in finger.sliding else rad for joint in (coupling.follower, coupling.leader))
    why = f"the follower {_moves(follower)} and the leader {_moves(leader)}"
    if m in (follower, leader) and coupling.ratio is None:
        yield (), f"has no ratio, but {why}, and a slide has no pulley for a passive tendon; expected a ratio"
    numbers = coupling.quantities()
    for key, measure in measures(coupling).items():
        power = ["offset", "ratio", "square", "cube", "fourth"].index(key)
        wanted = measure.of(follower / leader**power)
        if wanted is not None:
            yield from _misfit((key,), numbers[key], wanted, why)


def _misfit(keys: Keys, quantity: Quantity, wanted: Measure, why: str) -> Iterator[Complaint]:
    if not wanted.fits(quantity.unit):
        yield keys, f'= "{quantity}" is {name_of(quantity.unit)}; expected {wanted.expected}, for {why}'


def _moves(unit: Unit) -> str:
    return "slides" if unit == m else "turns"


def _arms(joint: str) -> str:
    return f'expected arms = {{ {joint} = "1" }} of the tendons that it moves'
