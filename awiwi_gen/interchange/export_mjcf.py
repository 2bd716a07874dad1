"""A hand as a model of MuJoCo: bodies, joints, tendons, and motors that pull the tendons.

Angles are in radians, because MuJoCo converts neither `ctrlrange` nor the range of a tendon. The integrator is
implicitfast, with which the damping of tendons does not diverge.
"""

from __future__ import annotations

from dataclasses import dataclass
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
from awiwi_gen.interchange.export_wrist import pull_runs, wrist_of_bars
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
    pulls = float(hand.limits.tendon_force) if motors == FORCE else None
    palm = _palm(world, hand, sections, lost, pulls)
    writers = [_Writer(drives, name, finger) for name, finger in hand.fingers.items()]
    for writer in writers:
        writer.write(palm)
    _pull_across(writers)
    if hand.wrist is not None and pulls is not None:
        pull_runs(hand.wrist, sections, pulls)  # behind the fingers' motors
    root.extend(section for section in sections.values() if len(section))
    losses = [*common_losses(hand), coupler_losses(hand, DEGREE)]
    losses += [Loss(what, tuple(places)) for what, places in lost.items()]
    return document(root, hand), [loss for loss in losses if loss.places]


def _palm(world: Element, hand: Hand, sections: Sections, lost: Lost, force: float | None) -> Element:
    """The body that the fingers stand on, with the joints of its wrist."""
    if hand.wrist is not None:
        return wrist_of_bars(SubElement(world, "body", name="forearm"), hand.wrist, sections, lost, force)
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
        motors = {self.finger.pulled_numbers[each.transmission.members[0]]: each for each in self.pulls}
        for number, tendon in enumerate(self.finger.tendons):
            if tendon.spring is not None:
                self._string(number, tendon)
            elif number in motors and not motors[number].across:
                _pull([motors[number]])
        if not self.finger.tendons:
            for link in self.finger.links:
                if link.joint in self.finger.joints:
                    self.drives.move(f"{self.name}_{link.joint}", link.effort, link.slides)

    def lose(self, what: str, place: str) -> None:
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
        self.lose("couplings of joints: soft constraints in MuJoCo", f"{self.name} {follower}")

    def _coupler(self, link: Link) -> None:
        """The coupler of a four-bar follows the crank by a polynomial."""
        joint, fit = f"{self.name}_{link.joint}", coupler_fit(link, DEGREE)
        SubElement(self.sections["equality"], "joint", name=f"{joint}.four_bar", joint1=coupler_of(joint), joint2=joint,
                   polycoef=text(fit.coefficients))  # fmt: skip

    # -- tendons -----------------------------------------------------------------------------------------------------

    @property
    def pulls(self) -> list[_Pull]:
        """What the finger's motors pull of it."""
        first = self.drives.hand.blocks[self.name][0].start
        return [_Pull(self, first + index, each) for index, each in enumerate(self.finger.transmissions)]

    def arms_of(self, tendons: list[tuple[float, Tendon]]) -> dict[str, float]:
        """Joint of the model -> length per angle of the sum of weight times length."""
        arms: dict[str, float] = {}
        for weight, tendon in tendons:
            for over in tendon.over:
                radius = float(f"{over[0]}1") * float(self.finger.radii[over[1:]])
                arms[over[1:]] = arms.get(over[1:], 0.0) + weight * radius
            for joint, arm in tendon.arms.items():
                arms[joint] = arms.get(joint, 0.0) + weight * float(arm)
        return {f"{self.name}_{joint}": arm for joint, arm in arms.items()}

    def _string(self, number: int, tendon: Tendon) -> None:
        """An elastic return string: it never pushes."""
        written = _tendon(f"{self.name}.tendon{number}", [(self, [(1.0, tendon)])])
        if tendon.spring is None or len(written) > 1:
            self.lose("return springs of arcs and lines: MuJoCo has no spring over both", written[0].get("name", ""))
            return
        written[0].set("stiffness", text(float(tendon.spring.stiffness)))
        written[0].set("springlength", one_sided(float(tendon.spring.rest.value - tendon.rest.value)))

    def wrap(self, tendon: Element, name: str, body: PathPoint) -> None:
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

    def lines_of(self, tendon: Tendon) -> list[list[Passed]]:
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


@dataclass(frozen=True)
class _Pull:
    """What a motor pulls of one finger: a transmission, with its index among all of the hand."""

    writer: _Writer
    index: int
    transmission: Transmission

    @property
    def across(self) -> str:
        """The motor's name, if it pulls tendons of other fingers too."""
        shared, across = self.transmission.tendons[0].motor, self.writer.drives.hand.across
        return shared.name if shared and any(shared.name == each for each in across.values()) else ""

    @property
    def name(self) -> str:
        """The name of the tendon in the model."""
        shared, finger = self.transmission.tendons[0].motor, self.writer.name
        number = self.writer.finger.pulled_numbers[self.transmission.members[0]]
        own = f"{finger}.{shared.name.removeprefix(f'{finger}_')}" if shared else f"{finger}.tendon{number}"
        return self.across or own

    @property
    def shares(self) -> list[tuple[float, int]]:
        """Weights and numbers of its tendons; those that a motor lets go mirror those that it winds up."""
        numbers = [self.writer.finger.pulled_numbers[member] for member in self.transmission.members]
        shares = [*zip(self.transmission.weights, numbers, strict=True)]
        return [(2 * each, number) for each, number in shares if each > 0] if self.transmission.two_way else shares

    @property
    def tendons(self) -> list[tuple[float, Tendon]]:
        """Weights and tendons."""
        return [(weight, self.writer.finger.tendons[number]) for weight, number in self.shares]

    @property
    def slack(self) -> float:
        """The length [m] with all joints at zero, without the rest."""
        chain, zero = Chain(self.writer.finger), [0.0] * len(self.writer.finger.joints)
        lengths = sum(weight * chain.length(number, zero) for weight, number in self.shares)
        return lengths - sum(weight * float(tendon.rest) for weight, tendon in self.tendons)


def _pull_across(writers: list[_Writer]) -> None:
    """One tendon for each motor that pulls tendons of several fingers."""
    found: dict[str, list[_Pull]] = {}
    for pull in (each for writer in writers for each in writer.pulls):
        if pull.across:
            found.setdefault(pull.across, []).append(pull)
    for pulls in found.values():
        _pull(pulls)


def _pull(pulls: list[_Pull]) -> None:
    """A tendon for all that a motor pulls, and the motor."""
    written = _tendon(pulls[0].name, [(pull.writer, pull.tendons) for pull in pulls])
    both_ways = any(pull.transmission.two_way for pull in pulls)
    pulls[0].writer.drives.pull(written, pulls[0].index, sum(pull.slack for pull in pulls), both_ways)


def _tendon(name: str, parts: list[tuple[_Writer, list[tuple[float, Tendon]]]]) -> list[Element]:
    """A tendon of MuJoCo, or one for arcs and one for lines, as long as the sum of weight times length in all fingers."""
    first = parts[0][0]
    arms = {joint: arm for writer, tendons in parts for joint, arm in writer.arms_of(tendons).items()}
    written = []
    if arms:
        written.append(SubElement(first.sections["tendon"], "fixed", name=name))
        for joint, coefficient in arms.items():
            SubElement(written[-1], "joint", joint=joint, coef=text(coefficient))
    lines = [(writer, weight, points) for writer, tendons in parts for weight, tendon in tendons
             for points in writer.lines_of(tendon)]  # fmt: skip
    if lines:
        full = f"{name}.line0" if written else name
        written.append(SubElement(first.sections["tendon"], "spatial", name=full))
        _branches(written[-1], full, lines)
    if len(written) > 1:
        first.lose("tendons of arcs and lines: one tendon of MuJoCo for each, and their forces are equal", name)
    if any(tendon.rest.value for _, tendons in parts for _, tendon in tendons):
        first.lose("lengths of tendons that no joint changes (rest): not in MuJoCo's length", name)
    return written


def _branches(element: Element, name: str, lines: list[tuple[_Writer, float, list[Passed]]]) -> None:
    """The places of some paths; lengths of each count so many times."""
    steps = [(writer, weight, first, *each) for writer, weight, points in lines for first, each in enumerate(points)]
    for step, (writer, weight, first, link, at, passed) in enumerate(steps):
        if passed is not None and passed.radius is not None:
            writer.wrap(element, f"{name}.geom{step}", passed)
            continue
        divisor = None if passed is None else passed.divisor
        if divisor is not None or (first == 0 and (step or weight != 1)):
            SubElement(element, "pulley", divisor=text(float(divisor or 1) / weight))
        SubElement(writer.bodies[link], "site", name=f"{name}.site{step}", pos=text(at))
        SubElement(element, "site", site=f"{name}.site{step}")
