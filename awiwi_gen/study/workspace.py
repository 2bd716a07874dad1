"""`awiwi-gen study workspace`: where the fingertip gets to in the joints' ranges, and how well it moves there."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from awiwi_gen.hand import Finger
from awiwi_gen.study.base import Array, Report, Result, Study
from awiwi_gen.study.figures import View
from awiwi_gen.study.prepare import Request, generated, ranges_of, require_families
from awiwi_gen.study.run import computed

VOXELS = 64  # along each axis, from minus to plus the longest reach
BINS = 4096  # of manipulability
NONE = np.zeros(0)


@dataclass(frozen=True, eq=False)
class Workspace(Study):
    """Joint positions drawn evenly in their ranges.

    ``reach`` [m] is no less than the fingertip's distance, ``most`` the end of the histogram of manipulability.
    """

    SIZE = 65536
    finger: str
    low: Array
    high: Array
    reach: float
    most: float

    def chunk(self, library: Any, random: np.random.Generator) -> dict[str, Array]:
        """Counts and largest manipulability by voxel, ends of both, and their joint positions."""
        q = self.low + (self.high - self.low) * random.uniform(size=(self.SIZE, len(self.low)))
        view = View(library, self.finger, q, NONE, NONE)
        tips, J = view.values("fingertip_pose", "T", q)[:, :3, 3], view.values("jacobian", "J", q)[:, :3]
        good = np.isfinite(tips).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
        q, tips, measure = q[good], tips[good], manipulability(J[good])
        place = np.clip(((tips / self.reach + 1) * (VOXELS / 2)).astype(int), 0, VOXELS - 1)
        flat = np.ravel_multi_index(tuple(place.T), (VOXELS,) * 3)
        best = np.zeros(VOXELS**3, np.float32)
        np.maximum.at(best, flat, measure.astype(np.float32))
        far = np.linalg.norm(tips, axis=1)
        return {
            "counts": np.bincount(flat, minlength=VOXELS**3).astype(np.uint32),
            "manipulability": best,
            "histogram": np.histogram(np.clip(measure / self.most, 0, 1), BINS, (0, 1))[0],
            "ends": np.array([tips.min(axis=0), tips.max(axis=0)]),
            "most": np.array([measure.max(), far.max()]),
            "most_at": q[[measure.argmax(), far.argmax()]],
            "kept": np.array([len(q), self.SIZE]),
        }


SAMPLES = 16 * Workspace.SIZE


def manipulability(J: Array) -> Array:
    """sqrt(det(J J')) of translational Jacobians (n, 3, joints), with J' J for fewer than three joints."""
    square = J @ J.swapaxes(1, 2) if J.shape[2] >= 3 else J.swapaxes(1, 2) @ J
    found: Array = np.sqrt(np.maximum(np.linalg.det(square), 0.0))
    return found


def reach_of(finger: Finger) -> float:
    """The lengths of all links and slides [m], one after another."""
    bones = sum(sqrt(sum(float(x) ** 2 for x in link.offset)) for link in finger.links)
    slides = sum(max(abs(float(link.low or 0)), abs(float(link.high or 0))) for link in finger.links if link.slides)
    return bones + slides


def most_of(finger: Finger, reach: float) -> float:
    """What manipulability hardly exceeds: no arm is longer than the reach, and a slide moves the fingertip as much."""
    rank = min(3, len(finger.joints))
    squares = sum(1.0 if link.slides else reach**2 for link in finger.links)
    return float((squares / rank) ** (rank / 2))


def conduct(request: Request) -> Report:
    """Run the study. Raises InputError where the finger has no kernels for it."""
    hand, finger = request.hand, request.finger
    require_families(hand, finger, "fingertip_pose", "jacobian")
    kernels = generated(hand, f"{finger}_fingertip_pose,{finger}_jacobian", request.progress)
    reach = 1.001 * reach_of(hand.fingers[finger])
    most = most_of(hand.fingers[finger], reach)
    study = Workspace(request.seed, "poses", finger, *ranges_of(hand, finger), reach, most)
    count = request.chunks(study.SIZE)
    return report(request, study, list(computed(study, kernels, count, request.place, request.progress).all(count)))


def report(request: Request, study: Workspace, chunks: list[dict[str, Array]]) -> Report:
    """Volume, extent, reach and manipulability over all chunks."""
    counts: Array
    counts, best = (
        np.sum([each["counts"] for each in chunks], axis=0, dtype=np.uint64).reshape((VOXELS,) * 3),
        np.max([each["manipulability"] for each in chunks], axis=0).reshape((VOXELS,) * 3),
    )
    low, high = np.min([c["ends"][0] for c in chunks], axis=0), np.max([c["ends"][1] for c in chunks], axis=0)
    most = np.array([each["most"] for each in chunks])
    where = [chunks[int(most[:, i].argmax())]["most_at"][i] for i in range(2)]
    kept, drawn = np.sum([each["kept"] for each in chunks], axis=0)
    volume = float((counts > 0).sum() * (2 * study.reach / VOXELS) ** 3)
    quantiles = {f"{share:.0%}": quantile(chunks, share) * study.most for share in (0.05, 0.5, 0.95)}
    joints = request.hand.fingers[study.finger].joints
    power = min(3, len(joints))
    rows = [
        (f"{axis}", f"{a * 1e3:.1f} mm", f"{b * 1e3:.1f} mm", f"{(b - a) * 1e3:.1f} mm")
        for axis, a, b in zip("xyz", low, high, strict=True)
    ]
    lines = [
        f"{kept} of {drawn} poses; {volume * 1e6:.1f} cm^3 are reached, in cubes of {2e3 * study.reach / VOXELS:.1f} mm",
        f"the fingertip is at most {most[:, 1].max() * 1e3:.1f} mm away, at {_pose(joints, where[1])}",
        "manipulability [cm^{}]: {}, at most {:.3g} at {}".format(
            power,
            ", ".join(f"{share} below {value * 100.0**power:.3g}" for share, value in quantiles.items()),
            most[:, 0].max() * 100.0**power,
            _pose(joints, where[0]),
        ),
    ]
    edges = np.linspace(-study.reach, study.reach, VOXELS + 1)
    results = {
        "counts": Result("1", "poses whose fingertip is in each cube, along x, y and z of the base frame", counts),
        "manipulability": Result(f"m^{power}", "largest sqrt(det(J J')) in each cube", best),
        "edges": Result("m", "edges of the cubes along each axis", edges),
        "extent": Result("m", "least and largest coordinates of the fingertip", np.array([low, high])),
        "best_pose": Result("rad (m for slides)", "where manipulability is largest", where[0]),
        "farthest_pose": Result("rad (m for slides)", "where the fingertip is farthest", where[1]),
    }
    data = {"volume": volume, "extent": [low.tolist(), high.tolist()], "reach": float(most[:, 1].max()),
            "manipulability": {**quantiles, "most": float(most[:, 0].max())}, "poses": int(drawn)}  # fmt: skip
    return Report(
        results, ("axis", "from", "to", "extent"), rows, lines, data, lambda figure: _draw(figure, best, edges)
    )


def quantile(chunks: list[dict[str, Array]], share: float) -> float:
    """The upper end of the bin of manipulability below which a share of the poses is."""
    total = np.sum([each["histogram"] for each in chunks], axis=0).cumsum()
    return float((np.searchsorted(total, share * total[-1]) + 1) / BINS)


def _pose(joints: Any, q: Array) -> str:
    return ", ".join(f"{name} {value:.2f}" for name, value in zip(joints, q, strict=True))


def _draw(figure: Any, best: Array, edges: Array) -> None:
    """The largest manipulability along each axis, as two views."""
    for axes, (across, up, through) in zip(figure.subplots(1, 2), ((0, 1, 2), (0, 2, 1)), strict=True):
        flat = best.max(axis=through)
        shown = np.ma.masked_equal(flat, 0)
        drawn = axes.pcolormesh(edges * 1e3, edges * 1e3, shown.T, rasterized=True)
        axes.set_aspect("equal")
        axes.set_xlabel(f"{'xyz'[across]} [mm]")
        axes.set_ylabel(f"{'xyz'[up]} [mm]")
    figure.colorbar(drawn, ax=axes, label="largest manipulability (SI)")
