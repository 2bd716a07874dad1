"""Sizes of a finger's arrays, and the units of their elements: those at a slide are others than those at a hinge."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

from awiwi_gen.hand.parts import Finger
from awiwi_gen.kernel import Port
from awiwi_gen.units import N, Unit, kg, m, one, rad, s

POSE = (one, one, one, m) * 3 + (one,) * 4


@dataclass(frozen=True)
class Size:
    """Sizes of a finger's arrays: independent joints, of which some slide, tendons, links.

    Tendons of one motor count as one.
    """

    sliding: tuple[bool, ...]
    tendons: int
    links: int

    @classmethod
    def of(cls, finger: Finger) -> Size:
        """The sizes of a finger."""
        return cls(
            tuple(joint in finger.sliding for joint in finger.joints), len(finger.transmissions), len(finger.links)
        )

    @property
    def joints(self) -> int:
        """Number of independent joints."""
        return len(self.sliding)

    @property
    def motions(self) -> tuple[Unit, ...]:
        """The unit of each joint's coordinate."""
        return tuple(m if slides else rad for slides in self.sliding)

    @property
    def torques(self) -> tuple[Unit, ...]:
        """The unit of what moves each joint."""
        return tuple(N if slides else N * m for slides in self.sliding)

    def choose(self, hinge: Any, slide: Any) -> Any:
        """One value for all joints if none slides, else one for each."""
        return tuple(slide if slides else hinge for slides in self.sliding) if any(self.sliding) else hinge


def of_units(shape: tuple[int, ...], units: Iterable[Unit]) -> Port:
    """A port of these units, row by row; of one unit if all are the same."""
    found = tuple(units)
    return Port(shape, found[0] if len({unit.label for unit in found}) == 1 else found)


def motion(size: Size, rate: Unit = one) -> Port:
    """One position, velocity or acceleration per joint: in units of its coordinate times `rate`."""
    return of_units((size.joints,), (unit * rate for unit in size.motions))


@cache
def torque(size: Size) -> Port:
    """One torque per joint, or force of a slide."""
    return of_units((size.joints,), size.torques)


@cache
def inertia(size: Size) -> Port:
    """A joint-space mass matrix."""
    arms = [one if slides else m for slides in size.sliding]
    return of_units((size.joints, size.joints), (kg * a * b for a in arms for b in arms))


@cache
def stiffness(size: Size) -> Port:
    """Derivatives of joint torques by joint angles."""
    return of_units((size.joints, size.joints), (a / b for a in size.torques for b in size.motions))


@cache
def coriolis(size: Size) -> Port:
    """A joint-space Coriolis matrix."""
    return of_units((size.joints, size.joints), (a * s / b for a in size.torques for b in size.motions))


@cache
def arms(size: Size) -> Port:
    """Derivatives of tendon lengths by joint angles."""
    return of_units((size.tendons, size.joints), [m / unit for unit in size.motions] * size.tendons)


@cache
def arms_derivative(size: Size) -> Port:
    """Second derivatives of tendon lengths by joint angles."""
    each = [m / a / b for a in size.motions for b in size.motions]
    return of_units((size.tendons, size.joints, size.joints), each * size.tendons)


@cache
def covariance(size: Size) -> Port:
    """Covariances of joint angles."""
    pairs = (sorted((a, b), key=lambda unit: unit.label) for a in size.motions for b in size.motions)  # "m rad"
    return of_units((size.joints, size.joints), (a * b for a, b in pairs))


@cache
def jacobian_port(size: Size) -> Port:
    """Velocity and angular velocity of the fingertip per unit velocity of each joint."""
    rows = [[m / unit for unit in size.motions]] * 3 + [[rad / unit for unit in size.motions]] * 3
    return Port((6, size.joints), tuple(unit for row in rows for unit in row))
