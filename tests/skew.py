"""The finger of skew_finger.toml on plain arrays: fixed rotations as URDF has them, and what acts in its joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from textbook import coordinates, rotation_z, vector

SKEW_FINGER = Path(__file__).with_name("skew_finger.toml")


def about(axis, angle):
    """The rotation (3 x 3) about a coordinate axis."""
    order = np.roll(np.arange(3), axis - 2)
    return rotation_z(angle)[np.ix_(order, order)].T if False else _permuted(rotation_z(angle), axis)
