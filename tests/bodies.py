"""Trees of bodies for the tests of import, without files and without MuJoCo."""

from __future__ import annotations

import numpy as np

from awiwi_gen.interchange.model import Body, Joint, Mimic, Model, Site, Tendon


def body(name: str, parent: int, position=(0.0, 0.0, 0.0), axes=None, mass: float = 0.004) -> Body:
    tensor = np.array([[3e-7, 1e-8, -2e-8], [1e-8, 4e-7, 3e-8], [-2e-8, 3e-8, 4.5e-7]])
    return Body(name, parent, np.array(position), np.eye(3) if axes is None else axes, mass,
                np.array([0.01, 0.002, -0.001]) * (mass > 0), tensor * (mass > 0))  # fmt: skip


def joint(name: str, where: int, axis=(0.0, 0.0, 1.0), anchor=(0.0, 0.0, 0.0), **more) -> Joint:
    direction = np.array(axis) / np.linalg.norm(axis)
    return Joint(name, where, more.pop("kind", "hinge"), direction, np.array(anchor),
                 more.pop("low", -0.5), more.pop("high", 1.5), **more)  # fmt: skip


def finger(tendons: tuple[Tendon, ...] = (), mimics: tuple[Mimic, ...] = (), **more) -> Model:
    """A palm with one finger of three joints, two of them in one body, with skew axes."""
    bodies = (
        body("world", 0, mass=0.0),
        body("palm", 0, (0.1, 0.2, 0.3)),
        body("knuckle", 1, (0.03, 0.01, 0.02)),
        body("distal", 2, (0.04, 0.0, 0.001)),
        body("pad", 3, (0.02, 0.0, 0.0)),
    )
    joints = (
        joint("IF:Spread", 2, (0.1, 0.05, 1.0), (0.001, 0.002, 0.0), armature=1e-6),
        joint("IF:Bend", 2, (0.2, 1.0, 0.1), (0.002, -0.001, 0.003), reference=0.2),
        joint("IF:Tip", 3, (0.0, 1.0, 0.0), damping=0.01, friction=0.02, stiffness=0.3, spring_reference=0.1),
    )
    tip = Site("tip", 4, np.array([0.005, 0.0, 0.0]))
    return Model("Test hand", "test.xml", bodies, joints, tendons, mimics, (tip,), **more)


def two_fingers(**more) -> Model:
    """A wrist joint, a palm, and two fingers of one joint each."""
    bodies = (
        body("world", 0, mass=0.0),
        body("palm", 0),
        body("index_link", 1, (0.03, 0.01, 0.0)),
        body("thumb_link", 1, (0.03, -0.01, 0.0)),
    )
    joints = (joint("wrist", 1), joint("index_bend", 2, (0, 1, 0)), joint("thumb_bend", 3, (1, 0, 0)))
    return Model("Pair", "pair.xml", bodies, joints, **more)


def pose(model: Model, angles: dict[str, float], index: int) -> tuple[np.ndarray, np.ndarray]:
    """Axes and origin of a body in the world, each joint turned from its reference, in the order of the file."""
    here = model.bodies[index]
    axes, origin = pose(model, angles, here.parent) if index else (np.eye(3), np.zeros(3))
    origin, axes = origin + axes @ here.position, axes @ here.axes
    for each in model.joints_of[index]:
        turn = spun(each.axis, angles.get(each.name, each.reference) - each.reference)
        origin = origin + axes @ (each.anchor - turn @ each.anchor)
        axes = axes @ turn
    return axes, origin


def spun(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation about a unit vector."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
