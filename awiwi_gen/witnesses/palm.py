"""A finger in the palm: vectors rotated about one axis after the other, without a matrix of the base."""

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, fixed_turns
from awiwi_gen.witnesses.dynamics.assembly import Turn
from awiwi_gen.witnesses.kinematics import fingertip_pose


def palm_pose(finger: Finger, q: SX) -> SX:
    """Pose (4 x 4) of the fingertip in the palm."""
    pose = fingertip_pose(finger, q)
    columns = pose[:3, :]
    for turn in reversed(_turns(finger)):
        columns = turn.matrix() @ columns
    columns[:, 3] += ca.vertcat(*finger.base.position)
    return ca.vertcat(columns, pose[3, :])


def palm_gravity(finger: Finger, g_palm: SX) -> SX:
    """A vector (3) of palm axes in the axes of the finger's base."""
    for turn in _turns(finger):
        g_palm = turn.matrix().T @ g_palm
    return g_palm


def _turns(finger: Finger) -> list[Turn]:
    return [Turn(*step) for step in fixed_turns(finger.base)]
