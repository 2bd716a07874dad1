"""Tendons that one motor pulls in several fingers, as one tendon in each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from awiwi_gen.interchange.model import Place, Tendon


class Piece(NamedTuple):
    """A piece of a path, between two points: its places, the index of the first, and what its length counts divided by."""

    places: tuple[Place, ...]
    first: int
    divisor: float

    @property
    def bodies(self) -> list[int]:
        """The bodies that carry its places and their side points."""
        return [body for each in self.places for body in (each.body, each.carrier) if body is not None]


def split(tendon: Tendon, joints: Mapping[str, str], bodies: Mapping[int, str]) -> dict[str, Tendon] | None:
    """A tendon as one in each finger, whose lengths add up to its own; `joints` and `bodies` have their fingers.

    What is in no finger goes to the first one. None where a piece leads from one finger to another, or a spring pulls it.
    """
    owners = [[finger for finger in map(bodies.get, each.bodies) if finger] for each in pieces(tendon.path)]
    known = [joints[joint] for joint in tendon.arms if joint in joints]
    fingers = list(dict.fromkeys([*known, *(finger for each in owners for finger in each)]))
    if tendon.stiffness or any(len(set(each)) > 1 for each in owners):
        return None
    found = {}
    for finger in fingers:
        arms = {joint: arm for joint, arm in tendon.arms.items() if joints.get(joint, fingers[0]) == finger}
        own = [piece for piece, each in zip(pieces(tendon.path), owners, strict=True) if (each or fingers)[0] == finger]
        constant = tendon.constant if finger == fingers[0] else 0.0
        found[finger] = replace(tendon, arms=arms, path=joined(own), constant=constant)
    return found


def pieces(path: tuple[Place, ...]) -> list[Piece]:
    """The pieces of a path, from point to point, with the geom between them if there is one."""
    found: list[Piece] = []
    start, divisor = None, 1.0
    for index, place in enumerate(path):
        if place.radius is not None:
            continue
        if place.divisor is not None:
            divisor = place.divisor
        elif start is not None:
            found.append(Piece(path[start : index + 1], start, divisor))
        start = index
    return found


def joined(chosen: list[Piece]) -> tuple[Place, ...]:
    """The path of some pieces: a branch begins where one does not go on from the one before."""
    found: list[Place] = []
    end, counted = -1, 1.0
    for piece in chosen:
        begin = piece.places[0]
        if piece.first == end and piece.divisor == counted:
            found += piece.places[1:]
        else:
            fresh = not found and piece.divisor == 1
            found += [begin._replace(divisor=None if fresh else piece.divisor), *piece.places[1:]]
        end, counted = piece.first + len(piece.places) - 1, piece.divisor
    return tuple(found)
