"""A hand as URDF: links and joints, with mimic joints for those that follow others. URDF has no tendons."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from awiwi_gen.hand import Finger, Hand, Link
from awiwi_gen.interchange.export import (
    Part,
    common_losses,
    coupler_losses,
    coupler_of,
    document,
    palm_parts,
    parts,
    rpy_matrix,
    text,
    value,
    vector,
)
from awiwi_gen.interchange.fits import coupler_fit
from awiwi_gen.interchange.frames import rpy_of
from awiwi_gen.interchange.model import Array, Loss

_DRIVES = ("motor", "spring", "tendon")


def text_and_losses(hand: Hand) -> tuple[str, list[Loss]]:
    """The file, and what of the hand it does not hold."""
    root = Element("robot", name=hand.prefix)
    _palm(root, hand)
    for name, finger in hand.fingers.items():
        _finger(root, hand, name, finger)
    links = [(name, link) for name, finger in hand.fingers.items() for link in finger.links]
    tendons = [f"{name} {i}" for name, finger in hand.fingers.items() for i in range(len(finger.tendons))]
    losses = [
        *common_losses(hand),
        coupler_losses(hand, 1),
        Loss("the wrist, a closed loop of bars: the palm is the root", ("wrist",) if hand.wrist else ()),
        Loss("motors, springs and fibres of tendons", tuple(key for key in _DRIVES if getattr(hand, key) is not None)),
        Loss("tendons", tuple(tendons)),
        Loss("couplings by a curve: its offset and ratio only", tuple(_curved(hand))),
        Loss("armature", tuple(f"{name} {link.joint}" for name, link in links if value(link.armature))),
        Loss("springs of joints", tuple(f"{name} {link.joint}" for name, link in links if link.spring is not None)),
    ]
    return document(root, hand), [loss for loss in losses if loss.places]


def _curved(hand: Hand) -> list[str]:
    """The joints that follow others by more than URDF's ratio and offset."""
    return [
        f"{name} {each.follower}" for name, finger in hand.fingers.items() for each in finger.couplings if each.powers
    ]


def _palm(root: Element, hand: Hand) -> None:
    """The link that the fingers stand on, behind the joints of a wrist in series."""
    if hand.palm is None:
        SubElement(root, "link", name="palm")
        return
    parent = "forearm"
    SubElement(root, "link", name=parent)
    for part in palm_parts(hand.palm):
        child = f"wrist_{part.link.joint}"
        SubElement(root, "link", name=child)
        limits = value(part.link.low), value(part.link.high)
        _moving(root, hand, part.link.joint, part, (parent, child), limits)
        parent = child
    _fixed(root, parent, "palm", vector(hand.palm.joints[-1].offset), rpy_matrix(hand.palm.rpy))


def _finger(root: Element, hand: Hand, name: str, finger: Finger) -> None:
    base = finger.base
    position = vector(base.position) if base else np.zeros(3)
    _fixed(root, "palm", f"{name}.base", position, rpy_matrix(base.rpy if base else None))
    parent = f"{name}.base"
    couplers = {coupler_of(link.joint): link for link in finger.links if link.four_bar is not None}
    for part in parts(finger):
        child = f"{name}_{part.link.joint}"
        _link(root, child, part)
        if part.link.joint in couplers:
            _coupler(root, hand, name, couplers[part.link.joint], part, parent)
        else:
            _joint(root, hand, name, finger, part, parent)
        parent = child
    _fixed(root, parent, f"{name}.tip", vector(finger.links[-1].offset), np.eye(3))


def _fixed(root: Element, parent: str, child: str, position: Array, axes: Array) -> None:
    SubElement(root, "link", name=child)
    joint = SubElement(root, "joint", name=f"{child}.fixed", type="fixed")
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    SubElement(joint, "origin", xyz=text(position), rpy=text(rpy_of(axes)))


def _link(root: Element, name: str, part: Part) -> None:
    link = SubElement(root, "link", name=name)
    if part.link.mass is None:
        return
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=text(vector(part.link.com or ())), rpy="0 0 0")
    SubElement(inertial, "mass", value=text(float(part.link.mass)))
    t = part.inertia
    SubElement(inertial, "inertia", ixx=text(t[0, 0]), iyy=text(t[1, 1]), izz=text(t[2, 2]),
               ixy=text(t[0, 1]), ixz=text(t[0, 2]), iyz=text(t[1, 2]))  # fmt: skip


def _moving(
    root: Element, hand: Hand, name: str, part: Part, ends: tuple[str, str], limits: tuple[float, float]
) -> Element:
    """A joint between two links, the parent and the child."""
    slides = part.link.slides
    joint = SubElement(root, "joint", name=name, type="prismatic" if slides else "revolute")
    SubElement(joint, "parent", link=ends[0])
    SubElement(joint, "child", link=ends[1])
    # A joint of URDF stands at zero where it is drawn.
    axes, origin = part.at_zero
    SubElement(joint, "origin", xyz=text(origin), rpy=text(rpy_of(axes)))
    SubElement(joint, "axis", xyz="0 0 1")
    low, high = limits
    most = ("slide_force", "slide_velocity") if slides else ("joint_torque", "joint_velocity")
    effort, velocity = (value(getattr(hand.limits, key)) for key in most)
    own = getattr(part.link, "effort", None)
    SubElement(
        joint, "limit", lower=text(low), upper=text(high), effort=text(float(own or effort)), velocity=text(velocity)
    )
    return joint


def _joint(root: Element, hand: Hand, name: str, finger: Finger, part: Part, parent: str) -> None:
    link, full = part.link, f"{name}_{part.link.joint}"
    joint = _moving(root, hand, full, part, (parent, full), _range(finger, link.joint))
    if link.damping is not None or link.friction is not None:
        friction = value(link.friction.level) if link.friction else 0.0
        SubElement(joint, "dynamics", damping=text(value(link.damping)), friction=text(friction))
    if link.joint in finger.leaders:
        leader = f"{name}_{finger.leaders[link.joint]}"
        offset, ratio, *_ = finger.motion(link.joint)
        SubElement(joint, "mimic", joint=leader, multiplier=text(ratio), offset=text(offset))


def _coupler(root: Element, hand: Hand, name: str, link: Link, part: Part, parent: str) -> None:
    """The joint of a four-bar's coupler, which follows the crank in proportion."""
    full, fit = f"{name}_{part.link.joint}", coupler_fit(link, 1)
    rest, slope = fit.coefficients[0] - fit.coefficients[1] * fit.origin, fit.coefficients[1]
    low, high = sorted(rest + slope * value(end) for end in (link.low, link.high))
    joint = _moving(root, hand, full, part, (parent, full), (low, high))
    SubElement(joint, "mimic", joint=f"{name}_{link.joint}", multiplier=text(slope), offset=text(rest))


def _range(finger: Finger, joint: str) -> tuple[float, float]:
    """Limits of a joint [rad], or of a slide [m]; those of a follower are where its leader's limits take it."""
    offset, ratio, *_ = finger.motion(joint)
    leader = finger.leaders.get(joint, joint)
    link = next(link for link in finger.links if link.joint == leader)
    low, high = sorted(ratio * value(end) + offset for end in (link.low, link.high))
    return low, high
