"""A palm on joints in series: vectors rotated about one axis after the other; velocities are axis x lever."""

from collections.abc import Iterator
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Palm, fixed_turns
from awiwi_gen.witnesses.dynamics.assembly import Turn, about_z

_Z = SX([0, 0, 1])


def pose(palm: Palm, q: SX) -> SX:
    """Pose (4 x 4) of the palm in the forearm."""
    axes = _rotated(palm, SX.eye(3))
    origin = SX.zeros(3)
    for joint, angle in _inwards(palm, q):
        both = _before(joint, angle, ca.horzcat(axes, origin + ca.vertcat(*joint.offset)))
        axes, origin = both[:, :3], both[:, 3]
    if palm.base is not None:
        axes, origin = _rotated(palm.base, axes), _rotated(palm.base, origin) + ca.vertcat(*palm.base.position)
    return ca.vertcat(ca.horzcat(axes, origin), SX([[0, 0, 0, 1]]))


def jacobian(palm: Palm, q: SX) -> SX:
    """J (6 x n), in forearm axes: velocity [m/rad], then angular velocity [rad/rad] of the palm's frame."""
    lever, linear, angular = SX.zeros(3), SX(3, 0), SX(3, 0)
    for joint, angle in _inwards(palm, q):
        lever = lever + ca.vertcat(*joint.offset)
        columns = ca.horzcat(lever, ca.cross(_Z, lever), linear, _Z, angular)
        columns = _before(joint, angle, columns)
        count = linear.shape[1] + 1
        lever, linear, angular = columns[:, 0], columns[:, 1 : 1 + count], columns[:, 1 + count :]
    if palm.base is not None:
        linear, angular = _rotated(palm.base, linear), _rotated(palm.base, angular)
    return ca.densify(ca.vertcat(linear, angular))


def gravity(palm: Palm, q: SX, g_forearm: SX) -> SX:
    """A vector (3) of forearm axes in the palm's axes."""
    if palm.base is not None:
        g_forearm = _turned_back(palm.base, g_forearm)
    for joint, angle in reversed(list(_inwards(palm, q))):
        g_forearm = about_z((ca.cos(angle), ca.sin(angle))).T @ _turned_back(joint, g_forearm)
    return _turned_back(palm, g_forearm)


def _inwards(palm: Palm, q: SX) -> Iterator[tuple[Any, SX]]:
    """Joint and rotation [rad] of each, from the palm to the forearm."""
    for index in reversed(range(len(palm.joints))):
        joint = palm.joints[index]
        yield joint, q[index] if joint.reference is None else q[index] - joint.reference


def _before(joint: Any, angle: SX, columns: SX) -> SX:
    """Vectors (3 x any) of the axes behind a joint, in those before it."""
    return _rotated(joint, about_z((ca.cos(angle), ca.sin(angle))) @ columns)


def _rotated(part: Any, columns: SX) -> SX:
    """Vectors (3 x any) behind a part's fixed rotation, in the axes before it."""
    for step in reversed(fixed_turns(part)):
        columns = Turn(*step).matrix() @ columns
    return columns


def _turned_back(part: Any, vector: SX) -> SX:
    """A vector (3) before a part's fixed rotation, in the axes behind it."""
    for step in fixed_turns(part):
        vector = Turn(*step).matrix().T @ vector
    return vector
