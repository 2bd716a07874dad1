"""Kinematics of a finger by its definition: transformations multiplied along the chain (eq. 5.2, 5.3, table 5.1).

The frame of link i is T_i = T_(i-1) Trans(offset_(i-1)) R_i Rz(c_i), that of the fingertip lies one offset beyond the
last. R_i is the fixed rotation: the link's turn, then its roll, pitch and yaw as in URDF. The chain angles c are functions
of the n independent joint angles q: a joint rotates by its angle less its reference, a coupled joint's angle is in
proportion to its leader's (eq. 5.16), and a four-bar counts twice, as its massless crank (angle q + reference, offset
along the crank) and as its coupler, which is parallel to the turned frame at q = 0, or at the end of the joint's range
that is nearest to it. A slide does not rotate: Trans(0, 0, c) stands for its Rz(c), by its position less its reference.

All velocities are derivatives of positions. Entries of results may be `Named` symbols.
"""

from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.four_bar import four_bar_angles
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.structure import Finger, coordinates, fixed_turns, leaders, motion


@dataclass(frozen=True)
class Frame:
    """A frame of the chain in base axes: its unit vectors (3 x 3, columns) and its origin (3 x 1) [m]."""

    axes: Matrix
    origin: Matrix

    def matrix(self) -> Matrix:
        """The transformation (4 x 4) of this frame's coordinates into the base."""
        return Matrix([[self.axes, self.origin], [sympy.zeros(1, 3), sympy.ones(1, 1)]])

    def point(self, local: Matrix) -> Matrix:
        """Base coordinates (3 x 1) [m] of a point given in this frame."""
        return self.origin + self.axes * local


def joint_angles(finger: Finger, q: Matrix) -> dict[str, Expr]:
    """Angle [rad], or position of a slide [m], of every joint by name, coupled ones included; the crank's of a four-bar."""
    position = coordinates(finger)
    angles = {link.joint: q[position[link.joint]] for link in finger.links}
    for follower, leader in leaders(finger).items():
        terms = enumerate(motion(finger, follower))
        angles[follower] = sympy.Add(*(coefficient * angles[leader] ** power for power, coefficient in terms))
    return angles


def joint_rates(finger: Finger, q: Matrix, qd: Matrix) -> dict[str, Expr]:
    """Velocity [rad/s] of every joint by name."""
    derivation, rates = Derivation(), dict(zip(q, qd, strict=True))
    return {joint: derivation.along(angle, rates) for joint, angle in joint_angles(finger, q).items()}


def link_poses(finger: Finger, q: Matrix) -> list[Matrix]:
    """Poses (4 x 4 each) of the links' frames in the base: at their joints, after their rotations (eq. 5.2)."""
    return [frame.matrix() for frame in frames(finger, q, Derivation())[1:-1]]


def fingertip_pose(finger: Finger, q: Matrix) -> Matrix:
    """Pose (4 x 4) of the fingertip in the base (eq. 5.3)."""
    return frames(finger, q, Derivation())[-1].matrix()


def jacobian(finger: Finger, q: Matrix) -> Matrix:
    """J (6 x n), in base axes: velocity, then angular velocity of the tip per unit velocity of each joint."""
    derivation = Derivation()
    tip = frames(finger, q, derivation)[-1]
    columns = []
    for angle in q:
        skew = tip.axes.applyfunc(lambda entry, angle=angle: derivation.partial(entry, angle)) * tip.axes.T
        columns.append([derivation.partial(x, angle) for x in tip.origin] + axial(skew))
    return Matrix(columns).T


def pose_and_jacobian(finger: Finger, q: Matrix) -> tuple[Matrix, Matrix]:
    """Pose (4 x 4) of the fingertip and its Jacobian (6 x n), in base axes."""
    return fingertip_pose(finger, q), jacobian(finger, q)


def axial(skew: Matrix) -> list[Expr]:
    """The vector w of a skew-symmetric matrix: the matrix takes x to the cross product w x x."""
    return [skew[2, 1], skew[0, 2], skew[1, 0]]


def frames(finger: Finger, q: Matrix, derivation: Derivation) -> list[Frame]:
    """The base, then the frame of each link, then the fingertip."""
    angles = iter(_chain_angles(finger, q, derivation))
    chain = [Frame(sympy.eye(3), sympy.zeros(3, 1))]
    fixed, angle, offset = sympy.eye(3), sympy.S.Zero, sympy.zeros(3, 1)
    for link in finger.links:
        origin = chain[-1].point(offset)
        # Rotations about the same axis are one rotation, by the sum of their angles.
        turned = fixed_rotation(link)
        if turned != sympy.eye(3):
            fixed, angle = chain[-1].axes * turned, sympy.S.Zero
        moved = next(angles)
        if link.slides:
            origin += fixed.col(2) * moved
        else:
            angle += moved
        if link.four_bar is not None:
            origin += fixed * rotation(angle) * Matrix([link.four_bar.crank, 0, 0])
            angle += next(angles)
        chain.append(Frame(derivation.name_all(fixed * rotation(angle)), derivation.name_all(origin)))
        offset = Matrix(link.offset)
    return [*chain, Frame(chain[-1].axes, chain[-1].point(offset))]


def joint_frames(finger: Finger, q: Matrix, derivation: Derivation) -> dict[str, Frame]:
    """Joint -> the frame in which it rotates or slides: at the joint, after its fixed rotation and before its own motion."""
    found, offset = {}, sympy.zeros(3, 1)
    for link, before in zip(finger.links, frames(finger, q, derivation)[:-2], strict=True):
        found[link.joint] = Frame(before.axes * fixed_rotation(link), before.point(offset))
        offset = Matrix(link.offset)
    return found


def rotation(angle: Expr) -> Matrix:
    """Rz (3 x 3): rotation by an angle [rad] about z."""
    c, s = sympy.cos(angle), sympy.sin(angle)
    return Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def fixed_rotation(part: Any) -> Matrix:
    """The fixed rotation (3 x 3) of a link in front of its joint, or of a finger's base."""
    product = sympy.eye(3)
    for axis, quarters, angle in fixed_turns(part):
        order = [(k + 2 - axis) % 3 for k in range(3)]
        product *= rotation(angle if quarters is None else quarters * sympy.pi / 2).extract(order, order)
    return product


def _chain_angles(finger: Finger, q: Matrix, derivation: Derivation) -> list[Expr]:
    angles: list[Expr] = []
    for link, own in zip(finger.links, joint_angles(finger, q).values(), strict=True):
        if link.four_bar is None:
            angles.append(own if link.reference is None else own - link.reference)
        else:
            reference = link.four_bar.reference
            cranks = own + reference, link.start + reference
            now, at_start = (four_bar_angles(link.four_bar, crank)[0] for crank in cranks)
            angles += [own + reference, derivation.name(now) - derivation.name(at_start) - own - reference]
    return angles
