"""A reader for the part of MJCF that the export writes, without MuJoCo."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from numpy.polynomial import Polynomial

from awiwi_gen.interchange.model import LEAST_MASS, Body, Joint, Mimic, Model, Place, Site, Tendon

ATTRIBUTES = {"reference": "ref", "armature": "armature", "damping": "damping", "friction": "frictionloss",
              "stiffness": "stiffness", "spring_reference": "springref"}  # fmt: skip


def numbers(text: str | None, default: str = "0 0 0") -> np.ndarray:
    return np.array([float(word) for word in (text or default).split()])


def rotation(quat: np.ndarray) -> np.ndarray:
    w, v = quat[0], quat[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def beside(body: Place, site: Place | None) -> Place:
    """A body with its side site, as MuJoCo understands it."""
    if site is None:
        return body
    if site.body != body.body:
        return body._replace(side=site.at, carrier=site.body)
    inside = np.linalg.norm(site.at - body.at) < body.radius
    return body._replace(inside=True) if inside else body._replace(side=site.at)


def read_mjcf(text: str) -> Model:
    """The part of MJCF that the export writes."""
    root = ElementTree.fromstring(text)  # noqa: S314 our own
    zero = np.zeros(3)
    bodies, joints, sites = [Body("world", 0, zero, np.eye(3), 0.0, zero, np.zeros((3, 3)))], [], []
    round_ = {}
    measured = {each.get("joint") for each in root.findall("sensor/jointpos")}

    def visit(element: ElementTree.Element, parent: int) -> None:
        inertial, index = element.find("inertial"), len(bodies)
        mass, com, tensor = 0.0, zero, np.zeros((3, 3))
        if inertial is not None:
            mass, com = float(inertial.get("mass")), numbers(inertial.get("pos"))
            x, y, z, xy, xz, yz = numbers(inertial.get("fullinertia"), f"{inertial.get('diaginertia')} 0 0 0")
            tensor = np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])
            mass, tensor = (0.0, 0 * tensor) if mass <= LEAST_MASS else (mass, tensor)
        axes = rotation(numbers(element.get("quat"), "1 0 0 0"))
        exact = np.rint(axes)
        axes = np.where(np.abs(axes - exact) < 1e-15, exact, axes)
        bodies.append(Body(element.get("name"), parent, numbers(element.get("pos")), axes, mass, com, tensor))
        for each in element.findall("joint"):
            low, high = numbers(each.get("range")) if each.get("range") else (None, None)
            own = {key: float(each.get(name, 0)) for key, name in ATTRIBUTES.items()}
            own["effort"] = numbers(each.get("actuatorfrcrange"), "0 0")[1]
            own["measured"] = each.get("name") in measured
            axis, anchor = numbers(each.get("axis")), numbers(each.get("pos"))
            joints.append(Joint(each.get("name"), index, each.get("type", "hinge"), axis, anchor, low, high, **own))
        sites.extend(Site(each.get("name"), index, numbers(each.get("pos"))) for each in element.findall("site"))
        for each in element.findall("geom"):
            axis = None if each.get("zaxis") is None else numbers(each.get("zaxis"))
            radius = float(numbers(each.get("size"))[0])
            round_[each.get("name")] = Place(index, numbers(each.get("pos")), radius, axis)
        for child in element.findall("body"):
            visit(child, index)

    visit(root.find("worldbody/body"), 0)
    places = {site.name: Place(site.body, site.position) for site in sites}
    references = {joint.name: joint.reference for joint in joints}
    tendons, mimics = [], []
    both = {a.get("tendon") for a in root.findall("actuator/*") if numbers(a.get("ctrlrange"), "0 0")[0] < 0}
    for each in root.findall("tendon/*"):
        _, slack = numbers(each.get("springlength"), "0 0")
        spring = {"stiffness": float(each.get("stiffness", 0)), "rest": slack}
        arms = {joint.get("joint"): float(joint.get("coef")) for joint in each.findall("joint")}
        path, divisor = [], None
        for step in each:
            if step.tag == "site":
                path.append(places[step.get("site")]._replace(divisor=divisor))
                divisor = None
            elif step.tag == "geom":
                path.append(beside(round_[step.get("geom")], places.get(step.get("sidesite"))))
            elif step.tag == "pulley":
                divisor = float(step.get("divisor"))
        two_way = bool(arms) and each.get("name") in both
        tendons.append(Tendon(each.get("name"), arms, tuple(path), two_way=two_way, **spring))
    for each in root.findall("equality/joint"):
        follower, leader = each.get("joint1"), each.get("joint2")
        curve = Polynomial(numbers(each.get("polycoef")))(Polynomial([-references[leader], 1.0]))
        mimics.append(Mimic.of(follower, leader, curve + references[follower]))
    return Model(
        root.get("model"), "export.xml", tuple(bodies), tuple(joints), tuple(tendons), tuple(mimics), tuple(sites)
    )
