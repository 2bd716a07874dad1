"""Motions of a finger that move no inertia: there its mass matrix is singular, and accelerations do not exist."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from awiwi_gen.hand.parts import Finger
from awiwi_gen.hand.pose import Chain, point

__all__ = ["without_inertia"]

_STEP = 1e-5  # rad, of central differences: errors of 1e-10 relative
_SINGULAR = 1e-6  # of the least singular value of the joints' velocities, each of length one


def without_inertia(finger: Finger) -> tuple[str, list[float]] | None:
    """An independent joint that moves no inertia, or none that others do not move too, and the pose [rad]; or None.

    Bodies with mass have inertia about every axis. So only fingers with links that have no mass are looked at.
    """
    if all(link.mass is not None for link in finger.links):
        return None
    import numpy as np

    chain = Chain(finger)
    for q in chain.poses():
        moved = np.vstack([_velocities(chain, q), _rotors(chain, q)])
        lengths = np.linalg.norm(moved, axis=0)
        if not lengths.all():
            return finger.joints[int(np.argmin(lengths))], q
        *_, values, motions = np.linalg.svd(moved / lengths, full_matrices=len(moved) < len(q))
        if len(values) < len(q) or values[-1] < _SINGULAR:
            return finger.joints[int(np.argmax(abs(motions[-1])))], q
    return None


def _velocities(chain: Chain, q: Sequence[float]) -> Any:
    """Velocities of all bodies with mass, weighted so that their squares are energies, by those of the joints."""
    import numpy as np

    columns = []
    for joint in range(len(q)):
        ends = [[x + sign * _STEP * (k == joint) for k, x in enumerate(q)] for sign in (1, -1)]
        ahead, behind = (_places(chain, end) for end in ends)
        columns.append((ahead - behind) / (2 * _STEP))
    return np.array(columns).T


def _places(chain: Chain, q: Sequence[float]) -> Any:
    """Of every body with mass, its centre and three points at a distance as large as its radius of gyration."""
    import numpy as np

    found: list[float] = []
    for link, (_, (axes, origin)) in zip(chain.finger.links, chain.frames(q), strict=True):
        if link.mass is None or link.com is None or link.inertia is None:
            continue
        x, y, z = (float(value) for value in link.com)
        inertia = link.inertia
        size = math.sqrt(float(inertia.xx.value + inertia.yy.value + inertia.zz.value) / float(link.mass))
        corners = ((0.0, 0.0, 0.0), (size, 0.0, 0.0), (0.0, size, 0.0), (0.0, 0.0, size))
        for dx, dy, dz in corners:
            place = point(axes, origin, (x + dx, y + dy, z + dz))
            found += [math.sqrt(float(link.mass)) * value for value in place]
    return np.array(found)


def _rotors(chain: Chain, q: Sequence[float]) -> Any:
    """The same for the rotors of the joints' armature."""
    import numpy as np

    rows = np.zeros((len(chain.finger.links), len(q)))
    for row, link in enumerate(chain.finger.links):
        column, slope = chain.slope(link.joint, q)
        rows[row, column] = slope * math.sqrt(float(link.armature or 0))
    return rows
