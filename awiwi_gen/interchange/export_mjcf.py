"""A hand as a model of MuJoCo: bodies, joints, tendons, and motors that pull the tendons.

Angles are in radians, because MuJoCo converts neither `ctrlrange` nor the range of a tendon. The integrator is
implicitfast, with which the damping of tendons does not diverge.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.polynomial import Polynomial

from awiwi_gen.hand import Finger, Hand, Link
from awiwi_gen.hand.parts import PALM, PathPoint, Tendon
from awiwi_gen.interchange.export import (
    Drawn,
    Part,
    common_losses,
    document,
    has_four_bar,
    palm_parts,
    parts,
    rpy_matrix,
    text,
    value,
    vector,
)
from awiwi_gen.interchange.model import LEAST_MASS, Array, Loss


def text_and_losses(hand: Hand) -> tuple[str, list[Loss]]:
    """The file, and what of the hand it does not hold."""
    root = Element("mujoco", model=hand.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    SubElement(root, "option", integrator="implicitfast")
    sections = {name: Element(name) for name in ("tendon", "equality", "actuator")}
    lost: dict[str, list[str]] = {}
    palm = _palm(SubElement(root, "worldbody"), hand, lost)
    for name, finger in hand.fingers.items():
        if not has_four_bar(finger):
            _Writer(hand, name, finger, sections, lost).write(palm)
    root.extend(section for section in sections.values() if len(section))
    losses = common_losses(hand) + [Loss(what, tuple(places)) for what, places in lost.items()]
    return document(root, hand), [loss for loss in losses if loss.places]


def _palm(world: Element, hand: Hand, lost: dict[str, list[str]]) -> Element:
    """The body that the fingers stand on, with the joints of a wrist in series."""
    if hand.palm is None:
        return SubElement(world, "body", name="palm")
    drawn = Drawn.of(palm_parts(hand.palm))
    drawn = drawn.then(vector(hand.palm.joints[-1].offset), rpy_matrix(hand.palm.rpy))
    body = SubElement(SubElement(world, "body", name="forearm"), "body", name="palm")
    _place(body, drawn.position, drawn.axes)
    _least_inertia(body, lost)
    for part, axis, anchor in drawn.seats:
        _hinge(body, part.link.joint, part, drawn.axes.T @ axis, drawn.axes.T @ (anchor - drawn.position))
    return body


class _Writer:
    """Writes one finger."""

    def __init__(
        self, hand: Hand, name: str, finger: Finger, sections: dict[str, Element], lost: dict[str, list[str]]
    ) -> None:
        self.hand, self.name, self.finger, self.sections, self.lost = hand, name, finger, sections, lost
        self.parts = parts(finger)
        self.bodies: dict[str, Element] = {}

    def write(self, palm: Element) -> None:
        """Add the finger below the palm, and its tendons, couplings and motors."""
        base = SubElement(palm, "body", name=f"{self.name}.base")
        if self.finger.base is not None:
            _place(base, vector(self.finger.base.position), rpy_matrix(self.finger.base.rpy))
        self.bodies[PALM] = base
        self._links(base)
        for follower, leader in self.finger.leaders.items():
            self._coupling(follower, leader)
        for number, tendon in enumerate(self.finger.tendons):
            self._tendon(f"{self.name}.tendon{number}", tendon)
        if not self.finger.tendons:
            torque = float(self.hand.limits.joint_torque)
            for joint in self.finger.joints:
                full = f"{self.name}_{joint}"
                SubElement(self.sections["actuator"], "motor", name=f"{full}.motor", joint=full,
                           ctrlrange=text((-torque, torque)))  # fmt: skip

    def _lose(self, what: str, place: str) -> None:
        self.lost.setdefault(what, []).append(place)

    # -- bodies ------------------------------------------------------------------------------------------------------

    def _links(self, parent: Element) -> None:
        points = [point for tendon in self.finger.tendons for point in tendon.path]
        held = {link for point in points for link in (point.link, point.side_link)}
        held |= {joint for tendon in self.finger.tendons if tendon.span for joint in [self._before(tendon.span.joint)]}
        waiting: list[Part] = []
        for part in self.parts:
            waiting.append(part)
            last = part is self.parts[-1]
            if part.link.mass is None and part.link.joint not in held and not last:
                continue  # its joint goes to the next body, which then has several
            parent = self._body(parent, waiting)
            for each in waiting:
                self.bodies[each.link.joint] = parent
            waiting = []
        SubElement(parent, "site", name=f"{self.name}.tip", pos=text(vector(self.parts[-1].link.offset)))

    def _before(self, joint: str) -> str:
        order = [PALM, *(link.joint for link in self.finger.links)]
        return order[order.index(joint) - 1]

    def _body(self, parent: Element, waiting: list[Part]) -> Element:
        """The body of the last of these links, with the joints of all."""
        drawn, link = Drawn.of(waiting), waiting[-1].link
        body = SubElement(parent, "body", name=f"{self.name}_{link.joint}")
        _place(body, drawn.position, drawn.axes)
        if isinstance(link, Link) and link.mass is not None:
            _inertial(body, float(link.mass), vector(link.com or ()), waiting[-1].inertia)
        else:
            _least_inertia(body, self.lost)
        for part, axis, anchor in drawn.seats:
            name = f"{self.name}_{part.link.joint}"
            _hinge(body, name, part, drawn.axes.T @ axis, drawn.axes.T @ (anchor - drawn.position))
        return body

    def _coupling(self, follower: str, leader: str) -> None:
        references = {part.link.joint: part.reference for part in self.parts}
        # MuJoCo counts both angles from where the model is drawn.
        curve = Polynomial(self.finger.motion(follower))(Polynomial([references[leader], 1.0])) - references[follower]
        SubElement(self.sections["equality"], "joint", joint1=f"{self.name}_{follower}", joint2=f"{self.name}_{leader}",
                   polycoef=text([*curve.coef, 0.0, 0.0, 0.0][:5]))  # fmt: skip
        self._lose("couplings of joints: soft constraints in MuJoCo", f"{self.name} {follower}")

    # -- tendons -----------------------------------------------------------------------------------------------------

    def _tendon(self, name: str, tendon: Tendon) -> None:
        arms: dict[str, float] = {}
        for over in tendon.over:
            arms[over[1:]] = arms.get(over[1:], 0.0) + float(f"{over[0]}1") * float(self.finger.radii[over[1:]])
        for joint, arm in tendon.arms.items():
            arms[joint] = arms.get(joint, 0.0) + float(arm)
        written = []
        if arms:
            written.append(SubElement(self.sections["tendon"], "fixed", name=name))
            for joint, coefficient in arms.items():
                SubElement(written[-1], "joint", joint=f"{self.name}_{joint}", coef=text(coefficient))
        for number, points in enumerate(self._lines(tendon)):
            full = name if not written else f"{name}.line{number}"
            written.append(SubElement(self.sections["tendon"], "spatial", name=full))
            for place, (link, at, passed) in enumerate(points):
                if passed is not None and passed.radius is not None:
                    self._wrap(written[-1], f"{full}.geom{place}", passed)
                    continue
                if passed is not None and passed.divisor is not None:
                    SubElement(written[-1], "pulley", divisor=text(float(passed.divisor)))
                SubElement(self.bodies[link], "site", name=f"{full}.site{place}", pos=text(at))
                SubElement(written[-1], "site", site=f"{full}.site{place}")
        if len(written) > 1:
            self._lose("tendons of arcs and lines: one tendon of MuJoCo for each, and their forces are equal", name)
        if tendon.rest.value:
            self._lose("lengths of tendons that no joint changes (rest): not in MuJoCo's length", name)
        for each in written:
            self._pull(each, tendon, alone=len(written) == 1)

    def _wrap(self, tendon: Element, name: str, body: PathPoint) -> None:
        """A geom that the tendon wraps round, and the site on its side."""
        geom = SubElement(self.bodies[body.link], "geom", name=name, type=body.kind, pos=text(vector(body.at)),
                          contype="0", conaffinity="0", mass="0")  # fmt: skip
        size = [float(body.radius or 0)]
        if body.axis is not None:
            size.append(size[0])  # MuJoCo's cylinders have ends, which wraps do not know
            geom.set("zaxis", text(vector(body.axis)))
        geom.set("size", text(size))
        step = SubElement(tendon, "geom", geom=name)
        if body.side is not None or body.inside:
            side = body.at if body.side is None else body.side
            carrier = self.bodies[body.side_link or body.link]
            SubElement(carrier, "site", name=f"{name}.side", pos=text(vector(side)))
            step.set("sidesite", f"{name}.side")

    def _lines(self, tendon: Tendon) -> list[list[tuple[str, Array, PathPoint | None]]]:
        """What the span and the path pass, each as (link, position in its frame, entry of the path or None)."""
        found: list[list[tuple[str, Array, PathPoint | None]]] = []
        if tendon.span is not None:
            order = [part.link.joint for part in self.parts]
            part = self.parts[order.index(tendon.span.joint)]
            fixed = part.position + part.axes @ vector(tendon.span.to)
            before = self._before(tendon.span.joint)
            found.append([(PALM, vector(tendon.span.from_), None), (before, fixed, None)])
        if tendon.path:
            found.append([(each.link, vector(each.at), each) for each in tendon.path])
        return found

    def _pull(self, element: Element, tendon: Tendon, alone: bool) -> None:
        name = element.get("name", "")
        if tendon.spring is None:
            SubElement(self.sections["actuator"], "motor", name=f"{name}.motor", tendon=name, gear="-1",
                       ctrlrange=text((0, float(self.hand.limits.tendon_force))))  # fmt: skip
            return
        slack = float(tendon.spring.rest.value - tendon.rest.value)
        if alone and slack >= 0:
            element.set("stiffness", text(float(tendon.spring.stiffness)))
            element.set("springlength", text((0, slack)))
        else:
            self._lose("return springs whose rest MuJoCo cannot hold: no spring", name)


def _hinge(body: Element, name: str, part: Part, axis: Array, anchor: Array) -> None:
    """A joint of a finger or of the wrist, by its axis and a point of it in the body's frame."""
    link = part.link
    joint = SubElement(body, "joint", name=name, axis=text(axis), pos=text(anchor))
    if part.reference:
        joint.set("ref", text(part.reference))
    if link.low is not None and link.high is not None:
        joint.set("range", text((float(link.low), float(link.high))))
    if not isinstance(link, Link):
        return
    for key in ("armature", "damping"):
        if getattr(link, key) is not None:
            joint.set(key, text(value(getattr(link, key))))
    if link.friction is not None:
        joint.set("frictionloss", text(float(link.friction.torque)))
    if link.spring is not None:
        joint.set("stiffness", text(float(link.spring.stiffness)))
        joint.set("springref", text(float(link.spring.reference)))


def _least_inertia(body: Element, lost: dict[str, list[str]]) -> None:
    """The inertia of a body that has none in the hand: MuJoCo moves no body without."""
    what = f"links without mass: {LEAST_MASS * 1e6:g} mg, because MuJoCo moves no body without"
    lost.setdefault(what, []).append(body.get("name", ""))
    SubElement(body, "inertial", pos="0 0 0", mass=text(LEAST_MASS), diaginertia=text([LEAST_MASS * 1e-6] * 3))


def _place(body: Element, position: Array, axes: Array) -> None:
    if np.any(position):
        body.set("pos", text(position))
    if not np.array_equal(axes, np.eye(3)):
        body.set("quat", text(quaternion(axes)))


def _inertial(body: Element, mass: float, com: Array, tensor: Array) -> None:
    inertial = SubElement(body, "inertial", pos=text(com), mass=text(mass))
    if np.array_equal(tensor, np.diag(np.diag(tensor))):
        inertial.set("diaginertia", text(np.diag(tensor)))
    else:
        order = [tensor[place] for place in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        inertial.set("fullinertia", text(order))


def quaternion(axes: Array) -> Array:
    """The unit quaternion (w, x, y, z) of a rotation (3 x 3), by the largest of its entries."""
    squares = 1 + np.array([1, 1, 1, 1]) * np.trace(axes) * np.array([1, -1, -1, -1])
    squares[1:] += 2 * np.diag(axes)
    k = int(np.argmax(squares))
    found = np.empty(4)
    found[k] = squares[k]
    differences = [(2, 1), (0, 2), (1, 0)]
    if k == 0:
        found[1:] = [axes[i, j] - axes[j, i] for i, j in differences]
    else:
        i, j = differences[k - 1]
        found[0] = axes[i, j] - axes[j, i]
        for other in range(3):
            if other != k - 1:
                found[other + 1] = axes[k - 1, other] + axes[other, k - 1]
    return found / np.linalg.norm(found)
