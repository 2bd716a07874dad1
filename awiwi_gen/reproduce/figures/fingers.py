"""Figures 5.7, 5.16, 5.17: a finger let go with and without Coriolis terms, and the search for the thumb's joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand, Spring
from awiwi_gen.hand.lever import Lever
from awiwi_gen.kernels.base_estimate import base_of
from awiwi_gen.reproduce.base_search import BaseSearch
from awiwi_gen.results import Figure, curves
from awiwi_gen.simulate import Array, Block, Element, Loop, Scenario, Sum, simulate

RELEASE, JOINT = 0.1, 1  # rad, at the joint for flexion
PRETENSION = 20.0  # N in every tendon
DURATION, STEPS = 0.5, 2001  # s
GRID = 9  # poses along each base joint
COUNTS = (15, 30, 50)
NOISES = (0.0, 0.5e-3, 1e-3)  # m
VISIBLE = 1e-3  # of what a figure spans
SEED = 517


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All figures that this hand can show: 5.7 needs an index finger and springs, the others a tensegrity base."""
    found = [coriolis(library, hand, hand.spring)] if "index" in hand.fingers and hand.spring else []
    based = [name for name, finger in hand.fingers.items() if base_of(finger).spans]
    return found + [figure for name in based[:1] for figure in estimates(library, hand, name)]


@dataclass(frozen=True)
class Release:
    """The index finger let go, its motors standing still: one motion for each reading of the damping.

    ``full`` and ``reduced`` are joint angles (readings, times, n) [rad] with and without Coriolis terms.
    """

    readings: tuple[str, ...]
    times: Array
    full: Array
    reduced: Array

    @property
    def difference(self) -> Array:
        """What the Coriolis terms change (readings, times, n) [rad]."""
        change: Array = np.abs(self.full - self.reduced)
        return change


def coriolis(library: Any, hand: Hand, spring: Spring) -> Figure:
    """Figure 5.7, for all that "a damping of 0.1 %" and its neighbours can mean."""
    release = released(library, hand)
    change = release.difference
    seen, coarse = resolution(library, spring, "index"), joint_error(library, "index", 0.5e-3)
    worst = change.max(axis=(1, 2))
    early = change[:, release.times <= DURATION / 5].max(axis=(1, 2))
    unseen = " and ".join(reading for reading, change in zip(release.readings, worst, strict=True) if change < seen)
    listed = "; ".join(
        f"{reading}: {a * 1e3:.2g} mrad within {DURATION / 5:g} s, {b * 1e3:.2g} mrad within {DURATION:g} s"
        for reading, a, b in zip(release.readings, early, worst, strict=True)
    )

    lines = dict(zip(hand.fingers["index"].joints, change[0].T * 1e3, strict=True))
    lines |= {"resolution of the sensors": np.full(STEPS, seen * 1e3)}
    styles, labels = ["-"] * (len(lines) - 1) + [":"], ("time [s]", "change of the joint angles [mrad]")
    return Figure(
        "5.7", "What Coriolis and centrifugal terms change in the motion of the index finger",
        "Without these terms the finger moves the same, within the resolution of its sensors.",
        f"A count of the sensors is {seen * 1e3:.2g} mrad, an error of 0.5 mm in the lengths {coarse * 1e3:.0f} "
        f"mrad. Damping read as {listed}. The difference is a drift of phase, growing with time, less with damping. "
        f"Less than a count of the sensors it remains with {unseen or 'none of these'}. Abduction is moved too, by "
        f"{np.abs(release.full[0, :, 0]).max() * 1e3:.2g} mrad, for the links are not symmetric.",
        bool(worst[0] < seen), curves(release.times, lines, *labels, *styles, title=release.readings[0]),
    )  # fmt: skip


def released(library: Any, hand: Hand) -> Release:
    """Both motions for all readings."""
    n, m = len(hand.fingers["index"].joints), len(hand.fingers["index"].tendons)
    straight, start = np.zeros(n), np.zeros(n)
    start[JOINT] = RELEASE
    dampings = damping_readings(library, straight)
    springs = [Block("spring_force", {"x": f"elongations[{i}]", "f": f"forces[{i}]"}) for i in range(m)]
    damping = [(f"damping[{i * n}:{i * n + n}]", f"qd[{i}]") for i in range(n)]  # row by row: the matrix is symmetric
    values = {
        "q": start, "qd": straight, "at_rest": straight, "forces": np.zeros(m), "g": np.zeros(3),
        "slack_lengths": library.index_tendon_lengths(straight) - library.spring_elongation(PRETENSION).x,
    }  # fmt: skip
    scenarios = [Scenario(values | {"damping": -D}, STEPS) for D in dampings.values()]

    def motion(seen: str) -> Array:
        plant: list[Element] = [
            Sum("speeds", (1.0, "qd")),
            Block("index_tendon_lengths", {"h": "lengths"}),
            Sum("elongations", (1.0, "lengths"), (-1.0, "slack_lengths")),
            *springs,
            Block("index_joint_torque", {"f": "forces", "tau": "pull"}),
            Sum("tau", (1.0, "pull"), *damping),
            Block("index_forward_dynamics", {"qd": seen}),
        ]
        loop = Loop(plant, [], {"q": "speeds", "qd": "qdd"}, period=DURATION / (STEPS - 1))
        return np.stack([trace["q"] for trace in simulate(library, loop, scenarios, ["q"])])

    times = np.linspace(0.0, DURATION, STEPS)
    return Release(tuple(dampings), times, full=motion("qd"), reduced=motion("at_rest"))


def damping_readings(library: Any, q: Array) -> dict[str, Array]:
    """Damping matrices (n, n) [N m s/rad]: shares of the critical damping of every mode, and equal joint dampers."""
    from scipy.linalg import eigh

    force = np.full(len(library.index_tendon_lengths(q)), PRETENSION)
    stiffness = np.full_like(force, library.spring_stiffness(library.spring_elongation(PRETENSION).x).k)
    M = library.index_mass_matrix(q)
    squares, modes = eigh(library.index_joint_stiffness(q, force, stiffness), M)
    turned = M @ modes
    critical = (2 * turned * np.sqrt(squares)) @ turned.T
    modal = {f"{share:g} % of each mode": share / 100 * critical for share in (0.1, 1, 10)}
    return modal | {"1e-3 N m s/rad in each joint": 1e-3 * np.eye(len(q))}


@dataclass(frozen=True)
class Estimates:
    """Base joints of a grid of poses, estimated from (0, 0): poses (points, n), found[noise][count] (points, n)."""

    poses: Array
    found: dict[float, dict[int, Array]]
    optimal: dict[float, Array]

    def error(self, noise: float, count: int | None = None) -> float:
        """The largest error [rad] after so many iterations, or of Gauss and Newton's method at its end."""
        q = self.optimal[noise] if count is None else self.found[noise][count]
        return float(np.abs(q - self.poses).max())


def estimates(library: Any, hand: Hand, finger: str) -> list[Figure]:
    """Figures 5.16 and 5.17, over the whole range of the base joints."""
    search = BaseSearch(library, hand, finger)
    result, visible = estimated(search), VISIBLE * float(np.ptp(search.limits, axis=0).max())
    clean = ", ".join(f"{result.error(0.0, count):.1e} rad after {count}" for count in COUNTS)
    noisy = "; ".join(
        f"{noise * 1e3:g} mm: {', '.join(f'{result.error(noise, c):.4f}' for c in COUNTS)} rad, "
        f"Gauss-Newton {result.error(noise):.4f} rad"
        for noise in NOISES[1:]
    )
    enough = all(result.error(noise, COUNTS[0]) < 1.05 * result.error(noise) for noise in NOISES[1:])

    def draw_one(axes: Any) -> None:
        scatter(axes, result.poses, result.found[0.0][30])
        axes.set(xlabel="flexion [rad]", ylabel="abduction [rad]")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.1), ncols=2)

    def draw_all(axes: Any) -> None:
        axes.set_axis_off()
        for row, count in enumerate(reversed(COUNTS)):
            for column, noise in enumerate(NOISES):
                inset = axes.inset_axes((column / 3, 1 - (row + 1) / 3, 0.3, 0.27))
                scatter(inset, result.poses, result.found[noise][count])
                inset.set_title(f"{count} iterations, {noise * 1e3:g} mm", fontsize=7)
                inset.set(xticks=[], yticks=[])
        axes.legend(*inset.get_legend_handles_labels(), loc="upper center", bbox_to_anchor=(0.5, -0.01), ncols=2)

    return [
        Figure(
            "5.16", f"Base joints of the {finger} by the gradient search, 30 iterations from (0, 0)",
            "30 iterations find the joints, but for the corners.",
            f"The corrected search finds the corners too. From exact lengths its largest errors are {clean} iterations; "
            f"the figure shows {visible:.1e} rad.", bool(result.error(0.0, 30) < visible), draw_one,
        ),
        Figure(
            "5.17", f"The same for {COUNTS[0]}, {COUNTS[1]} and {COUNTS[2]} iterations, from lengths with errors",
            "Few iterations are enough, for errors of the lengths soon decide.",
            f"Largest errors after {', '.join(map(str, COUNTS))} iterations, for lengths wrong by up to {noisy}.",
            enough, draw_all,
        ),
    ]  # fmt: skip


def estimated(search: BaseSearch) -> Estimates:
    """The corrected algorithm 1 and Gauss and Newton's method on a grid over the range of the base joints."""
    axes = [np.linspace(low, high, GRID) for low, high in search.limits.T]
    poses = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(axes))
    start, random = np.zeros(len(axes)), np.random.default_rng(SEED)
    lengths = search.lengths(poses)
    wrong = random.uniform(-1.0, 1.0, lengths.shape)
    return Estimates(
        poses,
        {e: {count: search.gradient(lengths + e * wrong, start, count).q for count in COUNTS} for e in NOISES},
        {e: search.least_squares(lengths + e * wrong, start, 30).q for e in NOISES},
    )


def scatter(axes: Any, poses: Array, found: Array) -> None:
    """Circles where the joints are, crosses where they are found."""
    axes.plot(*poses.T, "o", color="tab:red", fillstyle="none", markersize=4, label="joints")
    axes.plot(*found.T, "x", color="tab:blue", markersize=4, label="found")


def resolution(library: Any, spring: Spring, finger: str) -> float:
    """Largest joint error [rad] at the straight finger from lengths wrong by one count of the lever's sensor."""
    counts = abs(float(spring.sensor.taut) - float(spring.sensor.slack))
    return joint_error(library, finger, Lever(spring).travel / counts)


def joint_error(library: Any, finger: str, noise: float) -> float:
    """Largest joint error [rad] at the straight finger from lengths that are wrong by at most noise [m]."""
    kernel = library[f"{finger}_joint_estimate_error"]
    return float(kernel(np.zeros(kernel.inputs[0]["shape"]), noise).worst.max())
