"""Generated kernels of one finger against MuJoCo, at random states within the finger's range."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import awiwi_gen
from awiwi_gen.hand import Hand
from awiwi_gen.interchange import mjcf
from awiwi_gen.interchange.draft import DraftHand

from .mujoco_finger import MujocoFinger

STATES = 200
LIMIT = 1e-12
"""Largest difference, relative to the largest entry of the result (or 1 mm, 1 mN m, ... where all are small)."""
_SCALES = {"link_poses": 1.0, "bias": 1e-3, "inverse_dynamics": 1e-3, "mass_matrix": 1e-9, "tendon_lengths": 1e-3,
           "coupling": 1e-3, "fingertip_pose": 1.0}  # fmt: skip


def compiled_model(path: Path, exact: bool, without: frozenset[str] = frozenset()) -> Any:
    """The model that the importer reads, less what its loss report says the hand cannot hold."""
    spec, _ = mjcf.parse(path, exact)
    mjcf.prepare(spec, set(without))
    compiled = mjcf.compile_spec(spec, path)
    for each in ("tendon_damping", "tendon_armature", "tendon_frictionloss", "tendon_stiffness"):
        getattr(compiled, each)[:] = 0
    for each in ("jnt_stiffnesspoly", "dof_dampingpoly"):
        getattr(compiled, each)[:] = 0
    compiled.opt.gravity[:] = [1.3, -2.1, -9.4]
    return compiled


def worst_differences(compiled: Any, draft: DraftHand, hand: Hand, finger: str, generated: Path) -> dict[str, float]:
    """Kernel -> its worst difference from MuJoCo."""
    drafted = next(each for each in draft.fingers if each.name == finger)
    library = awiwi_gen.load(generated)
    simulated = MujocoFinger(compiled, draft, drafted)
    links = {link.joint: link for link in hand.fingers[finger].links}
    ends = np.array([[float(links[j].low), float(links[j].high)] for j in hand.fingers[finger].joints])
    random = np.random.default_rng(13)
    found: dict[str, float] = {}

    def compare(kernel: str, ours: Any, theirs: Any) -> None:
        scale = max(_SCALES[kernel], float(np.abs(theirs).max(initial=0.0)))
        worst = float(np.abs(np.asarray(ours) - theirs).max(initial=0.0)) / scale
        found[kernel] = max(found.get(kernel, 0.0), worst)

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
            pulled = [number for number, tendon in enumerate(hand.fingers[finger].tendons) if tendon.spring is None]
            compare("tendon_lengths", library[f"{finger}_tendon_lengths"](q), simulated.lengths()[pulled])
            compare("coupling", library[f"{finger}_coupling"](q), simulated.arms()[pulled])
    return found


def dry_friction(hand: Hand, finger: str, rates: np.ndarray) -> np.ndarray:
    """Torque of the smooth dry friction of every joint, which MuJoCo treats as a constraint."""
    torques = []
    for link, rate in zip(hand.fingers[finger].links, rates, strict=True):
        friction = link.friction
        known = friction is not None
        torques.append(
            float(friction.torque) * 2 / np.pi * np.arctan(rate / float(friction.velocity)) if known else 0.0
        )
    return np.array(torques)
