"""What published MJCF says in other words than the importer reads, or than the present MuJoCo takes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from awiwi_gen.interchange.model import Loss
from awiwi_gen.interchange.urdf import without_leader
from awiwi_gen.reading import read_text

__all__ = ["forgotten", "give_moments", "is_lock", "join_locked", "left_out", "meshed", "sources", "warnings_kept"]

_INCLUDE = re.compile(r'<include\s[^>]*?file\s*=\s*"([^"]+)"')
_UNKNOWN = re.compile(r"unrecognized attribute: '(\w+)'\s+Element '(\w+)'")
_SETTINGS = {"option", "flag", "size", "default", "visual", "global", "quality", "headlight", "map", "scale", "rgba",
             "statistic"}  # fmt: skip
_TOO_LARGE = 10.0  # m^2: square of a radius of gyration
_MOST = 20  # attributes that a file may have in vain


def sources(path: Path, text: str) -> dict[str, str]:
    """The files that MJCF includes, by the names that it has for them, and what these include."""
    found: dict[str, str] = {}
    for name in _INCLUDE.findall(text):
        file = path.parent / name
        if file.is_file():
            data = file.read_bytes().decode("utf-8", "replace")
            found |= {name: data, **sources(path, data)}
    return found


def forgotten(path: Path, text: str, error: Exception) -> tuple[Any, list[str]]:
    """The spec of a file without the settings of a simulation that this MuJoCo no longer knows, and their names.

    Raises MuJoCo's error where it refuses anything else: what an unknown attribute of a body or a joint meant, nobody
    knows.
    """
    texts, dropped = {"": text, **sources(path, text)}, list[str]()
    while len(dropped) < _MOST:
        found = _UNKNOWN.search(" ".join(str(error).split()))
        if found is None or found[2] not in _SETTINGS:
            break
        attribute, element = found.groups()
        place = re.compile(rf"""(<{element}\b[^>]*?)\s{attribute}\s*=\s*("[^"]*"|'[^']*')""")
        texts = {name: place.sub(r"\1", each) for name, each in texts.items()}
        dropped.append(f"{element} {attribute}")
        try:
            included = {name: each.encode() for name, each in texts.items() if name}
            spec = mujoco.MjSpec.from_string(texts[""], include=included)
        except (ValueError, mujoco.FatalError) as another:
            error = another
            continue
        spec.modelfiledir = str(path.parent)
        return spec, dropped
    raise error


def give_moments(spec: Any) -> None:
    """Give bodies whose tensors MuJoCo refuses, with a moment of zero or below, one by far too large for their mass."""
    for body in spec.bodies[1:]:
        xx, yy, zz, xy, xz, yz = (
            body.fullinertia if not np.isnan(body.fullinertia[0]) else (*body.inertia, 0.0, 0.0, 0.0)
        )
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if body.explicitinertial and body.mass and moments[0] <= 0:
            body.fullinertia, body.inertia = [np.nan] * 6, [_TOO_LARGE * body.mass] * 3


@contextmanager
def warnings_kept() -> Iterator[list[str]]:
    """What MuJoCo warns of meanwhile, which it would print and write into a file in the working directory."""
    found: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(found.append)
    try:
        yield found
    finally:
        mujoco.set_mju_user_warning(before)


def left_out(path: Path, warned: list[str]) -> list[Loss]:
    """What MuJoCo warned of, and mimic joints of a URDF that have no leader, by name: it only says that it ignores them."""
    text = read_text(path)
    lost = without_leader(text) if re.search(r"<robot\b", text) else {}
    others = [each for each in warned if not any(f"'{joint}'" in each for joint in lost)]
    losses = [
        Loss(
            "mimic joints whose leader the file does not have: independent",
            tuple(f"{k} of {v}" for k, v in lost.items()),
        ),
        Loss("what MuJoCo warns of and leaves out", tuple(" ".join(each.split()) for each in others)),
    ]
    return [loss for loss in losses if loss.places]


def meshed(spec: Any) -> dict[str, str]:
    """File -> the bodies whose geoms are its mesh."""
    found: dict[str, list[str]] = {}
    files = {mesh.name: mesh.file for mesh in spec.meshes}
    for body in spec.bodies:
        for name in dict.fromkeys(geom.meshname for geom in body.geoms if geom.meshname in files):
            found.setdefault(files[name], []).append(body.name)
    return {file: ", ".join(bodies) for file, bodies in found.items()}


def is_lock(equality: Any) -> bool:
    """Whether an equality makes one joint follow another."""
    return bool(equality.type == mujoco.mjtEq.mjEQ_JOINT and equality.name2 and equality.active)


def join_locked(spec: Any) -> None:
    """Put couplings of joints in the place of tendons of two joints whose length an equality keeps.

    Both mean arm_1 (q_1 - zero_1) + arm_2 (q_2 - zero_2) = constant. The joint that is farther from the palm follows.
    """
    tendons = {tendon.name: tendon for tendon in spec.tendons}
    for lock in list(spec.equalities):
        tendon = tendons.get(lock.name1)
        if lock.type != mujoco.mjtEq.mjEQ_TENDON or lock.name2 or not lock.active or tendon is None:
            continue
        path = list(tendon.path)
        if len(path) != 2 or any(wrap.type != mujoco.mjtWrap.mjWRAP_JOINT or not wrap.coef for wrap in path):
            continue
        leader, follower = sorted(path, key=lambda wrap: _depth(wrap.target.parent))
        data = [lock.data[0] / follower.coef, -leader.coef / follower.coef, *[0.0] * (len(lock.data) - 2)]
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT, name1=follower.target.name, name2=leader.target.name, active=True, data=data
        )
        spec.delete(lock)
        for actuator in [each for each in spec.actuators if each.target == tendon.name]:
            spec.delete(actuator)  # which pulls a tendon that cannot give way
        spec.delete(tendon)


def _depth(body: Any) -> int:
    return 0 if body is None else 1 + _depth(body.parent)
