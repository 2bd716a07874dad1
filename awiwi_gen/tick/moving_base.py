"""What a hand that turns does to its fingers: torques of inertia on the joints, for hands in fixed axes do not have them.

In axes that turn with omega about the palm's origin, a mass m at p that moves with v bears (by Newton, in a frame at rest)

    F = -m (alpha x p + omega x (omega x p) + 2 omega x v)

A link of mass m with the second moments S about its centre of mass moves as six points of m / 6 on the principal axes of
S, at the distances sqrt(3 S_kk / m) to either side: they have its mass, its centre of mass and its inertia.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.hand_header import base_pose

if TYPE_CHECKING:
    from awiwi_gen.hand import Finger
    from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
NEARBY = 1e-6  # rad, or m: where slopes of poses are taken


class Points:
    """The masses [kg] of a finger's links as points: their places in the palm and the slopes of these by the joints."""

    def __init__(self, library: Library, name: str, finger: Finger) -> None:
        self._poses = library[f"{name}_link_poses"]
        self._base: Array = np.array([float(number) for number in base_pose(finger)]).reshape(4, 4)
        links = [(i, link) for i, link in enumerate(finger.links) if link.mass is not None]
        self._links = [i for i, _ in links]
        self._places: Array = np.array([_points_of(link) for _, link in links]).transpose(0, 2, 1)  # (links, 4, 6)
        self.masses: Array = np.repeat([float(link.mass or 0) / 6 for _, link in links], 6)

    def places(self, q: Array) -> Array:
        """Places (..., points, 3) [m] in the palm at the joints q (..., joints)."""
        poses = self._poses(q)
        poses = poses[0] if isinstance(poses, tuple) else poses  # of a four-bar, a status comes with them
        found = self._base @ poses[..., self._links, :, :] @ self._places
        turned: Array = np.swapaxes(found[..., :3, :], -1, -2).reshape(*q.shape[:-1], -1, 3)
        return turned

    def torques(self, q: Array, qd: Array, omega: Array, alpha: Array) -> Array:
        """Torques (joints,) [N m] of inertia on the joints where the palm turns with omega [rad/s] and alpha [rad/s^2]."""
        n = len(q)
        beside = q + NEARBY * np.concatenate([np.eye(n), -np.eye(n), np.zeros((1, n))])
        found = self.places(beside)
        slopes = (found[:n] - found[n : 2 * n]) / (2 * NEARBY)  # (joints, points, 3)
        p, v = found[-1], (qd @ slopes.reshape(n, -1)).reshape(-1, 3)
        turning = across(omega)
        bears = self.masses[:, None] * (p @ (across(alpha) + turning @ turning).T + 2 * v @ turning.T)
        torques: Array = -slopes.reshape(n, -1) @ bears.ravel()
        return torques


def across(omega: Array) -> Array:
    """The matrix (3, 3) of the vector product with omega (3,)."""
    x, y, z = omega
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _points_of(link: Any) -> Array:
    """Six points (6, 4), homogeneous, that move as a link does."""
    xx, yy, zz, xy, xz, yz = (float(getattr(link.inertia, name)) for name in ("xx", "yy", "zz", "xy", "xz", "yz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments, axes = np.linalg.eigh(np.trace(tensor) / 2 * np.eye(3) - tensor)
    reach = np.sqrt(3 * np.maximum(moments, 0) / float(link.mass)) * axes  # columns
    centre = np.array([float(each) for each in link.com])
    return np.column_stack([np.concatenate([centre + reach.T, centre - reach.T]), np.ones(6)])
