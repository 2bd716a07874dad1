"""One finger of a URDF in Pinocchio, with the same questions as `MujocoFinger`: names decide, not the order of joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio

from awiwi_gen.interchange.draft import DraftFinger, DraftHand

from .mujoco_finger import motions, moved


@dataclass
class PinocchioFinger:
    """A model whose mimic joints are independent, as Pinocchio has them by default; `motions` makes them follow."""

    model: Any
    hand: DraftHand
    finger: DraftFinger

    def __post_init__(self) -> None:
        self.data = self.model.createData()
        self.curves = motions(self.finger)
        joints = [link.published.name for link in self.finger.links]
        missing = [name for name in joints if not self.model.existJointName(name)]
        if missing:
            raise ValueError(f"Pinocchio has no joints {', '.join(missing)}")
        self.joints = [self.model.joints[self.model.getJointId(name)] for name in joints]
        self.dofs = [joint.idx_v for joint in self.joints]
        self.bodies = [self.model.getFrameId(link.body, pinocchio.FrameType.BODY) for link in self.finger.links]
        self.palm = self.model.getFrameId(self.hand.palm, pinocchio.FrameType.BODY)
        pinocchio.framesForwardKinematics(self.model, self.data, pinocchio.neutral(self.model))
        self.drawn = [self.data.oMf[body].rotation.copy() for body in self.bodies]

    def set(self, q: np.ndarray, qd: np.ndarray) -> None:
        """Move the finger; everything else stands as drawn."""
        position = pinocchio.neutral(self.model)
        self.velocity, acceleration = np.zeros(self.model.nv), np.zeros(self.model.nv)
        angles, self.matrix, drift = moved(self.curves, q, qd)
        for joint, angle in zip(self.joints, angles, strict=True):
            # A continuous joint has the cosine and the sine of its angle.
            values = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
            position[joint.idx_q : joint.idx_q + joint.nq] = values
        self.velocity[self.dofs], acceleration[self.dofs] = self.matrix @ qd, drift
        self.mass = pinocchio.crba(self.model, self.data, position).copy()
        self.torque = pinocchio.rnea(self.model, self.data, position, self.velocity, acceleration).copy()
        pinocchio.framesForwardKinematics(self.model, self.data, position)

    def mass_matrix(self) -> np.ndarray:
        upper = np.triu(self.mass)
        full = upper + np.triu(self.mass, 1).T
        return self.matrix.T @ full[np.ix_(self.dofs, self.dofs)] @ self.matrix

    def bias(self) -> np.ndarray:
        """Torques without acceleration of the coordinates."""
        return self.matrix.T @ self.torque[self.dofs]

    def passive(self) -> np.ndarray:
        """Torques of joint dampers, which Pinocchio reads and leaves to its users."""
        return -self.matrix.T @ (np.asarray(self.model.damping) * self.velocity)[self.dofs]

    def gravity(self) -> np.ndarray:
        """Gravity in the finger's base frame."""
        return self.base()[0].T @ self.model.gravity.linear

    def base(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes and origin of the base frame in the world."""
        pose = self.data.oMf[self.palm]
        return pose.rotation @ self.finger.axes, pose.translation + pose.rotation @ self.finger.position

    def link_frames(self) -> list[np.ndarray]:
        """The frame (4 x 4) of each link in the base frame."""
        base_axes, base_origin = self.base()
        found = []
        for link, body, drawn in zip(self.finger.links, self.bodies, self.drawn, strict=True):
            pose, frame = self.data.oMf[body], np.eye(4)
            frame[:3, :3] = base_axes.T @ pose.rotation @ drawn.T @ link.frame.axes
            frame[:3, 3] = base_axes.T @ (pose.translation - base_origin)
            found.append(frame)
        return found
