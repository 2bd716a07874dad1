"""Link frames of a finger: z along the joint's axis, so that as little as possible remains to be computed.

The frame of a link is that of the link before, moved by `offset`, turned by a quarter turn or a roll about x, and then
by its joint about z. Where the next axis is along a coordinate axis, a quarter turn leads there. Everywhere else the
frame before is turned about its own z until the next axis is in its y-z plane: the joint's reference takes that angle,
and a roll remains. Behind a slide, whose reference is no angle, a yaw remains too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from awiwi_gen.interchange.model import Array

__all__ = ["Axis", "Frame", "about", "base_frame", "link_frames", "rpy_of", "turn_matrix"]

ALIGNED = 1e-12
"""Largest sine of the angle between two directions that are one but for rounding."""
_TURNS = ("none", "x+90", "x-90", "y+90", "y-90")  # one for each direction of the next axis but that opposite z


@dataclass(frozen=True, eq=False)
class Axis:
    """A joint's axis in the world, as drawn: a unit vector (3) through a point (3); a slide moves along it."""

    direction: Array
    anchor: Array
    slides: bool = False


@dataclass(frozen=True, eq=False)
class Frame:
    """A link's frame: what leads there from the link before, and its axes (3 x 3) and origin (3) in the world, as drawn.

    `angle` is by how much the frame is turned about its z where the joint is at the file's reference.
    """

    turn: str
    roll: float
    angle: float
    axes: Array
    origin: Array
    yaw: float = 0.0


def turn_matrix(turn: str) -> Array:
    """The exact matrix (3 x 3) of a quarter turn such as "x+90"."""
    if turn == "none":
        return np.eye(3)
    return about("xyz".index(turn[0]), math.radians(float(turn[1:])))


def about(axis: int, angle: float) -> Array:
    """The matrix (3 x 3) of a rotation about an axis of the frame; quarter turns are exact."""
    c, s = math.cos(angle), math.sin(angle)
    quarters = angle / (math.pi / 2)
    if quarters == round(quarters):
        c, s = float(round(c)), float(round(s))
    order = [(k + 2 - axis) % 3 for k in range(3)]
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])[np.ix_(order, order)] + 0.0  # no negative zeros


def base_frame(axes: Array, first: Axis) -> Array:
    """The base's axes (3 x 3): those given, turned if the first joint's axis is along none of them."""
    local = axes.T @ first.direction
    if _aligned(local) is not None:
        return axes
    yaw, roll = _yaw_and_roll(local)
    return np.asarray(axes @ about(2, yaw) @ about(0, roll))


def _aligned(local: Array) -> str | None:
    """The quarter turn that takes z to a direction of the frame; None where there is none. Opposite z needs a roll."""
    nearest = np.rint(local)
    if abs(nearest).sum() != 1 or np.linalg.norm(local - nearest) > ALIGNED or nearest[2] < 0:
        return None
    return next(turn for turn in _TURNS if np.array_equal(turn_matrix(turn)[:, 2], nearest))


def _yaw_and_roll(local: Array) -> tuple[float, float]:
    """Angles of Rz(yaw) Rx(roll) that takes z to a direction; the yaw is at most a quarter turn to either side."""
    across = math.hypot(local[0], local[1])
    if across <= ALIGNED:
        return 0.0, 0.0 if local[2] > 0 else math.pi
    yaw = math.atan2(local[0], -local[1])
    roll = math.atan2(across, local[2])
    if abs(yaw) > math.pi / 2:
        yaw, roll = yaw - math.copysign(math.pi, yaw), -roll
    return (yaw, roll) if abs(yaw) > ALIGNED else (0.0, roll)


def link_frames(base: Array, axes: list[Axis]) -> list[Frame]:
    """The frames of all links of a finger, from the base's axes (3 x 3) and the joints' axes."""
    found: list[Frame] = []
    before, carried = base, False  # by a slide
    for axis, following in zip(axes, [*axes[1:], None], strict=True):
        local = before.T @ axis.direction
        turn, yaw, roll = _aligned(local), 0.0, 0.0
        if turn is None:
            yaw, roll = _yaw_and_roll(local)
            yaw = yaw if carried else 0.0  # else the frame before is turned accordingly
        fixed = before @ turn_matrix(turn or "none") @ about(2, yaw) @ about(0, roll)
        angle = 0.0
        if following is not None and not axis.slides and _aligned(fixed.T @ following.direction) is None:
            angle = _yaw_and_roll(fixed.T @ following.direction)[0]
        turned = fixed @ about(2, angle) if angle else fixed
        found.append(Frame(turn or "none", roll, angle, turned, axis.anchor, yaw))
        before, carried = turned, axis.slides
    return found


def rpy_of(matrix: Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad] of a rotation Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.atan2(-matrix[2, 0], math.hypot(matrix[0, 0], matrix[1, 0]))
    if math.hypot(matrix[0, 0], matrix[1, 0]) < 1e-12:  # only the sum of roll and yaw counts
        return math.atan2(-matrix[1, 2], matrix[1, 1]), pitch, 0.0
    return math.atan2(matrix[2, 1], matrix[2, 2]), pitch, math.atan2(matrix[1, 0], matrix[0, 0])
