"""A finger in the palm: the frame that its base stands in, as the hand file gives it."""

from sympy import Matrix

from awiwi_gen.definitions.kinematics import Frame, fingertip_pose, fixed_rotation
from awiwi_gen.structure import Finger


def palm_pose(finger: Finger, q: Matrix) -> Matrix:
    """Pose (4 x 4) of the fingertip in the palm."""
    return Frame(fixed_rotation(finger.base), Matrix(finger.base.position)).matrix() * fingertip_pose(finger, q)


def palm_gravity(finger: Finger, g_palm: Matrix) -> Matrix:
    """A vector (3) of palm axes in the axes of the finger's base."""
    return fixed_rotation(finger.base).T * g_palm
