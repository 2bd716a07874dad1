"""Kinematics of a finger by recursion along the chain: velocities are axis x lever, or a slide's axis, without
derivatives."""

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger
from awiwi_gen.witnesses.dynamics.assembly import about_z, assemble, turns_of

_Z = SX([0, 0, 1])


def link_poses(finger: Finger, q: SX) -> list[SX]:
    """Poses (4 x 4 each) of the links' frames in the base: at their joints, after their rotations (eq. 5.2)."""
    assembly = assemble(finger, q)
    origin, poses = SX.zeros(3), {}
    for joint, axes in zip(assembly.joints, assembly.axes(), strict=True):
        poses[joint.link] = _pose(axes @ joint.rotation, origin + axes @ (joint.axis * (joint.shift + joint.travel)))
        origin = origin + axes @ joint.offset
    return list(poses.values())


def fingertip_pose(finger: Finger, q: SX) -> SX:
    """Pose (4 x 4) of the fingertip in the base (eq. 5.3)."""
    assembly = assemble(finger, q)
    axes = assembly.axes()[-1] @ assembly.joints[-1].rotation
    return _pose(axes, assembly.base_point(len(assembly.joints), SX.zeros(3)))


def jacobian(finger: Finger, q: SX) -> SX:
    """J (6 x n), in base axes: velocity, then angular velocity of the tip per unit velocity of each joint."""
    assembly = assemble(finger, q)
    lever, result = SX.zeros(3), SX.zeros(6, q.numel())
    for joint, axes in reversed(list(zip(assembly.joints, assembly.axes(), strict=True))):
        lever = joint.offset + lever
        spin = SX.zeros(3) if joint.slides else axes @ joint.axis
        column = ca.vertcat(axes @ joint.point_velocity(lever), spin)
        result[:, joint.coordinate] += joint.ratio * column
        lever = joint.inward(lever)
    return result


def pose_and_jacobian(finger: Finger, q: SX) -> tuple[SX, SX]:
    """Pose (4 x 4) of the fingertip and its Jacobian (6 x n), in base axes."""
    return fingertip_pose(finger, q), jacobian(finger, q)


def point_before_joint(finger: Finger, q: SX, name: str, local: SX) -> SX:
    """Base coordinates (3) [m] of a point (3) [m] given in the frame before the rotation of joint `name`."""
    assembly = assemble(finger, q)
    index = next(i for i, link in enumerate(finger.links) if link.joint == name)
    before = [joint for joint in assembly.joints if joint.link < index]
    _, yaw = turns_of(finger.links[index])
    local = about_z((ca.cos(yaw), ca.sin(yaw))) @ local + _Z * assembly.joints[len(before)].shift
    if before and before[-1].next_rotation is None:
        local = before[-1].rotation @ local
    return assembly.base_point(len(before), local)


def point_of_link(finger: Finger, q: SX, link: int, local: SX) -> tuple[SX, SX]:
    """Base coordinates (3) [m] of a point (3) [m] of a link's frame, and their rates (3 x n) per unit joint velocity.

    Link -1 is the base frame.
    """
    assembly, rates = assemble(finger, q), SX.zeros(3, q.numel())
    moving = [each for each in zip(assembly.joints, assembly.axes(), strict=True) if each[0].link <= link]
    if not moving:
        return local, rates
    last = moving[-1][0]
    point = last.rotation @ (local + _Z * (last.shift + last.travel))
    for joint, axes in reversed(moving):
        lever = point if joint is last else joint.offset + point
        rates[:, joint.coordinate] += joint.ratio * (axes @ joint.point_velocity(lever))
        point = joint.inward(lever)
    return assembly.base_rotation.T @ point, rates


def _pose(axes: SX, origin: SX) -> SX:
    return ca.vertcat(ca.horzcat(axes, origin), SX([[0, 0, 0, 1]]))
