"""Paths of MuJoCo's tendons: sites and the geoms between them, or constant moment arms that are fitted instead.

The arms are fitted to MuJoCo's lengths over the joints' range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from awiwi_gen.interchange.model import Array, Loss, Mimic, Place, Tendon

_STATES = 400
_LEAST_ARM = 1e-6  # m; what MuJoCo's solver of wraps leaves of a joint that the tendon does not cross


def tendons_of(
    compiled: Any, driven: dict[str, bool], mimics: tuple[Mimic, ...] | None
) -> tuple[tuple[Tendon, ...], list[Loss]]:
    """All tendons, and what of them is lost; `driven` has those of actuators, and whether these pull both ways.

    Given `mimics`, the couplings of joints, wraps get constant arms that are fitted.
    """
    found, fits, pushed, poly, both, two_way = [], [], [], [], [], []
    losses: dict[str, list[str]] = {}
    joint_wrap = mujoco.mjtWrap.mjWRAP_JOINT
    for index in range(compiled.ntendon):
        name = compiled.tendon(index).name or f"tendon{index}"
        first = int(compiled.tendon_adr[index])
        places = range(first, first + int(compiled.tendon_num[index]))
        kinds = {int(compiled.wrap_type[k]) for k in places}
        stiffness = float(compiled.tendon_stiffness[index])
        low, rest = map(float, compiled.tendon_lengthspring[index])
        if stiffness and name in driven:
            both.append(name)
            stiffness = 0.0
        spring: dict[str, Any] = {"stiffness": stiffness, "rest": rest if stiffness else 0.0}
        if stiffness and low > 0:
            pushed.append(name)
        if np.any(compiled.tendon_stiffnesspoly[index]):
            poly.append(name)
        if kinds == {int(joint_wrap)}:
            arms = {compiled.joint(int(compiled.wrap_objid[k])).name: float(compiled.wrap_prm[k]) for k in places}
            found.append(Tendon(name, arms=arms, two_way=driven.get(name, False), **spring))
        elif mimics is not None and kinds != {int(mujoco.mjtWrap.mjWRAP_SITE)}:
            tendon, error = fitted(compiled, Tendon(name, two_way=driven.get(name, False), **spring), mimics)
            found.append(tendon)
            fits.append(f"{name} by {error * 1e3:.2g} mm")
        else:
            path, lost = path_of(compiled, places)
            two_way += [name] * driven.get(name, False)
            if path:
                found.append(Tendon(name, path=path, **spring))
            for what in lost:
                losses.setdefault(what, []).append(name)
    all_losses = [
        *(Loss(what, tuple(names)) for what, names in losses.items()),
        Loss("wraps of tendons: constant arms fitted, lengths differ at most", tuple(fits)),
        Loss("springs of tendons that also push: the hand's springs only pull", tuple(pushed)),
        Loss("motors that also push tendons through sites: the hand's motors only pull these", tuple(two_way)),
        Loss("springs of tendons that a motor pulls: the hand's tendons have one or the other", tuple(both)),
        Loss("polynomial stiffness of tendons: only its linear term is kept", tuple(poly)),
        Loss(
            "damping, armature or friction of tendons",
            tuple(
                compiled.tendon(i).name
                for i in range(compiled.ntendon)
                if compiled.tendon_damping[i] or compiled.tendon_armature[i] or compiled.tendon_frictionloss[i]
            ),
        ),
    ]
    return tuple(found), [loss for loss in all_losses if loss.places]


def path_of(compiled: Any, places: Iterable[int]) -> tuple[tuple[Place, ...], list[str]]:
    """The path of the tendon at these places of MuJoCo's list, empty if a hand file cannot hold it, and what is lost."""
    site = mujoco.mjtWrap.mjWRAP_SITE
    path: list[Place] = []
    lost: list[str] = []
    divisor = None
    for k in places:
        target = int(compiled.wrap_objid[k])
        if compiled.wrap_type[k] == mujoco.mjtWrap.mjWRAP_PULLEY:
            divisor = float(compiled.wrap_prm[k])
            continue
        if compiled.wrap_type[k] == site:
            body = Place(int(compiled.site_bodyid[target]), compiled.site_pos[target].copy(), divisor=divisor)
            path.append(body)
            divisor = None
            continue
        body, side = _body(compiled, target), int(compiled.wrap_prm[k])
        if side >= 0:
            carrier = int(compiled.site_bodyid[side])
            if carrier != body.body:
                body = body._replace(side=compiled.site_pos[side].copy(), carrier=carrier)
            elif np.linalg.norm(compiled.site_pos[side] - body.at) < (body.radius or 0):
                body = body._replace(inside=True)
            else:
                body = body._replace(side=compiled.site_pos[side].copy())
        ends = [int(compiled.wrap_objid[i]) for i in (k - 1, k + 1)]
        if any(_inside(body, int(compiled.site_bodyid[i]), compiled.site_pos[i]) for i in ends):
            lost.append("wraps with a site inside the geom: straight there, as in MuJoCo")
        else:
            path.append(body)
    return tuple(path), list(dict.fromkeys(lost))


def _body(compiled: Any, geom: int) -> Place:
    """The sphere or cylinder of a geom."""
    axis = None
    if compiled.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, compiled.geom_quat[geom])
        axis = matrix.reshape(3, 3)[:, 2].copy()
    body, radius = int(compiled.geom_bodyid[geom]), float(compiled.geom_size[geom, 0])
    return Place(body, compiled.geom_pos[geom].copy(), radius, axis)


def _inside(round_: Place, body: int, at: Array) -> bool:
    """Whether a site of the geom's own body is inside the geom, so that the tendon never wraps."""
    if body != round_.body:
        return False
    away = at - round_.at
    if round_.axis is not None:
        away = away - round_.axis * (round_.axis @ away)
    return bool(np.linalg.norm(away) < (round_.radius or 0.0))


def fitted(compiled: Any, tendon: Tendon, mimics: tuple[Mimic, ...]) -> tuple[Tendon, float]:
    """The tendon with the arms and the constant length that fit best, and the largest error of its length [m].

    Joints without limits count from -1 to 1 rad, slides from -10 to 10 mm; followers move with their leaders.
    """
    data = mujoco.MjData(compiled)
    index = compiled.tendon(tendon.name).id
    kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    joints = [j for j in range(compiled.njnt) if compiled.jnt_type[j] in kinds]
    places = compiled.jnt_qposadr[joints]
    limited = compiled.jnt_limited[joints].astype(bool)
    most = np.where(compiled.jnt_type[joints] == kinds[1], 0.01, 1.0)
    ends = np.where(limited[:, None], compiled.jnt_range[joints], np.stack([-most, most], axis=1))
    order = {compiled.joint(j).name: k for k, j in enumerate(joints)}

    def length(angles: Array) -> float:
        data.qpos[places] = angles
        for mimic in mimics:
            if mimic.follower in order and mimic.leader in order:
                leader = data.qpos[places[order[mimic.leader]]]
                data.qpos[places[order[mimic.follower]]] = mimic.curve(leader)
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_tendon(compiled, data)
        return float(data.ten_length[index])

    crossed = [k for k in range(len(joints)) if _moves(length, compiled.qpos0[places], ends, k)]
    random = np.random.default_rng(7)
    angles = np.tile(compiled.qpos0[places], (_STATES, 1))
    angles[:, crossed] = random.uniform(ends[crossed, 0], ends[crossed, 1], (_STATES, len(crossed)))
    lengths = np.array([length(state) for state in angles])
    table = np.column_stack([np.ones(_STATES), angles[:, crossed]])
    best: Array = np.asarray(np.linalg.lstsq(table, lengths, rcond=None)[0]).round(6)  # the fit is good to millimetres
    error = float(np.abs(table @ best - lengths).max())
    names = [compiled.joint(joints[k]).name for k in crossed]
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
