"""What a file says of a hand, whatever its format: a tree of bodies, their joints, tendons, couplings and sites.

Lengths are in metres, masses in kilograms, angles in radians; the angle of a slide is a length. Bodies come parents
first; the first one is the world.
A body stands as drawn where every joint is at its reference.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

__all__ = ["LEAST_MASS", "TRAVEL", "Array", "Body", "Joint", "Loss", "Mimic", "Model", "Place", "Site", "Tendon"]

Array = NDArray[np.float64]

LEAST_MASS = 1e-9
"""Mass [kg] of moving bodies that have none, with a radius of gyration of 1 mm: MuJoCo refuses bodies without."""
TRAVEL = 0.1
"""How far [m] slides are taken to go to both sides where nothing says it."""
ROUNDING = 1e-14
"""What differences of angles [rad], or of positions [m], leave at most where they are equal."""


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: its frame in its parent's, and its mass properties in its own frame.

    `axes` (3 x 3) has the body's axes as columns; `inertia` (3 x 3) is about `com` (3). A body without mass has mass 0.
    """

    name: str
    parent: int
    position: Array
    axes: Array
    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint of a body: `axis` (3, a unit vector) through `anchor` (3), both in the body's frame as drawn.

    `kind` is hinge, slide, ball or free; `low` and `high` are None for a joint without limits. `effort` is the largest
    torque that the joint bears, 0 if the file says none.
    """

    name: str
    body: int
    kind: str
    axis: Array
    anchor: Array
    low: float | None = None
    high: float | None = None
    reference: float = 0.0
    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    spring_reference: float = 0.0
    effort: float = 0.0
    measured: bool = False


class Place(NamedTuple):
    """What a tendon passes, in the frame of a body: a point `at` (3), or with a radius a sphere or cylinder to wrap round.

    A cylinder has a unit vector `axis` (3). The tendon passes on the side of the point `side` (3), or by the shorter way.
    The side is in the frame of the body `carrier`, if that is another one.
    With `inside` it runs through the inside. A point with a `divisor` begins a branch behind a pulley.
    """

    body: int
    at: Array
    radius: float | None = None
    axis: Array | None = None
    side: Array | None = None
    carrier: int | None = None
    inside: bool = False
    divisor: float | None = None

    def seen(self, turn: Array, origin: Array) -> Place:
        """The same in another frame: its axes (3 x 3) are the columns of `turn`, its `origin` (3) is in this frame."""
        side = self.side
        if side is not None and self.carrier is None:
            side = turn.T @ (side - origin)
        axis = None if self.axis is None else turn.T @ self.axis
        return self._replace(at=turn.T @ (self.at - origin), axis=axis, side=side)


@dataclass(frozen=True, eq=False)
class Tendon:
    """A tendon: either `arms`, length per angle by joint, or a `path` from place to place.

    Its length also has a `constant` part [m]. An elastic string has a `stiffness` [N/m] and no force where it is as long
    as `rest`. A tendon of arms that its motor also pushes is `two_way`; one that is a part of a tendon over several fingers,
    which one motor pulls, is `across`.
    """

    name: str
    arms: dict[str, float] = field(default_factory=dict)
    path: tuple[Place, ...] = ()
    stiffness: float = 0.0
    rest: float = 0.0
    constant: float = 0.0
    two_way: bool = False
    across: bool = False


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another one: its angle is offset + ratio * leader angle + `powers` of it, from the square on."""

    follower: str
    leader: str
    ratio: float
    offset: float = 0.0
    powers: tuple[float, ...] = ()

    @property
    def curve(self) -> Polynomial:
        """The follower's angle [rad] over its leader's."""
        return Polynomial([self.offset, self.ratio, *self.powers])

    @classmethod
    def of(cls, follower: str, leader: str, curve: Polynomial) -> Self:
        """A joint that follows another one by a curve; an offset that differences of angles leave by rounding is none."""
        offset, ratio, *powers = map(float, [*curve.coef, 0.0][: max(2, len(curve.coef))])
        offset = offset if abs(offset) > ROUNDING else 0.0
        while powers and not powers[-1]:
            powers.pop()
        return cls(follower, leader, ratio, offset, tuple(powers))


@dataclass(frozen=True, eq=False)
class Site:
    """A named point of a body."""

    name: str
    body: int
    position: Array


@dataclass(frozen=True)
class Loss:
    """What a file says and the other format cannot hold, or holds only in part: a sentence, and the places."""

    what: str
    places: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {"what": self.what, "count": len(self.places), "places": list(self.places)}


@dataclass(frozen=True, eq=False)
class Model:
    """A whole file. `notes` say what was taken differently than published; `losses` what is not in this tree.

    `tendon_force` is the largest force [N] of motors that pull tendons, 0 if the file does not limit one of them.
    """

    name: str
    file: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    tendons: tuple[Tendon, ...] = ()
    mimics: tuple[Mimic, ...] = ()
    sites: tuple[Site, ...] = ()
    losses: tuple[Loss, ...] = ()
    notes: tuple[str, ...] = ()
    tendon_force: float = 0.0

    @cached_property
    def poses(self) -> tuple[tuple[Array, Array], ...]:
        """Axes (3 x 3) and position (3) of every body in the world, as drawn."""
        found: list[tuple[Array, Array]] = []
        for index, body in enumerate(self.bodies):
            axes, position = found[body.parent] if index else (np.eye(3), np.zeros(3))
            found.append((axes @ body.axes, position + axes @ body.position))
        return tuple(found)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """The children of every body, in the file's order."""
        found: list[list[int]] = [[] for _ in self.bodies]
        for index, body in enumerate(self.bodies[1:], start=1):
            found[body.parent].append(index)
        return tuple(map(tuple, found))

    @cached_property
    def joints_of(self) -> tuple[tuple[Joint, ...], ...]:
        """The joints of every body, in the order in which they turn it."""
        return tuple(tuple(j for j in self.joints if j.body == index) for index in range(len(self.bodies)))

    def below(self, body: int) -> Iterator[int]:
        """A body and all below it, depth first."""
        yield body
        for child in self.children[body]:
            yield from self.below(child)

    def above(self, body: int) -> list[int]:
        """A body and all above it, up to the world."""
        found = [body]
        while found[-1]:
            found.append(self.bodies[found[-1]].parent)
        return found

    def find(self, name: str) -> int | None:
        """The index of a body by its name."""
        return next((index for index, body in enumerate(self.bodies) if body.name == name), None)
