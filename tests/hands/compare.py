"""Generated kernels of one finger against MuJoCo and Pinocchio, at random states within the finger's range."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio

import awiwi_gen
from awiwi_gen.hand import Hand
from awiwi_gen.interchange import mjcf
from awiwi_gen.interchange.draft import DraftHand, DraftPalm

STATES = 200
GRAVITY = (1.3, -2.1, -9.4)
LIMIT = 1e-12
"""Largest difference, relative to the largest entry of the result (or 1 mm, 1 mN m, ... where all are small)."""
_SCALES = {"link_poses": 1.0, "bias": 1e-3, "inverse_dynamics": 1e-3, "mass_matrix": 1e-9, "tendon_lengths": 1e-3,
           "coupling": 1e-3, "fingertip_pose": 1.0, "palm_pose": 1.0, "palm_jacobian": 1.0, "palm_gravity": 1.0}  # fmt: skip


def compiled_model(path: Path, exact: bool, without: frozenset[str] = frozenset()) -> Any:
    """The model that the importer reads, less what its loss report says the hand cannot hold."""
    spec, _ = mjcf.parse(path, exact)
    mjcf.prepare(spec, set(without))
    compiled = mjcf.compile_spec(spec, path)
    for name, tensor in mjcf.unbalanced(spec, compiled).items():  # the published ones, that MuJoCo would not have taken
        index = compiled.body(name).id
        compiled.body_inertia[index], axes = np.linalg.eigh(tensor)
        mujoco.mju_mat2Quat(compiled.body_iquat[index], (axes * np.linalg.det(axes)).ravel())
    for each in ("tendon_damping", "tendon_armature", "tendon_frictionloss", "tendon_stiffness"):
        getattr(compiled, each)[:] = 0
    for each in ("jnt_stiffnesspoly", "dof_dampingpoly"):
        getattr(compiled, each)[:] = 0
    compiled.opt.gravity[:] = GRAVITY
    return compiled


def pinocchio_model(path: Path) -> Any:
    """The model of a URDF in Pinocchio, with quarter turns where the importer has them."""
    model = pinocchio.buildModelFromXML(mjcf.urdf_text(path, exact=False)[0])
    model.gravity.linear[:] = GRAVITY
    return model


def worst_differences(simulated: Any, hand: Hand, generated: Path) -> dict[str, float]:
    """Kernel -> its worst difference from a finger in MuJoCo or Pinocchio."""
    finger = simulated.finger.name
    library = awiwi_gen.load(generated)
    links = {link.joint: link for link in hand.fingers[finger].links}
    ends = np.array([[float(links[j].low), float(links[j].high)] for j in hand.fingers[finger].joints])
    random = np.random.default_rng(13)
    worst = Worst()
    compare = worst.compare
    for _ in range(STATES):
        q = random.uniform(ends[:, 0], ends[:, 1])
        qd, qdd = random.uniform(-5, 5, len(q)), random.uniform(-100, 100, len(q))
        simulated.set(q, qd)
        g = simulated.gravity()
        mass = simulated.mass_matrix()
        bias = (
            simulated.bias()
            - simulated.passive()
            + dry_friction(hand, finger, simulated.matrix @ qd) @ simulated.matrix
        )
        compare("mass_matrix", library[f"{finger}_mass_matrix"](q), mass)
        compare("bias", library[f"{finger}_bias"](q, qd, g), bias)
        compare("inverse_dynamics", library[f"{finger}_inverse_dynamics"](q, qd, qdd, g), mass @ qdd + bias)
        for mine, theirs in zip(library[f"{finger}_link_poses"](q), simulated.link_frames(), strict=True):
            known = ~np.isnan(theirs)
            compare("link_poses", mine[known], theirs[known])
        if hand.fingers[finger].pulled:
            own = hand.fingers[finger]  # of tendons that are wound both ways, the first is the model's
            pulled = [own.pulled_numbers[transmission.members[0]] for transmission in own.transmissions]
            h, arms = library[f"{finger}_tendon_lengths"](q), library[f"{finger}_coupling"](q)
            compare("tendon_lengths", within_domain(h, "h"), simulated.lengths()[pulled])
            compare("coupling", within_domain(arms, "P"), simulated.arms()[pulled])
    return worst.found


def within_domain(result: Any, port: str) -> np.ndarray:
    """An output of a kernel; infinite where it has a status that is not zero, as those of tendons round bodies have."""
    if not hasattr(result, "status"):
        return np.asarray(result)
    return np.asarray(getattr(result, port)) if result.status == 0 else np.array(np.inf)


class Worst:
    """The worst difference of each kernel so far."""

    def __init__(self) -> None:
        self.found: dict[str, float] = {}

    def compare(self, kernel: str, ours: Any, theirs: Any) -> None:
        """Note the difference of one result, relative to its size."""
        scale = max(_SCALES[kernel], float(np.abs(theirs).max(initial=0.0)))
        worst = float(np.abs(np.asarray(ours) - theirs).max(initial=0.0)) / scale
        self.found[kernel] = max(self.found.get(kernel, 0.0), worst)


def palm_differences(compiled: Any, draft: DraftHand, wrist: DraftPalm, generated: Path) -> dict[str, float]:
    """Kernel of the palm -> its worst difference from MuJoCo, in the axes of the body that carries the wrist."""
    library, worst = awiwi_gen.load(generated), Worst()
    data, palm, carrier = mujoco.MjData(compiled), compiled.body(draft.palm).id, compiled.body(wrist.carrier).id
    joints = [compiled.joint(each.published.name) for each in wrist.joints]
    ends = np.array([each.limits for each in wrist.joints])
    random = np.random.default_rng(14)
    linear, angular = np.zeros((3, compiled.nv)), np.zeros((3, compiled.nv))
    for _ in range(STATES):
        q = random.uniform(ends[:, 0], ends[:, 1])
        data.qpos[:] = compiled.qpos0
        data.qpos[[int(joint.qposadr[0]) for joint in joints]] = q
        mujoco.mj_forward(compiled, data)
        mujoco.mj_jacBody(compiled, data, linear, angular, palm)
        axes, pose = data.xmat[carrier].reshape(3, 3), np.eye(4)
        pose[:3, :3] = axes.T @ data.xmat[palm].reshape(3, 3)
        pose[:3, 3] = axes.T @ (data.xpos[palm] - data.xpos[carrier])
        columns = [int(joint.dofadr[0]) for joint in joints]
        g = axes.T @ compiled.opt.gravity
        worst.compare("palm_pose", library.palm_pose(q), pose)
        worst.compare(
            "palm_jacobian", library.palm_jacobian(q), np.vstack([axes.T @ linear, axes.T @ angular])[:, columns]
        )
        worst.compare("palm_gravity", library.palm_gravity(q, g), pose[:3, :3].T @ g)
    return worst.found


def dry_friction(hand: Hand, finger: str, rates: np.ndarray) -> np.ndarray:
    """Torque of the smooth dry friction of every joint, which MuJoCo treats as a constraint."""
    torques = []
    for link, rate in zip(hand.fingers[finger].links, rates, strict=True):
        friction = link.friction
        known = friction is not None
        torques.append(float(friction.level) * 2 / np.pi * np.arctan(rate / float(friction.velocity)) if known else 0.0)
    return np.array(torques)
