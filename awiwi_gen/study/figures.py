"""What a study of tolerances measures of a finger: fingertip, coupling, stiffness, gravity, at fixed poses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.study.base import Array

NONE = 1e-6  # of the largest value: less is no reference for a share, such as gravity about an upright axis
GOALS = {"fingertip": "1 mm", "stiffness": "5 %"}


@dataclass(frozen=True)
class View:
    """Kernels of a finger, and where they are evaluated: poses (n, joints), tensions (tendons,) [N], gravity [m/s^2]."""

    library: Any
    finger: str
    poses: Array
    tensions: Array
    gravity: Array

    def values(self, family: str, output: str, *inputs: Array) -> Array:
        """An output of a kernel of the finger; NaN where the kernel has no solution."""
        found = self.library[f"{self.finger}_{family}"](*inputs)
        if isinstance(found, np.ndarray):
            return found
        values: Array = getattr(found, output)
        status = getattr(found, "status", None)
        if status is None or not np.any(status):
            return values
        solved = np.reshape(status == 0, status.shape + (1,) * (values.ndim - status.ndim))
        return np.where(solved, values, np.nan)


@dataclass(frozen=True)
class Figure:
    """A figure: unit, meaning, the families of kernels that it needs, and its values as (poses, parts, components).

    The error of a part is the length of the difference of its components, divided by ``scale``: what a figure in
    percent is relative to, from the values as known.
    """

    unit: str
    meaning: str
    families: tuple[str, ...]
    values: Callable[[View], Array]
    scale: Callable[[Array], Array]


def _fingertip(view: View) -> Array:
    return view.values("fingertip_pose", "T", view.poses)[:, None, :3, 3]


def _coupling(view: View) -> Array:
    return view.values("coupling", "P", view.poses)[..., None]


def _stiffness(view: View) -> Array:
    k = view.values("tendon_stiffness", "k", view.tensions)
    K = view.values("joint_stiffness", "K", view.poses, view.tensions, k)
    return np.diagonal(K, axis1=1, axis2=2)[..., None]


def _gravity(view: View) -> Array:
    return view.values("gravity", "gravity", view.poses, view.gravity)[..., None]


def _largest(values: Array, axes: tuple[int, ...]) -> Array:
    largest = np.abs(values).max(axis=axes, keepdims=True)
    return np.where(largest > NONE * largest.max(), largest, np.inf)


FIGURES: Mapping[str, Figure] = {
    "fingertip": Figure("m", "distance of the fingertip", ("fingertip_pose",), _fingertip, lambda values: np.ones(1)),
    "coupling": Figure(
        "1", "a lever arm, of the joint's largest", ("coupling",), _coupling, lambda values: _largest(values, (0, 1))
    ),
    "stiffness": Figure(
        "1", "a joint's stiffness", ("joint_stiffness", "tendon_stiffness"), _stiffness, lambda values: _largest(values, ())
    ),
    "gravity": Figure(
        "1", "a joint's load by gravity, of its largest", ("gravity",), _gravity, lambda values: _largest(values, (0,))
    ),
}  # fmt: skip


def errors(found: Array, known: Array, scale: Array) -> Array:
    """The error (..., poses, parts) of values (..., poses, parts, components)."""
    away = (found - known) / scale
    length: Array = np.sqrt((away * away).sum(axis=-1))
    return length


def worst(found: Array, known: Array, scale: Array) -> float:
    """The largest error over poses and parts; infinite where a kernel has no solution."""
    largest = float(errors(found, known, scale).max())
    return largest if largest == largest else float("inf")
