"""What MuJoCo leaves of tendons that bend inside a geom: it stops iterating 1e-6 rad from the point of the bend.

From its point a few steps more lead to the shortest string, to rounding.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

STOP = 2e-6
"""Largest error [rad] of the angle between string and normal that MuJoCo's iteration may leave."""


def corrections(compiled: Any, data: Any) -> tuple[np.ndarray, np.ndarray]:
    """What is missing from MuJoCo's lengths (tendons) and its arms (tendons x nv). Raises AssertionError for a bad bend."""
    lengths, arms = np.zeros(compiled.ntendon), np.zeros((compiled.ntendon, compiled.nv))
    for tendon in range(compiled.ntendon):
        divisor, first = 1.0, int(compiled.tendon_adr[tendon])
        for k in range(first, first + int(compiled.tendon_num[tendon])):
            if compiled.wrap_type[k] == mujoco.mjtWrap.mjWRAP_PULLEY:
                divisor = float(compiled.wrap_prm[k])
            bend = _bend(compiled, data, tendon, k)
            if bend is not None:
                length, row = _missing(compiled, data, k, bend)
                lengths[tendon] += length / divisor
                arms[tendon] += row / divisor
    return lengths, arms


def _bend(compiled: Any, data: Any, tendon: int, k: int) -> np.ndarray | None:
    """The point (3) in the world where a tendon bends inside the geom at a place of its path."""
    side, round_ = int(compiled.wrap_prm[k]), (mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER)
    if int(compiled.wrap_type[k]) not in map(int, round_) or side < 0:
        return None
    geom, at = int(compiled.wrap_objid[k]), int(data.ten_wrapadr[tendon])
    if np.linalg.norm(data.site_xpos[side] - data.geom_xpos[geom]) >= compiled.geom_size[geom, 0]:
        return None
    passed = range(at, at + int(data.ten_wrapnum[tendon]))
    objects, points = np.asarray(data.wrap_obj).reshape(-1), np.asarray(data.wrap_xpos).reshape(-1, 3)
    return next((points[i].copy() for i in passed if objects[i] == geom), None)


def _missing(compiled: Any, data: Any, k: int, bend: np.ndarray) -> tuple[float, np.ndarray]:
    """What the shortest string has in length and arms (nv) beyond MuJoCo's, which bends at this point."""
    geom, sites = int(compiled.wrap_objid[k]), [int(compiled.wrap_objid[i]) for i in (k - 1, k + 1)]
    axes, centre, radius = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom], float(compiled.geom_size[geom, 0])
    ends, flat = (
        [data.site_xpos[site] - centre for site in sites],
        [axes.T @ (data.site_xpos[s] - centre) for s in sites],
    )
    if compiled.wrap_type[k] == mujoco.mjtWrap.mjWRAP_CYLINDER:
        flat = [each * [1, 1, 0] for each in flat]
    distances = [np.linalg.norm(each) for each in flat]
    one = flat[0] / distances[0]
    normal = np.cross(flat[0], flat[1])
    other = np.cross(normal / np.linalg.norm(normal), one)
    between = np.arctan2(flat[1] @ other, flat[1] @ one)
    local = axes.T @ (bend - centre)
    theirs = turned = np.arctan2(local @ other, local @ one)
    for _ in range(12):  # dL/d(turned) = radius * (sum of sines of incidence)
        slope = curvature = 0.0
        for distance, angle in zip(distances, (turned, turned - between), strict=True):
            piece = np.sqrt(distance**2 + radius**2 - 2 * distance * radius * np.cos(angle))
            sine = distance * np.sin(angle) / piece
            slope += sine
            curvature += distance * np.cos(angle) / piece - radius * sine**2 / piece
        turned -= slope / curvature
    assert abs(turned - theirs) < STOP, f"MuJoCo bends {turned - theirs:.1e} rad off"
    place = radius * (np.cos(turned) * one + np.sin(turned) * other)
    pieces = [np.linalg.norm(place - each) for each in flat]
    heights = (
        [0.0, 0.0] if compiled.wrap_type[k] == mujoco.mjtWrap.mjWRAP_SPHERE else [axes[:, 2] @ each for each in ends]
    )
    place[2] += heights[0] + (heights[1] - heights[0]) * pieces[0] / sum(pieces)
    length, arms = (a - b for a, b in zip(_string(compiled, data, k, centre + axes @ place),
                                          _string(compiled, data, k, bend), strict=True))  # fmt: skip
    return length, arms


def _string(compiled: Any, data: Any, k: int, bend: np.ndarray) -> tuple[float, np.ndarray]:
    """Length and arms (nv) of the string from site to site over a point that the geom carries."""
    moving, length, arms = np.zeros((3, compiled.nv)), 0.0, np.zeros(compiled.nv)
    fixed = np.zeros((3, compiled.nv))
    mujoco.mj_jac(compiled, data, fixed, None, bend, int(compiled.geom_bodyid[compiled.wrap_objid[k]]))
    for site in (int(compiled.wrap_objid[k - 1]), int(compiled.wrap_objid[k + 1])):
        mujoco.mj_jac(compiled, data, moving, None, data.site_xpos[site], int(compiled.site_bodyid[site]))
        piece = data.site_xpos[site] - bend
        length += float(np.linalg.norm(piece))
        arms += piece / np.linalg.norm(piece) @ (moving - fixed)
    return length, arms
