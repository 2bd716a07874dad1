"""What the export fits to MuJoCo, set into MuJoCo: the greatest errors are those of the loss report, the rest is exact."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import awiwi_gen
from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.interchange import export_mjcf
from awiwi_gen.interchange.export_motors import MOTORS, POSITION, TORQUE

from .compare import GRAVITY, LIMIT, STATES, Worst, within_domain

_GRID = 301
RESTING = Path(__file__).resolve().parent.parent / "resting_fingers.toml"


def fitted() -> list[str]:
    """What is wrong with the export of the Awiwi hand, whose four-bar, springs and wrist MuJoCo does not have."""
    hand = Hand.load()
    found = [*four_bar(hand), *lever_spring(hand), *wrist(hand), *at_rest()]
    return [f"fits: {each}" for each in (*found, *(fault for motors in MOTORS for fault in simulated(hand, motors)))]


def exported(hand: Hand, motors: str = MOTORS[0]) -> tuple[Any, Any, dict[str, tuple[str, ...]]]:
    """The compiled export, data for it, and the places of each loss."""
    text, losses = export_mjcf.text_and_losses(hand, motors)
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model), {loss.what.split(":")[0]: loss.places for loss in losses}


def four_bar(hand: Hand) -> Iterator[str]:
    """The fifth finger: exact with its coupler where the linkage has it, and the polynomial as far off as reported."""
    model, data, losses = exported(hand)
    lib = awiwi_gen.build(hand, only="fifth_[ghlm]*")
    names = [f"fifth_{link.joint}" for link in hand.fingers["fifth"].links]
    free = [int(model.joint(f"fifth_{joint}").qposadr[0]) for joint in hand.fingers["fifth"].joints]
    coupler, dip = (int(model.joint(name).qposadr[0]) for name in ("fifth_hmc.coupler", "fifth_dip"))
    dofs = [int(model.joint(name).dofadr[0]) for name in [*names, "fifth_hmc.coupler"]]
    ratio = hand.fingers["fifth"].motion("dip")[1]
    link = hand.fingers["fifth"].links[0]
    low, high = float(link.low or 0), float(link.high or 0)
    (equality,) = (i for i in range(model.neq) if model.eq_obj1id[i] == model.joint("fifth_hmc.coupler").id)
    at_start = lib.fifth_hmc_four_bar(0.0).coupler
    worst, off = Worst(), 0.0
    model.opt.gravity[:] = GRAVITY
    random = np.random.default_rng(5)
    angles = [*np.linspace(low, high, _GRID), *random.uniform(low, high, STATES)]
    for number, angle in enumerate(angles):
        q = np.array([angle, *random.uniform(-0.2, 1.0, 3)])
        bar = lib.fifth_hmc_four_bar(angle)
        mujoco.mj_resetData(model, data)
        data.qpos[free], data.qpos[dip] = q, ratio * q[3]
        data.qpos[coupler] = np.remainder(float(bar.coupler) - at_start - angle + np.pi, 2 * np.pi) - np.pi
        mujoco.mj_forward(model, data)
        rows = (data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY) & (data.efc_id == equality)
        off = max(off, float(np.abs(data.efc_pos[rows]).max()))
        if number < _GRID:
            continue
        # Rates of the finger's joints and of the coupler against the crank, for those of q.
        rates = np.zeros((len(dofs), len(q)))
        rates[[0, 1, 2, 3, 4], [0, 1, 2, 3, 3]] = 1, 1, 1, 1, ratio
        rates[5, 0] = float(bar.coupler_ratio) - 1
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        base = model.body("fifth.base").id
        axes, origin = data.xmat[base].reshape(3, 3), data.xpos[base]
        g = axes.T @ model.opt.gravity
        worst.compare(
            "mass_matrix", within_domain(lib.fifth_mass_matrix(q), "M"), rates.T @ full[np.ix_(dofs, dofs)] @ rates
        )
        worst.compare("bias", within_domain(lib.fifth_gravity(q, g), "gravity"), rates.T @ data.qfrc_bias[dofs])
        for pose, name in zip(
            within_domain(lib.fifth_link_poses(q), "T"), ["fifth_hmc.coupler", *names[1:]], strict=True
        ):
            body = model.body(name).id
            theirs = np.eye(4)
            theirs[:3, :3] = axes.T @ data.xmat[body].reshape(3, 3)
            theirs[:3, 3] = axes.T @ (data.xpos[body] - origin)
            worst.compare("link_poses", pose, theirs)
    yield from (f"fifth_{kernel} differs by {x:.1e}" for kernel, x in worst.found.items() if x > LIMIT)
    yield from _reported("the four-bar", losses["four-bars"], "fifth hmc", off)


def lever_spring(hand: Hand) -> Iterator[str]:
    """A tendon wound up by its motor while the finger stands still, over the travel of its spring."""
    if hand.spring is None or hand.tendon is None:
        raise ValueError("a hand with springs and fibres is needed")
    model, data, losses = exported(hand, TORQUE)
    lever, off = Lever(hand.spring), 0.0
    fibre = float(hand.tendon.modulus) * float(hand.tendon.section) / float(hand.tendon.length)
    slack = lever.at(lever.slack)
    finger = [int(model.joint(f"index_{joint}").qposadr[0]) for joint in hand.fingers["index"].joints]
    shaft = model.joint("index.tendon5.shaft")
    for angle in np.linspace(lever.slack, lever.taut, _GRID):
        pose = lever.at(float(angle))
        mujoco.mj_resetData(model, data)
        data.qpos[finger] = 0
        data.qpos[int(shaft.qposadr[0])] = slack.path - pose.path + (pose.force - slack.force) / fibre
        mujoco.mj_forward(model, data)
        off = max(off, abs(float(data.qfrc_spring[int(shaft.dofadr[0])]) + pose.force))
    yield from _reported("the lever spring", losses["lever springs"], "the design", off)


def _reported(what: str, places: tuple[str, ...], place: str, found: float) -> Iterator[str]:
    """The error in the loss report has two digits."""
    (said,) = (float(match[1]) for each in places if (match := re.match(rf"{place} by (\S+)", each)))
    if abs(found - said) > 0.06 * said:
        yield f"{what} is off by {found:.3g}, and the loss report says {said:g}"


def wrist(hand: Hand) -> Iterator[str]:
    """The palm where the linkage has it: MuJoCo has the same pose, and bars of the same length."""
    model, data, _ = exported(hand)
    lib, worst, off = awiwi_gen.build(hand, only="wrist_*"), Worst(), 0.0
    if hand.wrist is None:
        raise ValueError("a hand with a wrist is needed")
    (low, high), (q71, _) = hand.wrist.range, hand.wrist.neutral
    joints = [int(model.joint(f"wrist_{name}").qposadr[0]) for name in ("q71", "q73", "b.normal", "b.side")]
    normal = np.array([-np.sin(q71), 0, np.cos(q71)])
    bars = [model.tendon(f"wrist.{name}").id for name in ("cc0", "aa0")]
    palm, drawn = model.body("palm").id, model.tendon_length0[bars]
    runs = [model.tendon(f"wrist.run{number}").id for number in range(len(hand.wrist.tendons))]
    for angles in np.random.default_rng(6).uniform(low, high, (STATES, 2)):
        pose = lib.wrist_palm_pose(*angles).T
        moved = np.array(angles) - hand.wrist.neutral
        carried = turned(np.array([0.0, -1.0, 0.0]), moved[0]) @ turned(-normal, moved[1])
        rest = carried.T @ pose[:3, :3]
        # The rest is a rotation about the normal, then one about BC, which is along y: the first alone moves y.
        first = np.arctan2(rest[:, 1] @ np.cross(normal, [0.0, 1.0, 0.0]), rest[1, 1])
        side = turned(normal, first).T @ rest
        mujoco.mj_resetData(model, data)
        data.qpos[joints] = [*angles, first, np.arctan2(side[0, 2], side[0, 0])]
        mujoco.mj_forward(model, data)
        theirs = np.eye(4)
        theirs[:3, :3], theirs[:3, 3] = data.xmat[palm].reshape(3, 3), data.xpos[palm]
        worst.compare("palm_pose", pose, theirs)
        worst.compare("tendon_lengths", lib.wrist_tendon_lengths(*angles).h, data.ten_length[runs])
        off = max(off, float(np.abs(data.ten_length[bars] - drawn).max()))
    yield from (f"wrist {kernel} differs by {x:.1e}" for kernel, x in worst.found.items() if x > LIMIT)
    if off > LIMIT:
        yield f"the bars of the wrist change their length by {off:.1e} m"


def at_rest() -> Iterator[str]:
    """Fingers with fewer tendons than joints: MuJoCo comes to rest where the estimate is, from the lengths there."""
    hand = Hand.load(RESTING)
    model, data, _ = exported(hand)
    lib = awiwi_gen.build(hand, only="*joint_estimate,*tendon_lengths")
    model.opt.gravity[:], model.dof_damping[:] = 0, 0.002
    for name, force in itertools.product(("index", "ring"), (1.0, 3.0)):
        mujoco.mj_resetData(model, data)
        data.ctrl[[i for i in range(model.nu) if model.actuator(i).name.startswith(name)]] = force
        while data.time < 10:
            mujoco.mj_step(model, data)
        q = data.qpos[[int(model.joint(f"{name}_{joint}").qposadr[0]) for joint in hand.fingers[name].joints]]
        h = lib[f"{name}_tendon_lengths"](q)
        found = lib[f"{name}_joint_estimate"](getattr(h, "h", h), np.zeros(len(q)))
        if (off := np.abs(getattr(found, "q", found) - q).max()) > LIMIT:
            yield f"at rest under {force} N {name} is {off:.1e} rad from its estimate"


def turned(axis: np.ndarray, angle: float) -> np.ndarray:
    """The rotation (3 x 3) about a unit vector."""
    matrix, quat = np.zeros(9), np.zeros(4)
    mujoco.mju_axisAngle2Quat(quat, axis, angle)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def simulated(hand: Hand, motors: str) -> Iterator[str]:
    """A tenth of a second in which index tendon 5 is pulled: the finger bends, the bars hold, a servo arrives."""
    model, data, _ = exported(hand, motors)
    pulls = {"force": 5.0, "torque": 1.5, "position": 0.5}[motors]
    motor = model.actuator("index.tendon5.motor").id
    data.ctrl[motor] = pulls
    while data.time < 0.1:
        mujoco.mj_step(model, data)
    if not np.isfinite(data.qpos).all() or any(int(each.number) for each in data.warning):
        yield f"--motors {motors} diverges"
    bars = [model.tendon(f"wrist.{name}").id for name in ("cc0", "aa0")]
    if np.abs(data.ten_length[bars] - model.tendon_length0[bars]).max() > 1e-4:
        yield f"--motors {motors}: the bars of the wrist give way"
    if not data.qpos[int(model.joint("index_pip").qposadr[0])] > 0.05:
        yield f"--motors {motors}: tendon 5 of the index does not bend it"
    if motors == POSITION and abs(data.actuator_length[motor] - pulls) > 0.02:
        yield f"--motors {motors}: a servo is {data.actuator_length[motor] - pulls:.3g} rad off"
