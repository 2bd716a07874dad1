"""`awiwi-gen study stiffness`: which stiffness each joint can have at rest, over poses and pretensions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.study.base import Array, Report, Result, Study
from awiwi_gen.study.figures import View
from awiwi_gen.study.prepare import Request, generated, ranges_of, require_families
from awiwi_gen.study.run import computed

LEVELS = 25  # bins of the mean force, from zero to the limit
DECADES, BINS = (-5.0, 6.0), 440  # of a joint's stiffness, logarithms of N m/rad
SOFTEST = 0.01  # of the limit of the forces: the least force that keeps a tendon taut
UNEVEN = 0.5  # forces are drawn between this share of their level and the level
FAMILIES = ("coupling", "joint_stiffness", "tendon_stiffness")


@dataclass(frozen=True, eq=False)
class Stiffness(Study):
    """Poses drawn evenly in the joints' ranges, and forces that turn no joint, from a share of ``most`` to it [N]."""

    SIZE = 16384
    finger: str
    low: Array
    high: Array
    most: float

    def chunk(self, library: Any, random: np.random.Generator) -> dict[str, Array]:
        """Histograms of each joint's stiffness by mean force, both ends, with poses and forces there."""
        q = self.low + (self.high - self.low) * random.uniform(size=(self.SIZE, len(self.low)))
        view = View(library, self.finger, q, np.zeros(0), np.zeros(0))
        P = view.values("coupling", "P", q)
        f = balanced(P, self.forces(random, P.shape[1]))
        held = ((f >= self.most * SOFTEST) & (f <= self.most)).all(axis=1)
        q, f = q[held], f[held]
        k = view.values("tendon_stiffness", "k", f)
        K = np.diagonal(view.values("joint_stiffness", "K", q, f, k), axis1=1, axis2=2)
        good = np.isfinite(k).all(axis=1) & np.isfinite(K).all(axis=1)
        q, f, K = q[good], f[good], K[good]
        found = {"kept": np.array([len(q), self.SIZE]), "histogram": histogram(f.mean(axis=1) / self.most, K)}
        for end, pick in (("least", np.argmin), ("largest", np.argmax)):
            at = pick(K, axis=0) if len(K) else np.zeros(0, int)
            found |= {end: K[at, np.arange(len(at))], f"{end}_pose": q[at], f"{end}_forces": f[at]}
        return found

    def forces(self, random: np.random.Generator, tendons: int) -> Array:
        """Forces (SIZE, tendons) [N] about levels that are drawn evenly in their logarithm."""
        level = self.most * SOFTEST ** random.uniform(size=(self.SIZE, 1))
        drawn: Array = level * random.uniform(UNEVEN, 1.0, (self.SIZE, tendons))
        return drawn


SAMPLES = 64 * Stiffness.SIZE


def balanced(P: Array, forces: Array) -> Array:
    """The forces nearest to given ones (n, tendons) that turn no joint: P' f = 0."""
    square = P.swapaxes(1, 2) @ P
    torque = np.einsum("nij,ni->nj", P, forces)
    found: Array = forces - np.einsum("nij,njk,nk->ni", P, np.linalg.pinv(square, hermitian=True), torque)
    return found


def histogram(levels: Array, K: Array) -> Array:
    """Counts (joints, LEVELS, BINS) of stiffnesses (n, joints) by level, from 0 to 1; those below zero are not counted."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log10(K)
    parts = [np.histogram2d(levels, each, (LEVELS, BINS), ((0, 1), DECADES))[0] for each in logs.T]
    return np.array(parts).astype(np.uint32)


def conduct(request: Request) -> Report:
    """Run the study. Raises InputError where the finger has no springs, or no forces hold it at rest."""
    hand, finger = request.hand, request.finger
    require_families(hand, finger, *FAMILIES)
    kernels = generated(hand, ",".join(f"{finger}_{family}" for family in FAMILIES), request.progress)
    ports = {port["name"]: port for port in load(kernels)[f"{finger}_joint_stiffness"].outputs}
    study = Stiffness(request.seed, "forces", finger, *ranges_of(hand, finger), float(hand.limits.tendon_force))
    count = request.chunks(study.SIZE)
    chunks = list(computed(study, kernels, count, request.place, request.progress).all(count))
    kept, drawn = np.sum([each["kept"] for each in chunks], axis=0)
    if not kept:
        raise InputError(
            f"fingers.{finger}: no forces of {drawn} between {SOFTEST * study.most:g} and {study.most:g} N hold it at rest"
        )
    units = ports["K"]["unit"].split(", ")
    joints = hand.fingers[finger].joints
    size = len(joints)
    return report(request, study, chunks, [units[i * (size + 1) if len(units) > 1 else 0] for i in range(size)])


def report(request: Request, study: Stiffness, chunks: list[dict[str, Array]], units: list[str]) -> Report:
    """The range of every joint over all poses, and between which stiffnesses most of them are."""
    joints = request.hand.fingers[study.finger].joints
    total: Array = np.asarray(np.sum([each["histogram"] for each in chunks], axis=0, dtype=np.uint64))
    kept, drawn = np.sum([each["kept"] for each in chunks], axis=0)
    filled = [each for each in chunks if each["kept"][0]]
    edges = np.logspace(*DECADES, BINS + 1)
    results = {
        "counts": Result("1", "poses and forces, by joint, mean force and stiffness", total),
        "force_edges": Result("N", "edges of the bins of the mean force", np.linspace(0, study.most, LEVELS + 1)),
        "stiffness_edges": Result("N m/rad (N/m for slides)", "edges of the bins of the stiffness", edges),
    }
    ends = {}
    for end, pick in (("least", np.argmin), ("largest", np.argmax)):
        values = np.array([each[end] for each in filled])
        first = pick(values, axis=0)
        ends[end] = values.min(axis=0) if end == "least" else values.max(axis=0)
        results[end] = Result("N m/rad (N/m for slides)", f"{end} stiffness of each joint", ends[end])
        for kind, unit in (("pose", "rad (m for slides)"), ("forces", "N")):
            at = np.array([filled[int(chunk)][f"{end}_{kind}"][joint] for joint, chunk in enumerate(first)])
            results[f"{end}_{kind}"] = Result(unit, f"{kind} of the {end} stiffness, by joint", at)
    middle = [
        [_quantile(total[joint].sum(axis=0), share, edges) for share in (0.05, 0.95)] for joint in range(len(joints))
    ]
    rows = [
        (name, *(f"{value:.3g}" for value in (ends["least"][i], *middle[i], ends["largest"][i])), units[i],
         f"{ends['largest'][i] / ends['least'][i]:.1f}")
        for i, name in enumerate(joints)
    ]  # fmt: skip
    forces = f"{SOFTEST * study.most:g} to {study.most:g} N"
    lines = [f"{kept} of {drawn} poses and forces, {forces}, turn no joint, and the springs bear them"]
    data = {
        "joints": {name: {"least": float(ends["least"][i]), "largest": float(ends["largest"][i]), "unit": units[i],
                          "5 %": middle[i][0], "95 %": middle[i][1]} for i, name in enumerate(joints)},
        "kept": int(kept), "drawn": int(drawn),
    }  # fmt: skip
    columns = ("joint", "least", "5 % below", "95 % below", "largest", "unit", "times")
    draw = partial(_draw, study=study, total=total, edges=edges, joints=list(joints), units=units)
    return Report(results, columns, rows, lines, data, draw)


def _quantile(counts: Array, share: float, edges: Array) -> float:
    below = counts.cumsum()
    return float(edges[int(np.searchsorted(below, share * below[-1])) + 1])


def _draw(figure: Any, study: Stiffness, total: Array, edges: Array, joints: list[str], units: list[str]) -> None:
    """The range of each joint's stiffness over the mean force of the tendons."""
    columns = min(2, len(joints))
    grid = figure.subplots(-(-len(joints) // columns), columns, squeeze=False).ravel()
    force = (np.arange(LEVELS) + 0.5) * study.most / LEVELS
    for axes, counts, name, unit in zip(grid, total, joints, units, strict=False):
        some = counts.sum(axis=1) > 0
        ends = np.array([[_quantile(row, share, edges) for share in (0.0, 0.5, 1.0)] for row in counts[some]])
        axes.fill_between(force[some], ends[:, 0], ends[:, 2], alpha=0.3)
        axes.plot(force[some], ends[:, 1])
        axes.set_yscale("log")
        axes.set_title(name, fontsize=9)
        axes.set_xlabel("mean force [N]", fontsize=8)
        axes.set_ylabel(f"stiffness [{unit}]", fontsize=8)
    for axes in grid[len(joints) :]:
        axes.set_axis_off()
