"""What a finger can do, in figures, and how every number of the hand moves them.

The figures come from the kernels' derivations, which have the hand's numbers as symbols, at seeded poses. Their
derivatives do too: of a largest value, that of the pose where it is largest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from math import degrees, isfinite, pi
from operator import add
from typing import Any

import numpy as np

from awiwi_gen.diff.slopes import Sloped, function, outputs
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.estimates import joint_limits, limit_paths
from awiwi_gen.pipeline import Job
from awiwi_gen.records import fingerprints, load_graphs
from awiwi_gen.units import rad
from awiwi_gen.verify.samples import draw

Array = np.ndarray[Any, Any]
Pick = Callable[[Array], Any]  # the index of one of some values

POSES = 512  # of a finger; the first is the middle of the joints' ranges
MM, GRAM = 1e3, 1e3  # what a metre and a kilogram are in those units
FORCE, SOFT, STIFF = (f"limits.tendon_{name}" for name in ("force", "stiffness_low", "stiffness_high"))
GRAVITY, SPOOL = "limits.gravity", "motor.pulley"
SHARED = (FORCE, SOFT, STIFF, GRAVITY, SPOOL)  # numbers of the hand that figures of all fingers depend on


@dataclass(frozen=True)
class Figure:
    """A figure of a finger in ``unit``, and its derivative by every number that it depends on, in ``unit`` per SI unit."""

    name: str
    unit: str
    value: float
    slopes: Mapping[str, float]


@dataclass(frozen=True)
class FingerAtPoses:
    """A finger of a job, at seeded poses. Everything has derivatives by ``numbers``: paths in the hand file -> values."""

    job: Job
    name: str

    @cached_property
    def numbers(self) -> dict[str, float]:
        """The numbers of the finger, and those of the hand that figures of a finger depend on."""
        own = f"fingers.{self.name}."
        return {
            path: float(each)
            for path, each in self.job.hand.quantities().items()
            if path.startswith(own) or path in SHARED
        }

    @property
    def finger(self) -> Any:
        """The finger as the hand file describes it."""
        return self.job.hand.fingers[self.name]

    @cached_property
    def kernels(self) -> dict[str, Kernel]:
        """The finger's kernels by family."""
        return {each.family: each for each in self.job.catalog if each.path == f"fingers.{self.name}"}

    @cached_property
    def poses(self) -> Sloped:
        """Joint angles (poses, joints) [rad]; they have derivatives by their limits, since each is a share of its range."""
        low, high = map(np.array, joint_limits(self.finger))
        joints = len(low)
        share = draw({"q": Port((joints,), rad, 0.0, 1.0)}, f"fingers.{self.name}", samples=POSES)["q"]
        share[0] = 0.5
        slope = np.zeros((len(self.numbers), *share.shape))
        for end, each in (("low", 1 - share), ("high", share)):
            for joint, path in enumerate(limit_paths(self.finger)[end]):
                if path:
                    slope[self.rows[f"fingers.{self.name}.{path}"], :, joint] = each[:, joint]
        return Sloped(low + share * (high - low), slope)

    def number(self, path: str) -> Sloped:
        """A number of the hand; its derivative by itself is one."""
        slope = np.zeros((len(self.numbers), 1))
        slope[self.rows[path]] = 1.0
        return Sloped(self.numbers[path], slope)

    @cached_property
    def rows(self) -> dict[str, int]:
        """Where the numbers are in arrays of derivatives."""
        return {path: row for row, path in enumerate(self.numbers)}

    def outputs(self, family: str, **inputs: Sloped) -> dict[str, Sloped]:
        """The outputs of a kernel (poses, *shape), and derivatives (numbers, poses, *shape)."""
        kernel, own = self.kernels[family], f"fingers.{self.name}."
        numbers = {path.removeprefix(own): self.number(path) for path in self.numbers}
        graph = smallest(kernel, self.job)
        return outputs(graph, {"q": self.poses, **inputs}, numbers, POSES, len(self.numbers))

    @cached_property
    def coupling(self) -> Sloped:
        """P = dh/dq (poses, tendons, joints) [m/rad]."""
        return self.outputs("coupling")["P"]

    def unit(self, family: str, output: str, *index: int) -> tuple[str, float]:
        """The unit of an element of an output, with mm in place of m, and its number of those."""
        port = self.kernels[family].outputs[output]
        unit = str(port.units[int(np.ravel_multi_index(index, port.shape))])
        return (f"m{unit}", MM) if unit.partition("/")[0] == "m" else (unit, 1.0)

    def figure(self, name: str, unit: str, values: Sloped, scale: float = 1.0, pick: Pick = np.nanargmax) -> Figure:
        """The largest of the values (poses), or the one that another function picks, times a scale."""
        pose = int(pick(values.value))
        slope = np.broadcast_to(values.slope, (len(self.numbers), POSES))[:, pose] * scale
        slopes = {path: float(each) for path, each in zip(self.numbers, slope, strict=True) if each and isfinite(each)}
        return Figure(name, unit, float(values.value[pose] * scale), slopes)


def smallest(kernel: Kernel, job: Job) -> Any:
    """The smaller one of the two derivations of a kernel."""
    found = fingerprints(kernel, job.store)
    route = min(found, key=lambda each: found[each].size)
    return load_graphs(kernel, job.store, route)[route]


def figures(job: Job, name: str) -> list[Figure]:
    """All figures of a finger of the job's hand, whose derivations are in the cache."""
    finger = FingerAtPoses(job, name)
    parts = [_workspace, _mass, _gravity]
    if "coupling" in finger.kernels:
        parts = [_coupling, _torque, _stiffness, *([_travel] if job.hand.motor else []), *parts]
    with np.errstate(all="ignore"):
        return [each for part in parts for each in part(finger)]


def _coupling(finger: FingerAtPoses) -> Iterator[Figure]:
    """The entries of P = dh/dq in the middle pose, but for zeros."""
    P = finger.coupling
    for tendon, joint in np.argwhere(np.nan_to_num(P.value[0])):
        name = f"P[{tendon}, {finger.finger.joints[joint]}]"
        unit, scale = finger.unit("coupling", "P", tendon, joint)
        yield finger.figure(name, unit, P.at(tendon, joint), scale, _middle)


def _torque(finger: FingerAtPoses) -> Iterator[Figure]:
    """The largest torque -P' f of each joint to either side, with forces up to the limit, whatever other joints feel."""
    force = finger.number(FORCE)
    for joint, name in enumerate(finger.finger.joints):
        unit, _ = finger.unit("joint_torque", "tau", joint)
        for sign, side in ((1, "+"), (-1, "-")):
            pulls = [_above_zero(-sign * arm) for arm in _arms(finger, joint)]
            yield finger.figure(f"torque {side}{name}", unit, force * _total(pulls), sign)


def _stiffness(finger: FingerAtPoses) -> Iterator[Figure]:
    """The least and the largest diagonal entries of P' diag(k) P + sum f d2h/dq2, over poses, stiffnesses and forces."""
    dP, force = finger.outputs("coupling_derivative")["dP"], finger.number(FORCE)
    for joint, name in enumerate(finger.finger.joints):
        arms, (unit, _) = _arms(finger, joint), finger.unit("joint_stiffness", "K", joint, joint)
        squares = _total([arm * arm for arm in arms])
        bends = [dP.at(tendon, joint, joint) for tendon in range(len(arms))]
        for side, sign, path, pick in (("least", -1, SOFT, np.nanargmin), ("most", 1, STIFF, np.nanargmax)):
            bend = sign * _total([_above_zero(sign * each) for each in bends])
            stiffness = finger.number(path) * squares + force * bend
            yield finger.figure(f"stiffness {name}, {side}", unit, stiffness, 1.0, pick)


def _travel(finger: FingerAtPoses) -> Iterator[Figure]:
    """How far a turn of a motor's pulley moves each joint in the middle pose, by the tendon with the longest arm there."""
    units = finger.kernels["coupling"].inputs["q"].units
    for joint, name in enumerate(finger.finger.joints):
        unit, scale = ("deg", degrees(1)) if units[joint].radians else ("mm", MM)
        longest = max(_arms(finger, joint), key=lambda arm: float(abs(arm.value[0])))
        if abs(longest.value[0]) > 0:
            travel = finger.number(SPOOL) / function("fabs", longest)
            yield finger.figure(f"travel {name}", f"{unit}/turn", travel, 2 * pi * scale, _middle)


def _workspace(finger: FingerAtPoses) -> Iterator[Figure]:
    """How far the fingertip's places are apart along the axes of the base frame, and the farthest from its origin."""
    T = finger.outputs("fingertip_pose")["T"]
    tip = [T.at(axis, 3) for axis in range(3)]
    for name, along in zip("xyz", tip, strict=True):
        low = int(np.nanargmin(along.value))
        width = along - Sloped(along.value[low], along.slope[:, low, None])
        yield finger.figure(f"workspace {name}", "mm", width, MM)
    yield finger.figure("reach", "mm", _length(tip), MM)


def _mass(finger: FingerAtPoses) -> Iterator[Figure]:
    """The mass of all links."""
    masses = [finger.number(path) for path in finger.numbers if path.endswith("].mass")]
    none = Sloped(np.zeros(POSES), np.zeros((len(finger.numbers), 1)))
    yield finger.figure("mass", "g", sum(masses, start=none), GRAM)


def _gravity(finger: FingerAtPoses) -> Iterator[Figure]:
    """The largest torque of each joint that holds the finger at rest, gravity having any direction."""
    axes = [Sloped(np.broadcast_to(axis, (POSES, 3))) for axis in np.eye(3)]
    loads = [finger.outputs("gravity", g=axis)["gravity"] for axis in axes]
    for joint, name in enumerate(finger.finger.joints):
        load = _length([each.at(joint) for each in loads])
        yield finger.figure(
            f"gravity {name}", finger.unit("gravity", "gravity", joint)[0], finger.number(GRAVITY) * load
        )


def _arms(finger: FingerAtPoses, joint: int) -> list[Sloped]:
    """The arms of all tendons at a joint (poses) [m/rad]."""
    return [finger.coupling.at(tendon, joint) for tendon in range(finger.coupling.value.shape[1])]


def _total(terms: Sequence[Sloped]) -> Sloped:
    total: Sloped = reduce(add, terms)
    return total


def _above_zero(values: Sloped) -> Sloped:
    kept: Sloped = values * (values.value > 0)
    return kept


def _length(components: Sequence[Sloped]) -> Sloped:
    return function("sqrt", _total([each * each for each in components]))


def _middle(_: Array) -> int:
    return 0
