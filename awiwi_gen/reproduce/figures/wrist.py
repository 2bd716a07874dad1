"""Figures 6.9 and 6.10: the wrist flexes by 30 deg to either side, then it is abducted by 20 deg (section 6.2).

The source means angles of the palm, about twice the internal angles; these are found by inverting the palm's pose along
one axis at a time.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from awiwi_gen.hand import Hand, Wrist
from awiwi_gen.results import Figure, curves, shaded
from awiwi_gen.simulate import Array

FLEXION, ABDUCTION = np.radians(30.0), np.radians(20.0)
EXACT = 1e-15  # m; what "numerical inaccuracies" may mean for lengths of some centimetres
STEPS = 201


def figures(library: Any, hand: Hand) -> list[Figure]:
    """Both figures of a hand with a wrist; none for a hand without."""
    return [bars(library, hand.wrist), displacements(library, hand.wrist)] if hand.wrist else []


def bars(library: Any, wrist: Wrist) -> Figure:
    """Figure 6.9, judged on the wrist's whole range and drawn along the motion."""
    (low71, low73), (high71, high73) = wrist.range
    everywhere = np.meshgrid(np.linspace(low71, high71, STEPS), np.linspace(low73, high73, STEPS))
    worst = bar_errors(library, wrist, *everywhere).max()

    errors = bar_errors(library, wrist, *motion(library, wrist)).max(axis=-1)
    labels = "step of the motion", "largest error of a bar's length [m]"
    return Figure(
        "6.9", "Errors of the six distances between the points of the wrist",
        "The distances stay constant up to rounding.", f"Within {worst:.0e} m over the whole range of the wrist.",
        bool(worst < EXACT), curves(np.arange(len(errors)), errors, *labels, ylim=(0, 1.5 * worst)),
    )  # fmt: skip


def displacements(library: Any, wrist: Wrist) -> Figure:
    """Figure 6.10: how far the wrist's motion pulls each tendon."""
    path = motion(library, wrist)
    moved = tendon_displacements(library, wrist, *path)
    flexing, abducting = moved[: 2 * STEPS], moved[2 * STEPS :]
    largest = abducting[np.abs(abducting).max(axis=1).argmax()]
    linear = min((abs(np.corrcoef(across, largest[layer])[0, 1]) for layer, across in layers(wrist)), default=0.0)
    ratio = np.abs(abducting).max() / np.abs(flexing).max()

    def draw(axes: Any) -> None:
        across = [1e3 * float(tendon.forearm[1]) for tendon in wrist.tendons]
        shaded(axes, np.arange(len(moved)), moved.T * 1e3, across, "place across the forearm [mm]")
        axes.axvline(2 * STEPS, color="black", linewidth=0.6)
        axes.set(xlabel="step of the motion: flexion, then abduction", ylabel="tendon displacement [mm]")

    return Figure(
        "6.10", "Tendon displacements that a wrist motion causes",
        "Flexion hardly moves the tendons, abduction moves them in proportion to their distance from the median.",
        f"Flexion moves them by up to {np.abs(flexing).max() * 1e3:.2f} mm, abduction {ratio:.1f} times as far; the "
        f"correlation with the distance is at least {linear:.3f} in each layer.", bool(ratio > 5 and linear > 0.99),
        draw,
    )  # fmt: skip


def layers(wrist: Wrist) -> list[tuple[Array, Array]]:
    """Tendons that lie at one height in the forearm, three or more: their indices, and their positions across it [m]."""
    _, y, z = np.array([[float(x) for x in tendon.forearm] for tendon in wrist.tendons]).T
    found = [np.flatnonzero(z == height) for height in np.unique(z)]
    return [(layer, y[layer]) for layer in found if len(layer) > 2]


def motion(library: Any, wrist: Wrist) -> tuple[Array, Array]:
    """Internal angles (q71, q73), each (4 STEPS,) [rad], of the motion: to both sides and back, about either axis."""
    wave = np.sin(np.linspace(0.0, 2 * np.pi, 2 * STEPS))
    flexing = internal_angles(library, wrist, 0, FLEXION * wave)
    abducting = internal_angles(library, wrist, 1, ABDUCTION * wave)
    q71, q73 = (np.concatenate(halves) for halves in zip(flexing, abducting, strict=True))
    return q71, q73


def internal_angles(library: Any, wrist: Wrist, axis: int, turned: Array) -> tuple[Array, Array]:
    """Internal angles at which the palm has flexed (axis 0) or has been abducted (axis 1) by given angles [rad]."""
    sweep = np.linspace(wrist.range[0][axis], wrist.range[1][axis], 20 * STEPS)
    q71, q73 = wrist.neutral
    pose = library.wrist_palm_pose(sweep, q73) if axis == 0 else library.wrist_palm_pose(q71, sweep)
    x = pose.T[..., :3, 0]
    palm = np.arctan2(-x[:, 2], x[:, 0]) if axis == 0 else np.arctan2(x[:, 1], x[:, 0])
    order = np.argsort(palm)
    found, still = np.interp(turned, palm[order], sweep[order]), np.ones_like(turned)
    return (found, q73 * still) if axis == 0 else (q71 * still, found)


def bar_errors(library: Any, wrist: Wrist, q71: Array, q73: Array) -> Array:
    """Deviations (..., 6) [m] of the lengths AA0, BB0, CC0, AB, AC, BC from those of the drawing."""
    a0, a, b = (np.array([float(x) for x in point]) for point in (wrist.a0, wrist.a, wrist.b))
    c0, c = (np.array(point) for point in wrist.far_bar)
    forearm = [a0, np.zeros(3), c0]
    palm = library.wrist_points(q71, q73)[:3]
    drawn = [a, b, c]

    def lengths(points: Any) -> Array:
        triangle = [points[i] - points[k] for i, k in ((0, 1), (0, 2), (1, 2))]
        spans = [p - q for p, q in zip(points, forearm, strict=True)] + triangle
        return np.stack([np.linalg.norm(span, axis=-1) for span in spans], axis=-1)

    errors: Array = np.abs(lengths(palm) - lengths(drawn))
    return errors


def tendon_displacements(library: Any, wrist: Wrist, q71: Array, q73: Array) -> Array:
    """How much longer (..., m) [m] the tendons' paths in the wrist are than in its neutral pose."""
    difference: Array = library.wrist_tendon_lengths(q71, q73).h - library.wrist_tendon_lengths(*wrist.neutral).h
    return difference
