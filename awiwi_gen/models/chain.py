"""Kinematics of a finger by its definition: the product of the transformations along the chain (eq. 5.2, 5.3, table 5.1).

The frame of link i is `T_i = T_(i-1) Trans(offset_(i-1)) R(turn_i) Rz(c_i)`, and `T_last Trans(offset_last)` is the fingertip.
The chain angles c are functions of the n independent joint angles q: a coupled joint turns in proportion to its leader (eq. 5.16),
and a four-bar counts twice, as its massless crank (angle q + reference, offset along the crank) and as its coupler.
Velocities are derivatives of positions, nothing else. Entries may be `Named` symbols.
"""

from dataclasses import dataclass

import sympy
from sympy import Expr, Matrix

from awiwi_gen.models.four_bar import four_bar_angles
from awiwi_gen.models.naming import Derivation
from awiwi_gen.models.tree import Finger, coordinates, leaders, quarter_turns, radius


@dataclass(frozen=True)
class Frame:
    """A frame of the chain: axes (3 x 3, its unit vectors as columns) and origin (3 x 1, m), both in base axes."""

    axes: Matrix
    origin: Matrix

    def matrix(self) -> Matrix:
        """The homogeneous transformation (4 x 4) to base coordinates."""
        return Matrix([[self.axes, self.origin], [sympy.zeros(1, 3), sympy.ones(1, 1)]])

    def point(self, local: Matrix) -> Matrix:
        """Base coordinates (3 x 1) of a point given in this frame."""
        return self.origin + self.axes * local


def chain_angles(finger: Finger, q: Matrix) -> list[Expr]:
    """Angles of the chain's joints [rad], base to tip: one per link, and one more for the crank before a four-bar's coupler."""
    return _chain_angles(finger, q, Derivation("c"))


def joint_angles(finger: Finger, q: Matrix) -> dict[str, Expr]:
    """Angle [rad] of every joint by name, the coupled ones included; for a four-bar the angle its crank has turned."""
    position, follows = coordinates(finger), leaders(finger)
    angles = {link.joint: q[position[link.joint]] for link in finger.links}
    for follower, leader in follows.items():
        # The coupling tendon gives to one pulley what it takes from the other: r_leader q_leader = r_follower q_follower.
        angles[follower] = angles[leader] * radius(finger, leader) / radius(finger, follower)
    return angles


def link_poses(finger: Finger, q: Matrix) -> list[Matrix]:
    """Poses (4 x 4 each) of the links' frames, at their joints and after their rotations, in the finger's base (eq. 5.2)."""
    return [frame.matrix() for frame in frames(finger, q, Derivation("p"))[1:-1]]


def fingertip_pose(finger: Finger, q: Matrix) -> Matrix:
    """Pose (4 x 4) of the fingertip in the finger's base (eq. 5.3)."""
    return frames(finger, q, Derivation("p"))[-1].matrix()


def jacobian(finger: Finger, q: Matrix) -> Matrix:
    """J (6 x n): the tip's velocity [m/rad], then its angular velocity [rad/rad], per unit joint velocity, in base axes."""
    derivation = Derivation("j")
    tip = frames(finger, q, derivation)[-1]
    columns = []
    for angle in q:
        turning = tip.axes.applyfunc(lambda entry: derivation.partial(entry, angle)) * tip.axes.T
        columns.append([derivation.partial(x, angle) for x in tip.origin] + axial(turning))
    return Matrix(columns).T


def axial(skew: Matrix) -> list[Expr]:
    """The vector w of a skew matrix with skew x = w x x."""
    return [skew[2, 1], skew[0, 2], skew[1, 0]]


def frames(finger: Finger, q: Matrix, derivation: Derivation) -> list[Frame]:
    """The base, then the frame of each link, then the fingertip."""
    angles = iter(_chain_angles(finger, q, derivation))
    chain = [Frame(sympy.eye(3), sympy.zeros(3, 1))]
    unturned, angle, offset = sympy.eye(3), sympy.S.Zero, sympy.zeros(3, 1)
    for link in finger.links:
        origin = chain[-1].point(offset)
        if link.turn != "none":
            unturned, angle = chain[-1].axes * _turn(link.turn), sympy.S.Zero
        angle += next(angles)
        if link.four_bar is not None:
            origin += unturned * rotation(angle) * Matrix([link.four_bar.crank, 0, 0])
            angle += next(angles)
        # Rotations about one axis are one rotation by the sum of the angles.
        axes = unturned * rotation(angle)
        chain.append(Frame(derivation.name_all(axes), derivation.name_all(origin)))
        offset = Matrix(link.offset)
    return [*chain, Frame(chain[-1].axes, chain[-1].point(offset))]


def seats(finger: Finger, q: Matrix, derivation: Derivation) -> dict[str, Frame]:
    """Joint -> the frame it turns in: at the joint, after the fixed turn and before the joint's own rotation."""
    found, offset = {}, sympy.zeros(3, 1)
    for link, before in zip(finger.links, frames(finger, q, derivation)):
        axes = before.axes if link.turn == "none" else before.axes * _turn(link.turn)
        found[link.joint], offset = Frame(axes, before.point(offset)), Matrix(link.offset)
    return found


def rotation(angle: Expr) -> Matrix:
    """Rz: rotation (3 x 3) by an angle about z."""
    c, s = sympy.cos(angle), sympy.sin(angle)
    return Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _turn(turn: str) -> Matrix:
    """The fixed rotation (3 x 3) before a joint: a number of quarter turns about x, y or z."""
    axis, quarters = quarter_turns(turn)
    about_z = rotation(quarters * sympy.pi / 2)
    order = [(k - axis + 2) % 3 for k in range(3)]
    return about_z.extract(order, order)


def _chain_angles(finger: Finger, q: Matrix, derivation: Derivation) -> list[Expr]:
    angles: list[Expr] = []
    for link, own in zip(finger.links, joint_angles(finger, q).values()):
        if link.four_bar is None:
            angles.append(own)
            continue
        crank = own + link.four_bar.reference
        closed, at_rest = (four_bar_angles(link.four_bar, angle)[0] for angle in (own, sympy.S.Zero))
        angles += [crank, derivation.name(closed) - derivation.name(at_rest) - crank]
    return angles
