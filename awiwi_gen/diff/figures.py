"""What a finger can do, in figures, and how every number of the hand moves them.

The figures come from the kernels' derivations, which have the hand's numbers as symbols, at seeded poses. Their
derivatives do too: of a largest value, that of the pose where it is largest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import degrees, isfinite, pi
from typing import Any

import numpy as np

from awiwi_gen.diff.slopes import Sloped, outputs
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.fingers import joint_limits, limit_paths
from awiwi_gen.pipeline import Job
from awiwi_gen.records import fingerprints, load_graphs
from awiwi_gen.units import rad
from awiwi_gen.verify.samples import draw

Array = np.ndarray[Any, Any]
Pick = Callable[[Array], Any]  # the index of one of some values

POSES = 512  # of a finger; the first is the middle of the joints' ranges
MM, DEG_PER_TURN, GRAM = 1e3, degrees(2 * pi), 1e3  # what a metre, a radian per radian, a kilogram is in those units
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
        """Joint angles (poses, joints) [rad]; by their limits they have derivatives, since each is a share of its range."""
        low, high = map(np.array, joint_limits(self.finger))
        joints = len(low)
        share = draw({"q": Port((joints,), rad, 0.0, 1.0)}, f"fingers.{self.name}", samples=POSES)["q"]
        share[0] = 0.5
        slope = np.zeros((len(self.numbers), *share.shape))
        for end, each in (("low", 1 - share), ("high", share)):
            for joint, path in enumerate(limit_paths(self.finger)[end]):
                if path:
                    slope[self._row(f"fingers.{self.name}.{path}"), :, joint] = each[:, joint]
        return Sloped(low + share * (high - low), slope)

    def number(self, path: str) -> Sloped:
        """A number of the hand as a scalar; its derivative by itself is one."""
        return Sloped(self.numbers[path], self.unit(path)[:, None])

    def unit(self, path: str) -> Array:
        """Derivatives of a number by all numbers: one in its own row."""
        found = np.zeros(len(self.numbers))
        found[self._row(path)] = 1.0
        return found

    def _row(self, path: str) -> int:
        return list(self.numbers).index(path)

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

    def figure(self, name: str, unit: str, value: float, slope: Array) -> Figure:
        """A figure from its value and its derivatives by all numbers."""
        slopes = {path: float(each) for path, each in zip(self.numbers, slope, strict=True) if each and isfinite(each)}
        return Figure(name, unit, float(value), slopes)

    def most(self, name: str, unit: str, values: Array, slopes: Array, pick: Pick = np.nanargmax) -> Figure:
        """The largest of values (poses), or the one that another function picks, with derivatives (numbers, poses)."""
        where = int(pick(values))
        return self.figure(name, unit, values[where], slopes[:, where])


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
    for tendon, joint in np.argwhere(P.value[0]):
        name = f"P[{tendon}, {finger.finger.joints[joint]}]"
        yield finger.figure(name, "mm/rad", MM * P.value[0, tendon, joint], MM * P.slope[:, 0, tendon, joint])


def _torque(finger: FingerAtPoses) -> Iterator[Figure]:
    """The largest torque -P' f of each joint to either side, with forces up to the limit, whatever other joints feel."""
    P = finger.coupling
    force = finger.numbers[FORCE]
    for joint, name in enumerate(finger.finger.joints):
        for sign, side in ((1, "+"), (-1, "-")):
            arms = -sign * P.value[:, :, joint]
            pulls = arms > 0
            arm = np.where(pulls, arms, 0.0).sum(axis=1)
            slope = np.where(pulls, -sign * P.slope[:, :, :, joint], 0.0).sum(axis=2)
            total = force * slope + finger.unit(FORCE)[:, None] * arm
            yield finger.most(f"torque {side}{name}", "N m", sign * force * arm, sign * total, _farthest)


def _farthest(values: Array) -> Any:
    return np.nanargmax(np.abs(values))


def _stiffness(finger: FingerAtPoses) -> Iterator[Figure]:
    """The least and the largest diagonal entries of P' diag(k) P + sum f d2h/dq2, over poses, stiffnesses and forces."""
    P, dP = finger.coupling, finger.outputs("coupling_derivative")["dP"]
    force = finger.numbers[FORCE]
    for joint, name in enumerate(finger.finger.joints):
        arm, arm_slope = P.value[:, :, joint], P.slope[:, :, :, joint]
        squares, bends = (arm**2).sum(axis=1), dP.value[:, :, joint, joint]
        squares_slope = 2 * (arm * arm_slope).sum(axis=2)
        for side, path, counts, pick in (
            ("least", SOFT, bends < 0, np.nanargmin),
            ("most", STIFF, bends > 0, np.nanargmax),
        ):
            bend = np.where(counts, bends, 0.0).sum(axis=1)
            bend_slope = np.where(counts, dP.slope[:, :, :, joint, joint], 0.0).sum(axis=2)
            k = finger.numbers[path]
            slope = k * squares_slope + force * bend_slope
            slope = slope + finger.unit(path)[:, None] * squares + finger.unit(FORCE)[:, None] * bend
            yield finger.most(f"stiffness {name}, {side}", "N m/rad", k * squares + force * bend, slope, pick)


def _travel(finger: FingerAtPoses) -> Iterator[Figure]:
    """How far a turn of a motor's pulley moves each joint in the middle pose, by the tendon with the longest arm there."""
    P, spool = finger.coupling, finger.numbers[SPOOL]
    for joint, name in enumerate(finger.finger.joints):
        tendon = int(np.abs(P.value[0, :, joint]).argmax())
        arm = P.value[0, tendon, joint]
        if arm:
            travel = DEG_PER_TURN * spool / abs(arm)
            slope = travel * (finger.unit(SPOOL) / spool - P.slope[:, 0, tendon, joint] / arm)
            yield finger.figure(f"travel {name}", "deg/turn", travel, slope)


def _workspace(finger: FingerAtPoses) -> Iterator[Figure]:
    """How far the fingertip's places are apart along the axes of the base frame, and the farthest from its origin."""
    T = finger.outputs("fingertip_pose")["T"]
    tip, slope = MM * T.value[:, :3, 3], MM * T.slope[:, :, :3, 3]
    for axis, name in enumerate("xyz"):
        along, there = tip[:, axis], slope[:, :, axis]
        high, low = np.nanargmax(along), np.nanargmin(along)
        yield finger.figure(f"workspace {name}", "mm", along[high] - along[low], there[:, high] - there[:, low])
    reach = np.linalg.norm(tip, axis=1)
    yield finger.most("reach", "mm", reach, (tip * slope).sum(axis=2) / reach)


def _mass(finger: FingerAtPoses) -> Iterator[Figure]:
    """The mass of all links."""
    paths = [path for path in finger.numbers if path.endswith("].mass")]
    total = sum(finger.numbers[path] for path in paths)
    slope = np.sum([finger.unit(path) for path in paths], axis=0) if paths else np.zeros(len(finger.numbers))
    yield finger.figure("mass", "g", GRAM * total, GRAM * slope)


def _gravity(finger: FingerAtPoses) -> Iterator[Figure]:
    """The largest torque of each joint that holds the finger at rest, gravity having any direction."""
    g = finger.numbers[GRAVITY]
    loads = [finger.outputs("gravity", g=Sloped(np.broadcast_to(axis, (POSES, 3))))["gravity"] for axis in np.eye(3)]
    for joint, name in enumerate(finger.finger.joints):
        along = np.array([load.value[:, joint] for load in loads])
        size = np.sqrt((along**2).sum(axis=0))
        slope = sum(load.value[:, joint] * load.slope[:, :, joint] for load in loads) / np.where(size > 0, size, 1.0)
        total = g * slope + finger.unit(GRAVITY)[:, None] * size
        yield finger.most(f"gravity {name}", "N m", g * size, total)
