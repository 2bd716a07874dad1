"""Tensors of solid cylinders in the place of published ones that no body of that mass and size has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from awiwi_gen.hand.plausibility import Body
from awiwi_gen.interchange.draft import DraftFinger, DraftHand, DraftLink
from awiwi_gen.interchange.model import Array, Loss

__all__ = ["with_assumed_tensors"]

_RADIUS = 0.25  # of the cylinder, in its lengths
_LEAST_LENGTH = 1e-3  # m


def with_assumed_tensors(hand: DraftHand) -> DraftHand:
    """The hand with a solid cylinder along each bone whose tensor is that of no body, or one that `check` warns of."""
    replaced: list[str] = []
    fingers = tuple(_finger(finger, replaced) for finger in hand.fingers)
    loss = Loss(
        "tensors that no body of that mass and size has: solid cylinders along the bones assumed", tuple(replaced)
    )
    return replace(hand, fingers=fingers, losses=(*hand.losses, *([loss] if replaced else [])))


def _finger(finger: DraftFinger, replaced: list[str]) -> DraftFinger:
    size = max(float(np.linalg.norm(link.offset)) for link in finger.links) / 2
    links = []
    for link in finger.links:
        if link.mass is None or _is_usual(link, size):
            links.append(link)
            continue
        replaced.append(link.body)
        tensor = _cylinder(link.mass, link.offset, link.com, size)
        links.append(replace(link, inertia=tensor, assumed=(*link.assumed, "inertia")))
    return replace(finger, links=tuple(links))


def _is_usual(link: DraftLink, size: float) -> bool:
    """Whether some body has this tensor, and one as large as the bone (or as `size` [m], without a bone)."""
    moments = np.linalg.eigvalsh(link.inertia)
    if moments[0] <= 0 or moments[0] + moments[1] < moments[2] * (1 - 1e-12):
        return False
    xx, yy, zz = map(float, np.diag(link.inertia))
    xy, xz, yz = (float(link.inertia[place]) for place in ((0, 1), (0, 2), (1, 2)))
    bone, com = ((float(x), float(y), float(z)) for x, y, z in (link.offset, link.com))
    body = Body(link.mass or 0.0, com, (xx, yy, zz), (xy, xz, yz), bone, size)
    return not any(remark.keys == ("inertia",) for remark in body.remarks())


def _cylinder(mass: float, bone: Array, com: Array, size: float) -> Array:
    """Tensor (3 x 3) [kg m^2] of a solid cylinder about its centre, along the bone, or along the way to `com` without."""
    length = float(np.linalg.norm(bone)) or size or _LEAST_LENGTH
    ways = [way / np.linalg.norm(way) for way in (bone, com) if np.any(way)]
    axis = ways[0] if ways else np.array([0.0, 0.0, 1.0])
    radius = _RADIUS * length
    along, across = mass * radius**2 / 2, mass * (3 * radius**2 + length**2) / 12
    return across * np.eye(3) + (along - across) * np.outer(axis, axis)
