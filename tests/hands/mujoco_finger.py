"""One finger of a MuJoCo model: what MuJoCo says of it while everything else stands as drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from awiwi_gen.interchange.draft import DraftFinger, DraftHand

from .inside_wraps import corrections

Curve = tuple[int, Polynomial]  # the coordinate that moves a joint, and the joint's angle over that coordinate


def motions(finger: DraftFinger) -> list[Curve]:
    """How the independent joints move every joint."""
    mimics = {mimic.published: mimic for mimic in finger.followed}
    free = [link.joint for link in finger.links if link.published.name not in mimics]
    found = []
    for link in finger.links:
        mimic = mimics.get(link.published.name)
        curve = mimic.curve if mimic else Polynomial([0.0, 1.0])
        found.append((free.index(mimic.leader if mimic else link.joint), curve))
    return found


def moved(curves: list[Curve], q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of all joints: angles, rates over those of the coordinates (joints x n), and accelerations while these have none."""
    angles, rates, drift = np.zeros(len(curves)), np.zeros((len(curves), len(q))), np.zeros(len(curves))
    for row, (column, curve) in enumerate(curves):
        angles[row] = curve(q[column])
        rates[row, column] = curve.deriv()(q[column])
        drift[row] = curve.deriv(2)(q[column]) * qd[column] ** 2
    return angles, rates, drift


@dataclass
class MujocoFinger:
    """A compiled model, and the finger of it that a draft describes.

    States are those of the hand file: independent joints in its order, counted as it counts them.
    """

    compiled: Any
    hand: DraftHand
    finger: DraftFinger

    def __post_init__(self) -> None:
        self.data = mujoco.MjData(self.compiled)
        joints = [link.published.name for link in self.finger.links]
        self.qpos = [int(self.compiled.joint(name).qposadr[0]) for name in joints]
        self.dofs = [int(self.compiled.joint(name).dofadr[0]) for name in joints]
        self.curves = motions(self.finger)
        self.last = [self._is_last(link.published.name) for link in self.finger.links]
        mujoco.mj_resetData(self.compiled, self.data)
        self.data.qpos[:] = self.compiled.qpos0
        mujoco.mj_kinematics(self.compiled, self.data)
        self.drawn = self.data.xmat.reshape(-1, 3, 3).copy()
        self.tendons = [self.compiled.tendon(tendon.name).id for tendon in self.finger.tendons]

    def _is_last(self, name: str) -> bool:
        """Whether a joint is the last one of its body, which carries the frame of its link."""
        joint = self.compiled.joint(name).id
        body = int(self.compiled.jnt_bodyid[joint])
        return joint == self.compiled.body_jntadr[body] + self.compiled.body_jntnum[body] - 1

    def set(self, q: np.ndarray, qd: np.ndarray) -> None:
        """Move the finger; everything else stands as drawn."""
        mujoco.mj_resetData(self.compiled, self.data)
        self.data.qpos[:] = self.compiled.qpos0
        self.data.qpos[self.qpos], self.matrix, self.drift = moved(self.curves, q, qd)
        self.data.qvel[self.dofs] = self.matrix @ qd
        mujoco.mj_forward(self.compiled, self.data)

    def mass_matrix(self) -> np.ndarray:
        return self.matrix.T @ self._full_mass_matrix() @ self.matrix

    def _full_mass_matrix(self) -> np.ndarray:
        full = np.zeros((self.compiled.nv, self.compiled.nv))
        mujoco.mj_fullM(self.compiled, self.data, full)
        return full[np.ix_(self.dofs, self.dofs)]

    def bias(self) -> np.ndarray:
        """Torques without acceleration of the coordinates: followers accelerate where their curves bend."""
        return self.matrix.T @ (self.data.qfrc_bias[self.dofs] + self._full_mass_matrix() @ self.drift)

    def passive(self) -> np.ndarray:
        """Torques of joint dampers and springs, as they act on the joints."""
        return self.matrix.T @ (self.data.qfrc_damper + self.data.qfrc_spring)[self.dofs]

    def lengths(self) -> np.ndarray:
        return (self.data.ten_length + corrections(self.compiled, self.data)[0])[self.tendons]

    def arms(self) -> np.ndarray:
        full = np.zeros((self.compiled.ntendon, self.compiled.nv))
        if self.compiled.ntendon:
            rows = np.asarray(self.data.ten_J).reshape(-1)
            if rows.size == full.size:
                full = rows.reshape(full.shape)
            else:
                for t in range(self.compiled.ntendon):
                    at, count = int(self.compiled.ten_J_rowadr[t]), int(self.compiled.ten_J_rownnz[t])
                    full[t, self.compiled.ten_J_colind[at : at + count]] = rows[at : at + count]
        full = full + corrections(self.compiled, self.data)[1]
        return full[np.ix_(self.tendons, self.dofs)] @ self.matrix

    def gravity(self) -> np.ndarray:
        """Gravity in the finger's base frame."""
        return self.base()[0].T @ self.compiled.opt.gravity

    def base(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes and origin of the base frame in the world."""
        palm = self.compiled.body(self.hand.palm).id
        axes = self.data.xmat[palm].reshape(3, 3)
        return axes @ self.finger.axes, self.data.xpos[palm] + axes @ self.finger.position

    def link_frames(self) -> list[np.ndarray]:
        """The frame (4 x 4) of each link in the base frame; of a joint with others after it in its body only z."""
        base_axes, base_origin = self.base()
        found = []
        for link, last in zip(self.finger.links, self.last, strict=True):
            joint = self.compiled.joint(link.published.name)
            body = int(self.compiled.jnt_bodyid[joint.id])
            frame = np.eye(4)
            axes = self.data.xmat[body].reshape(3, 3) @ self.drawn[body].T @ link.frame.axes
            frame[:3, :3] = base_axes.T @ axes
            if not last:
                frame[:3, :2] = np.nan
                frame[:3, 2] = base_axes.T @ self.data.xaxis[joint.id]
            anchor = self.data.xanchor[joint.id]  # of a slide, before it moves
            if link.slides:
                place = int(joint.qposadr[0])
                anchor = anchor + self.data.xaxis[joint.id] * (self.data.qpos[place] - self.compiled.qpos0[place])
            frame[:3, 3] = base_axes.T @ (anchor - base_origin)
            found.append(frame)
        return found
