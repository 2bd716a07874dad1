"""MJCF and URDF through MuJoCo: its parser and compiler resolve defaults, includes, frames and inertias.

Meshes, textures and sensors are never needed: they are counted for the loss report and removed before MuJoCo compiles.
A mesh stays only where a body's mass is to be computed from it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.interchange.model import LEAST_MASS, Array, Body, Joint, Loss, Mimic, Model, Site
from awiwi_gen.interchange.published import (
    forgotten,
    give_moments,
    is_lock,
    join_locked,
    left_out,
    meshed,
    sources,
    warnings_kept,
)
from awiwi_gen.interchange.quarter import quarter_angle, quarter_axis, quarter_rotation
from awiwi_gen.interchange.urdf import require_tree
from awiwi_gen.interchange.wraps import tendons_of
from awiwi_gen.reading import read_text

KINDS = ("free", "ball", "slide", "hinge")
_RPY = re.compile(r'(\brpy\s*=\s*")([^"]*)(")')


def read(
    path: Path, exact: bool = False, without: Iterable[str] = (), fit: bool = False, assume: bool = False
) -> Model:
    """Read a file. Raises `InputError` where MuJoCo refuses it.

    Unless `exact`, published roundings of quarter turns (1.5708) become quarter turns. The tendons named in `without`
    are left out. With `fit`, tendons that wrap around geoms get constant arms; else they are lost. With `assume`,
    tensors that MuJoCo refuses become some that are too large by far, for others to replace.
    """
    with warnings_kept() as warned:
        spec, notes = parse(path, exact)
    forces = _forces(spec)
    most = [max(map(abs, ends)) for ends in forces.values()]
    driven = {name: bool(min(ends) < 0 < max(ends)) for name, ends in forces.items()}
    measured = {each.objname for each in spec.sensors if each.type == mujoco.mjtSensor.mjSENS_JOINTPOS}
    losses = prepare(spec, set(without))
    if assume:
        give_moments(spec)
    massless = {body.name for body in spec.bodies[1:] if _has_no_mass(body)}
    compiled = compile_spec(spec, path)
    tensors = unbalanced(spec, compiled)
    tendons, lost = tendons_of(compiled, driven, _mimics(compiled) if fit else None)
    return Model(
        name=spec.modelname or path.stem,
        file=path.name,
        bodies=tuple(_body(compiled, index, massless, tensors) for index in range(compiled.nbody)),
        joints=tuple(_joint(compiled, index, measured) for index in range(compiled.njnt)),
        tendons=tendons,
        mimics=_mimics(compiled),
        sites=tuple(
            Site(compiled.site(i).name, int(compiled.site_bodyid[i]), compiled.site_pos[i].copy())
            for i in range(compiled.nsite)
        ),
        losses=(*losses, *left_out(path, warned), *(each for each in (*lost, *_of_joints(compiled)) if each.places)),
        notes=tuple(notes),
        tendon_force=max(most) if most and min(most) > 0 else 0.0,
    )


def _forces(spec: Any) -> dict[str, list[float]]:
    """Tendon -> ends of the forces [N] of its actuators, above zero where they lengthen it; zeros without a limit."""
    found: dict[str, list[float]] = {}
    for each in spec.actuators:
        if each.trntype != mujoco.mjtTrn.mjTRN_TENDON:
            continue
        ends = [0.0, 0.0]
        constant = each.gaintype == mujoco.mjtGain.mjGAIN_FIXED and each.biastype == mujoco.mjtBias.mjBIAS_NONE
        if each.forcelimited and each.forcerange[0] < each.forcerange[1]:
            ends = [*each.forcerange]
        elif constant and each.ctrllimited and each.ctrlrange[0] < each.ctrlrange[1]:
            ends = [each.gainprm[0] * end for end in each.ctrlrange]
        found.setdefault(each.target, []).extend(end * each.gear[0] for end in ends)
    return found


def parse(path: Path, exact: bool) -> tuple[Any, list[str]]:
    """The MjSpec of a file, with quarter turns where they are meant, and notes about these.

    Locked tendons of two joints are couplings in it.
    """
    text, notes = urdf_text(path, exact)
    is_urdf = re.search(r"<robot\b", text) is not None
    if is_urdf:
        require_tree(text, path.name)
    try:
        if is_urdf:
            spec = mujoco.MjSpec.from_string(text)
        elif path.suffix == ".xml":
            spec = mujoco.MjSpec.from_file(str(path))
        else:  # MuJoCo decodes only .xml and .urdf
            included = {name: each.encode() for name, each in sources(path, text).items()}
            spec = mujoco.MjSpec.from_string(text, include=included)
    except (ValueError, mujoco.FatalError) as error:
        spec, dropped = _without_forgotten(path, text, error)
        notes += [f"{each}: not read, MuJoCo {mujoco.__version__} does not know it" for each in dropped]
    spec.compiler.fusestatic = False
    if is_urdf:
        _weigh(spec)
    join_locked(spec)
    if not exact:
        notes += _quarter_turns(spec)
    return spec, notes


def _without_forgotten(path: Path, text: str, error: Exception) -> tuple[Any, list[str]]:
    try:
        return forgotten(path, text, error)
    except (ValueError, mujoco.FatalError) as last:
        raise _refused(path, last) from None


def urdf_text(path: Path, exact: bool) -> tuple[str, list[str]]:
    """The text of a file; in a URDF with rotations by quarter turns where they are meant, and notes about these."""
    text = read_text(path)
    notes: list[str] = []
    if exact or re.search(r"<robot\b", text) is None:
        return text, notes
    return _RPY.sub(lambda match: _quarter_rpy(match, notes), text), notes


def _weigh(spec: Any) -> None:
    """Links of a URDF without inertial have no mass, though MuJoCo would compute one from their geometry.

    Those that move get the least that MuJoCo accepts.
    """
    for body in spec.bodies[1:]:
        if not (body.explicitinertial or body.mass):
            least = LEAST_MASS if body.joints else 0.0
            body.mass, body.inertia, body.explicitinertial = least, [least * 1e-6] * 3, True


def _quarter_rpy(match: re.Match[str], notes: list[str]) -> str:
    words = []
    for word in match[2].split():
        meant = quarter_angle(word)
        if meant is not None and repr(meant) != word and float(word) != meant:
            notes.append(f'rpy "{match[2]}": {word} is taken for {meant!r}, a quarter turn')
        words.append(word if meant is None else repr(meant))
    return match[1] + " ".join(words) + match[3]


def _quarter_turns(spec: Any) -> list[str]:
    """Replace what is within a published rounding of a quarter turn, before MuJoCo resolves it."""
    notes: list[str] = []
    euler = mujoco.mjtOrientation.mjORIENTATION_EULER
    for body in spec.bodies[1:]:
        compiler = body.compiler
        for frame in (body.alt, *(each.alt for each in _frames(body))):
            if frame.type == euler and not compiler.degree:
                for k, angle in enumerate(frame.euler):
                    meant = quarter_angle(repr(float(angle)))
                    if meant is not None and meant != angle:
                        frame.euler[k] = meant
                        notes.append(f"body {body.name}: euler {angle:.9g} is taken for {meant!r}, a quarter turn")
        if body.alt.type == mujoco.mjtOrientation.mjORIENTATION_QUAT:
            meant_quat = quarter_rotation(np.array(body.quat))
            if meant_quat is not None and not np.array_equal(meant_quat, body.quat):
                if np.abs(meant_quat - np.array(body.quat) / np.linalg.norm(body.quat)).max() > 1e-14:
                    notes.append(f"body {body.name}: quat {_listed(body.quat)} is taken for quarter turns")
                body.quat = meant_quat
    for joint in spec.joints:
        meant_axis = quarter_axis(np.array(joint.axis))
        if meant_axis is not None and not np.array_equal(meant_axis, joint.axis):
            if np.abs(meant_axis - np.array(joint.axis) / np.linalg.norm(joint.axis)).max() > 1e-14:
                notes.append(f"joint {joint.name}: axis {_listed(joint.axis)} is taken for {_listed(meant_axis)}")
            joint.axis = meant_axis
    return notes


def _frames(body: Any) -> list[Any]:
    found, frame = [], body.frame
    while frame is not None:
        found.append(frame)
        frame = frame.frame
    return found


def _listed(values: Iterable[float]) -> str:
    return " ".join(f"{value:.7g}" for value in values)


def prepare(spec: Any, without: set[str]) -> list[Loss]:
    """Count what a hand file cannot hold, and remove what MuJoCo need not compile."""
    bodies = spec.bodies[1:]
    kept = [tendon for tendon in spec.tendons if tendon.name not in without]
    wrapped = {wrap.target.name for tendon in kept for wrap in tendon.path if _is_geom(wrap)}
    geoms = [geom for body in bodies for geom in body.geoms]
    losses = [
        _loss(
            "geoms that collide: the hand file has no contacts", geoms, lambda geom: geom.contype or geom.conaffinity
        ),
        _loss("meshes", spec.meshes),
        _loss("sensors", spec.sensors, lambda each: each.type != mujoco.mjtSensor.mjSENS_JOINTPOS),
        _loss("keyframes", spec.keys),
        _loss("equality constraints that are no coupling of two joints", spec.equalities, lambda e: not is_lock(e)),
        _loss(
            "actuators of joints: the hand file has motors of tendons only",
            spec.actuators,
            lambda each: each.trntype != mujoco.mjtTrn.mjTRN_TENDON,
        ),
        _loss("tendons left out as asked", [each for each in spec.tendons if each.name in without]),
    ]
    for kind in (
        "skins",
        "hfields",
        "flexes",
        "pairs",
        "excludes",
        "sensors",
        "keys",
        "actuators",
        "cameras",
        "lights",
    ):
        for each in list(getattr(spec, kind)):
            spec.delete(each)
    for tendon in list(spec.tendons):
        if tendon.name in without:
            spec.delete(tendon)
    for equality in list(spec.equalities):
        if not is_lock(equality):
            spec.delete(equality)
    computed = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for body in spec.bodies:
        needed = computed or not (body.explicitinertial or body.name == "world")
        moves = any(each.joints for each in _upwards(body))
        for geom in list(body.geoms):
            geom.material = ""
            if geom.name not in wrapped and not (needed and moves):
                spec.delete(geom)
    used = {geom.meshname for body in spec.bodies for geom in body.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)
    for colored in (*spec.sites, *spec.tendons):
        colored.material = ""
    for kind in ("materials", "textures"):
        for each in list(getattr(spec, kind)):
            spec.delete(each)
    return [loss for loss in losses if loss.places]


def _upwards(body: Any) -> Iterable[Any]:
    while body is not None:
        yield body
        body = body.parent


def _is_geom(wrap: Any) -> bool:
    return wrap.type in (mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER)


def _loss(what: str, elements: Iterable[Any], counts: Any = lambda each: True) -> Loss:
    places = tuple(getattr(each, "name", "") or "(no name)" for each in elements if counts(each))
    return Loss(what, places)


def compile_spec(spec: Any, path: Path) -> Any:
    """The MjModel of a spec. Raises `InputError` with MuJoCo's reason.

    Where it refuses tensors that no body has, the hand file's checks say more of them: MuJoCo balances them.
    """
    meshes = meshed(spec)  # after an error, MuJoCo raises it again for every element
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        refused = _refused(path, error, meshes)
        if "balanceinertia" not in str(error) or spec.compiler.balanceinertia:
            raise refused from None
    spec.compiler.balanceinertia = True
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _refused(path, error, meshes) from None


def _refused(path: Path, error: Exception, meshes: Mapping[str, str] | None = None) -> InputError:
    reason = " ".join(str(error).split())
    if "eigenvalues" in reason:
        reason += "; --assume-tensors assumes a solid body instead"
    needed = "Error opening file" in reason and "include" not in reason
    body = next((f"the body {bodies}" for mesh, bodies in (meshes or {}).items() if mesh in reason), "a body")
    missing = f"; the mass of {body} is computed from it: get the file, or give the body an inertial" if needed else ""
    return InputError(Fault(file=str(path), message=f"is refused by MuJoCo {mujoco.__version__}: {reason}{missing}"))


def _of_joints(compiled: Any) -> list[Loss]:
    places = tuple(compiled.joint(i).name for i in range(compiled.njnt) if _is_polynomial(compiled, i))
    return [Loss("polynomial stiffness or damping of joints: only the linear term is kept", places)]


def _is_polynomial(compiled: Any, joint: int) -> bool:
    dof = int(compiled.jnt_dofadr[joint])
    return bool(np.any(compiled.jnt_stiffnesspoly[joint]) or np.any(compiled.dof_dampingpoly[dof]))


def rotation(quat: Any) -> Array:
    """The matrix (3 x 3) of a unit quaternion (w, x, y, z); quarter turns are exact."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quat, float))
    exact = np.rint(matrix)
    return np.where(np.abs(matrix - exact) < 1e-15, exact, matrix).reshape(3, 3)


def _has_no_mass(body: Any) -> bool:
    """Whether a body has only what `_weigh`, or our export, gives to those without mass."""
    full = not np.isnan(body.fullinertia[0]) and np.any(body.fullinertia)
    return bool(
        body.explicitinertial and body.mass <= LEAST_MASS and not full and max(body.inertia) <= LEAST_MASS * 1e-6
    )


def unbalanced(spec: Any, compiled: Any) -> dict[str, Array]:
    """Body -> its published tensor (3 x 3) in its own axes, where MuJoCo has put the mean of its moments in its place."""
    found = {}
    for body in spec.bodies[1:] if spec.compiler.balanceinertia else []:
        index = compiled.body(body.name).id
        full = np.array(body.fullinertia)
        axes = rotation(compiled.body_iquat[index])
        xx, yy, zz, xy, xz, yz = full if not np.isnan(full[0]) else np.zeros(6)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not np.any(tensor):
            tensor = axes @ np.diag(body.inertia) @ axes.T
        moments = np.linalg.eigvalsh(tensor)
        if body.explicitinertial and moments[0] + moments[1] < moments[2]:
            found[body.name] = tensor
    return found


def _body(compiled: Any, index: int, massless: set[str], tensors: dict[str, Array]) -> Body:
    axes = rotation(compiled.body_iquat[index])
    name = compiled.body(index).name or f"body{index}"
    return Body(
        name=name,
        parent=int(compiled.body_parentid[index]),
        position=compiled.body_pos[index].copy(),
        axes=rotation(compiled.body_quat[index]),
        mass=0.0 if name in massless else float(compiled.body_mass[index]),
        com=compiled.body_ipos[index].copy(),
        inertia=tensors.get(name, axes @ np.diag(compiled.body_inertia[index]) @ axes.T),
    )


def _joint(compiled: Any, index: int, measured: set[str]) -> Joint:
    kind = KINDS[compiled.jnt_type[index]]
    dof, at = int(compiled.jnt_dofadr[index]), int(compiled.jnt_qposadr[index])
    scalar = kind in ("hinge", "slide")
    limited = scalar and bool(compiled.jnt_limited[index])
    return Joint(
        name=compiled.joint(index).name or f"joint{index}",
        body=int(compiled.jnt_bodyid[index]),
        kind=kind,
        axis=compiled.jnt_axis[index].copy(),
        anchor=compiled.jnt_pos[index].copy(),
        low=float(compiled.jnt_range[index, 0]) if limited else None,
        high=float(compiled.jnt_range[index, 1]) if limited else None,
        reference=float(compiled.qpos0[at]) if scalar else 0.0,
        armature=float(compiled.dof_armature[dof]),
        damping=float(compiled.dof_damping[dof]),
        friction=float(compiled.dof_frictionloss[dof]),
        stiffness=float(compiled.jnt_stiffness[index]),
        spring_reference=float(compiled.qpos_spring[at]) if scalar else 0.0,
        effort=float(np.abs(compiled.jnt_actfrcrange[index]).min()) if compiled.jnt_actfrclimited[index] else 0.0,
        measured=compiled.joint(index).name in measured,
    )


def _mimics(compiled: Any) -> tuple[Mimic, ...]:
    found = []
    for index in range(compiled.neq):
        follower, leader = int(compiled.eq_obj1id[index]), int(compiled.eq_obj2id[index])
        zeros = [float(compiled.qpos0[compiled.jnt_qposadr[joint]]) for joint in (follower, leader)]
        # MuJoCo: the follower, from its zero, is a polynomial of the leader, from its own.
        curve = Polynomial(compiled.eq_data[index, :5])(Polynomial([-zeros[1], 1.0])) + zeros[0]
        found.append(Mimic.of(compiled.joint(follower).name, compiled.joint(leader).name, curve))
    return tuple(found)
