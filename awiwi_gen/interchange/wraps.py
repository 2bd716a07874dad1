"""Tendons that wrap around geoms, as constant moment arms: fitted to MuJoCo's lengths over the joints' range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from awiwi_gen.interchange.model import Array, Mimic, Tendon

_STATES = 400
_LEAST_ARM = 1e-6  # m; what MuJoCo's solver of wraps leaves of a joint that the tendon does not cross


def fitted(compiled: Any, tendon: Tendon, mimics: tuple[Mimic, ...]) -> tuple[Tendon, float]:
    """The tendon with the arms and the constant length that fit best, and the largest error of its length [m].

    Joints without limits count from -1 to 1 rad; followers move with their leaders.
    """
    data = mujoco.MjData(compiled)
    index = compiled.tendon(tendon.name).id
    hinges = [j for j in range(compiled.njnt) if compiled.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
    places = compiled.jnt_qposadr[hinges]
    limited = compiled.jnt_limited[hinges].astype(bool)
    ends = np.where(limited[:, None], compiled.jnt_range[hinges], np.array([-1.0, 1.0]))
    order = {compiled.joint(j).name: k for k, j in enumerate(hinges)}

    def length(angles: Array) -> float:
        data.qpos[places] = angles
        for mimic in mimics:
            if mimic.follower in order and mimic.leader in order:
                leader = data.qpos[places[order[mimic.leader]]]
                data.qpos[places[order[mimic.follower]]] = mimic.ratio * leader + mimic.offset
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_tendon(compiled, data)
        return float(data.ten_length[index])

    crossed = [k for k in range(len(hinges)) if _moves(length, compiled.qpos0[places], ends, k)]
    random = np.random.default_rng(7)
    angles = np.tile(compiled.qpos0[places], (_STATES, 1))
    angles[:, crossed] = random.uniform(ends[crossed, 0], ends[crossed, 1], (_STATES, len(crossed)))
    lengths = np.array([length(state) for state in angles])
    table = np.column_stack([np.ones(_STATES), angles[:, crossed]])
    best: Array = np.asarray(np.linalg.lstsq(table, lengths, rcond=None)[0]).round(6)  # the fit is good to millimetres
    error = float(np.abs(table @ best - lengths).max())
    names = [compiled.joint(hinges[k]).name for k in crossed]
    return replace(tendon, arms=dict(zip(names, map(float, best[1:]), strict=True)), constant=float(best[0])), error


def _moves(length: Callable[[Array], float], drawn: Array, ends: Array, joint: int) -> bool:
    """Whether the length changes with a joint, the others standing as drawn."""
    low, high = map(float, ends[joint])
    found: list[float] = []
    for angle in np.linspace(low, high, 7):
        state = drawn.copy()
        state[joint] = angle
        found.append(length(state))
    return max(found) - min(found) > _LEAST_ARM * (high - low)
