"""A hand as a model of MuJoCo: bodies, joints, tendons, and motors that pull the tendons.

Angles are in radians, because MuJoCo converts neither `ctrlrange` nor the range of a tendon. The integrator is
implicitfast, with which the damping of tendons does not diverge.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.polynomial import Polynomial

from awiwi_gen.hand import Finger, Hand, Link
from awiwi_gen.hand.parts import PALM, PathPoint, Tendon, Transmission
from awiwi_gen.hand.pose import Chain
from awiwi_gen.interchange.export import (
    Drawn,
    Part,
    common_losses,
    coupler_losses,
    coupler_of,
    document,
    palm_parts,
    parts,
    rpy_matrix,
    text,
    vector,
)
from awiwi_gen.interchange.export_motors import FORCE, MOTORS, TIMESTEP, Drives, Lost, Sections, one_sided
from awiwi_gen.interchange.export_wrist import wrist_of_bars
from awiwi_gen.interchange.fits import coupler_fit
from awiwi_gen.interchange.frames import turn_matrix
from awiwi_gen.interchange.mjcf_elements import inertial, joint_of, least_inertia, place
from awiwi_gen.interchange.model import Array, Loss

__all__ = ["MOTORS", "text_and_losses"]

DEGREE = 4  # of MuJoCo's couplings of joints
Passed = tuple[str, Array, PathPoint | None]


def text_and_losses(hand: Hand, motors: str = FORCE) -> tuple[str, list[Loss]]:
    """The file, and what of the hand it does not hold; `motors` is one of `MOTORS`.

    Raises `InputError` for motors that the hand file says nothing of.
    """
    root = Element("mujoco", model=hand.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    option = SubElement(root, "option", integrator="implicitfast")
    if motors != FORCE:
        option.set("timestep", TIMESTEP)
    sections = {name: Element(name) for name in ("tendon", "equality", "actuator", "sensor")}
    lost: Lost = {}
    world = SubElement(root, "worldbody")
    drives = Drives(hand, motors, world, sections, lost)
    palm = _palm(world, hand, sections, lost)
    for name, finger in hand.fingers.items():
        _Writer(drives, name, finger).write(palm)
    root.extend(section for section in sections.values() if len(section))
    losses = [*common_losses(hand), coupler_losses(hand, DEGREE)]
    losses += [Loss(what, tuple(places)) for what, places in lost.items()]
    return document(root, hand), [loss for loss in losses if loss.places]


def _palm(world: Element, hand: Hand, sections: Sections, lost: Lost) -> Element:
    """The body that the fingers stand on, with the joints of its wrist."""
    if hand.wrist is not None:
        return wrist_of_bars(SubElement(world, "body", name="forearm"), hand.wrist, sections, lost)
    if hand.palm is None:
        return SubElement(world, "body", name="palm")
    drawn = Drawn.of(palm_parts(hand.palm))
    drawn = drawn.then(vector(hand.palm.joints[-1].offset), rpy_matrix(hand.palm.rpy))
    body = SubElement(SubElement(world, "body", name="forearm"), "body", name="palm")
    place(body, drawn.position, drawn.axes)
    least_inertia(body, lost)
    for part, axis, anchor in drawn.seats:
        joint_of(body, part.link.joint, part, drawn.axes.T @ axis, drawn.axes.T @ (anchor - drawn.position))
    return body


class _Writer:
    """Writes one finger."""

    def __init__(self, drives: Drives, name: str, finger: Finger) -> None:
        self.drives, self.name, self.finger = drives, name, finger
        self.sections, self.lost = drives.sections, drives.lost
        self.parts = parts(finger)
        self.bodies: dict[str, Element] = {}

    def write(self, palm: Element) -> None:
        """Add the finger below the palm, and its tendons, couplings and motors."""
        base = SubElement(palm, "body", name=f"{self.name}.base")
        if self.finger.base is not None:
            place(base, vector(self.finger.base.position), rpy_matrix(self.finger.base.rpy))
        self.bodies[PALM] = base
        self._links(base)
        for follower, leader in self.finger.leaders.items():
            self._coupling(follower, leader)
        for link in self.finger.links:
            if link.four_bar is not None:
                self._coupler(link)
        for link in self.finger.links:
            if link.sensor is not None:
                joint = f"{self.name}_{link.joint}"
                SubElement(self.sections["sensor"], "jointpos", name=f"{joint}.sensor", joint=joint)
        motors = {self.finger.pulled_numbers[t.members[0]]: (i, t) for i, t in enumerate(self.finger.transmissions)}
        for number, tendon in enumerate(self.finger.tendons):
            if tendon.spring is not None:
                self._string(number, tendon)
            elif number in motors:
                self._transmission(*motors[number])
        if not self.finger.tendons:
            for link in self.finger.links:
                if link.joint in self.finger.joints:
                    self.drives.move(f"{self.name}_{link.joint}", link.effort, link.slides)

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
            last, crank = part is self.parts[-1], part.link.four_bar is not None
            if (
                part.link.mass is None
                and (crank or part.link.joint.removesuffix(coupler_of("")) not in held)
                and not last
            ):
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
        place(body, drawn.position, drawn.axes)
        if isinstance(link, Link) and link.mass is not None:
            inertial(body, float(link.mass), vector(link.com or ()), waiting[-1].inertia)
        else:
            least_inertia(body, self.lost)
        for part, axis, anchor in drawn.seats:
            name = f"{self.name}_{part.link.joint}"
            joint_of(body, name, part, drawn.axes.T @ axis, drawn.axes.T @ (anchor - drawn.position))
        return body

    def _coupling(self, follower: str, leader: str) -> None:
        references = {part.link.joint: part.reference for part in self.parts}
        # MuJoCo counts both angles from where the model is drawn.
        curve = Polynomial(self.finger.motion(follower))(Polynomial([references[leader], 1.0])) - references[follower]
        SubElement(self.sections["equality"], "joint", joint1=f"{self.name}_{follower}", joint2=f"{self.name}_{leader}",
                   polycoef=text([*curve.coef, 0.0, 0.0, 0.0][:5]))  # fmt: skip
        self._lose("couplings of joints: soft constraints in MuJoCo", f"{self.name} {follower}")

    def _coupler(self, link: Link) -> None:
        """The coupler of a four-bar follows the crank by a polynomial."""
        joint, fit = f"{self.name}_{link.joint}", coupler_fit(link, DEGREE)
        SubElement(self.sections["equality"], "joint", name=f"{joint}.four_bar", joint1=coupler_of(joint), joint2=joint,
                   polycoef=text(fit.coefficients))  # fmt: skip

    # -- tendons -----------------------------------------------------------------------------------------------------

    def _transmission(self, index: int, transmission: Transmission) -> None:
        """What a motor of the finger pulls, number `index`, and the motor."""
        numbers = [self.finger.pulled_numbers[member] for member in transmission.members]
        shares = [*zip(transmission.weights, numbers, strict=True)]
        if transmission.two_way:  # the tendons that it lets go mirror those that it winds up
            shares = [(2 * weight, number) for weight, number in shares if weight > 0]
        shared, chain = transmission.tendons[0].motor, Chain(self.finger)
        name = (
            f"{self.name}.{shared.name.removeprefix(f'{self.name}_')}" if shared else f"{self.name}.tendon{numbers[0]}"
        )
        tendons = [(weight, self.finger.tendons[number]) for weight, number in shares]
        slack = sum(weight * chain.length(number, [0.0] * len(self.finger.joints)) for weight, number in shares)
        slack -= sum(weight * float(tendon.rest) for weight, tendon in tendons)
        index += self.drives.hand.blocks[self.name][0].start
        self.drives.pull(self._tendon(name, tendons), index, slack, transmission.two_way)

    def _tendon(self, name: str, tendons: list[tuple[float, Tendon]]) -> list[Element]:
        """A tendon of MuJoCo, or one for arcs and one for lines, as long as the sum of weight times length."""
        arms: dict[str, float] = {}
        for weight, tendon in tendons:
            for over in tendon.over:
                radius = float(f"{over[0]}1") * float(self.finger.radii[over[1:]])
                arms[over[1:]] = arms.get(over[1:], 0.0) + weight * radius
            for joint, arm in tendon.arms.items():
                arms[joint] = arms.get(joint, 0.0) + weight * float(arm)
        written = []
        if arms:
            written.append(SubElement(self.sections["tendon"], "fixed", name=name))
            for joint, coefficient in arms.items():
                SubElement(written[-1], "joint", joint=f"{self.name}_{joint}", coef=text(coefficient))
        lines = [(weight, points) for weight, tendon in tendons for points in self._lines(tendon)]
        if lines:
            full = f"{name}.line0" if written else name
            written.append(SubElement(self.sections["tendon"], "spatial", name=full))
            self._branches(written[-1], full, lines)
        if len(written) > 1:
            self._lose("tendons of arcs and lines: one tendon of MuJoCo for each, and their forces are equal", name)
        if any(tendon.rest.value for _, tendon in tendons):
            self._lose("lengths of tendons that no joint changes (rest): not in MuJoCo's length", name)
        return written

    def _branches(self, element: Element, name: str, lines: list[tuple[float, list[Passed]]]) -> None:
        """The places of some paths; lengths of each count so many times."""
        steps = [(weight, first, *each) for weight, points in lines for first, each in enumerate(points)]
        for step, (weight, first, link, at, passed) in enumerate(steps):
            if passed is not None and passed.radius is not None:
                self._wrap(element, f"{name}.geom{step}", passed)
                continue
            divisor = None if passed is None else passed.divisor
            if divisor is not None or (first == 0 and (step or weight != 1)):
                SubElement(element, "pulley", divisor=text(float(divisor or 1) / weight))
            SubElement(self.bodies[link], "site", name=f"{name}.site{step}", pos=text(at))
            SubElement(element, "site", site=f"{name}.site{step}")

    def _string(self, number: int, tendon: Tendon) -> None:
        """An elastic return string: it never pushes."""
        written = self._tendon(f"{self.name}.tendon{number}", [(1.0, tendon)])
        if tendon.spring is None or len(written) > 1:
            self._lose("return springs of arcs and lines: MuJoCo has no spring over both", written[0].get("name", ""))
            return
        written[0].set("stiffness", text(float(tendon.spring.stiffness)))
        written[0].set("springlength", one_sided(float(tendon.spring.rest.value - tendon.rest.value)))

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

    def _lines(self, tendon: Tendon) -> list[list[Passed]]:
        """What the span and the path pass, each as (link, position in its frame, entry of the path or None)."""
        found: list[list[Passed]] = []
        if tendon.span is not None:
            order = [link.joint for link in self.finger.links]
            seat = order.index(tendon.span.joint)
            link = self.finger.links[seat]
            fixed = turn_matrix(link.turn) @ rpy_matrix(link.rpy) @ vector(tendon.span.to)
            fixed = fixed + (vector(self.finger.links[seat - 1].offset) if seat else np.zeros(3))
            before = self._before(tendon.span.joint)
            found.append([(PALM, vector(tendon.span.from_), None), (before, fixed, None)])
        if tendon.path:
            found.append([(each.link, vector(each.at), each) for each in tendon.path])
        return found
