"""Elements of MJCF that several parts of the export write: places, inertias, joints and quaternions."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from awiwi_gen.hand import Link
from awiwi_gen.interchange.export import Part, text, value
from awiwi_gen.interchange.model import LEAST_MASS, Array

__all__ = ["inertial", "joint_of", "least_inertia", "place", "quaternion"]


def joint_of(body: Element, name: str, part: Part, axis: Array, anchor: Array) -> None:
    """A joint of a finger or of the wrist, by its axis and a point of it in the body's frame."""
    link = part.link
    joint = SubElement(body, "joint", name=name, axis=text(axis), pos=text(anchor))
    if link.slides:
        joint.set("type", "slide")
    if part.reference:
        joint.set("ref", text(part.reference))
    if link.low is not None and link.high is not None:
        joint.set("range", text((float(link.low), float(link.high))))
    if not isinstance(link, Link):
        return
    if link.effort is not None:
        joint.set("actuatorfrcrange", text((-float(link.effort), float(link.effort))))
    for key in ("armature", "damping"):
        if getattr(link, key) is not None:
            joint.set(key, text(value(getattr(link, key))))
    if link.friction is not None:
        joint.set("frictionloss", text(float(link.friction.level)))
    if link.spring is not None:
        joint.set("stiffness", text(float(link.spring.stiffness)))
        joint.set("springref", text(float(link.spring.reference)))


def least_inertia(body: Element, lost: dict[str, list[str]]) -> None:
    """The inertia of a body that has none in the hand: MuJoCo moves no body without."""
    what = f"links without mass: {LEAST_MASS * 1e6:g} mg, because MuJoCo moves no body without"
    lost.setdefault(what, []).append(body.get("name", ""))
    SubElement(body, "inertial", pos="0 0 0", mass=text(LEAST_MASS), diaginertia=text([LEAST_MASS * 1e-6] * 3))


def place(body: Element, position: Array, axes: Array) -> None:
    """Where a body stands in the one that carries it: its position (3) [m] and its axes (3 x 3)."""
    if np.any(position):
        body.set("pos", text(position))
    if not np.array_equal(axes, np.eye(3)):
        body.set("quat", text(quaternion(axes)))


def inertial(body: Element, mass: float, com: Array, tensor: Array) -> None:
    """Mass [kg], centre of mass (3) [m] and the tensor (3 x 3) about it [kg m^2] of a body."""
    element = SubElement(body, "inertial", pos=text(com), mass=text(mass))
    if np.array_equal(tensor, np.diag(np.diag(tensor))):
        element.set("diaginertia", text(np.diag(tensor)))
    else:
        order = [tensor[place] for place in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        element.set("fullinertia", text(order))


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
