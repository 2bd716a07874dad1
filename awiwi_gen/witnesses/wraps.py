"""Tendons that wrap round spheres and cylinders, in base axes: lengths by cross products, arms by virtual work.

A tight string pulls its end points along its tangents and presses on the body where these touch it. The body is smooth,
so the forces on it have no moment about its axis, or about a sphere's centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import casadi as ca
from casadi import SX

from awiwi_gen.hand.wraps import LEAST_ARC
from awiwi_gen.structure import Finger, link_number
from awiwi_gen.witnesses.kinematics import point_of_link

Moving = tuple[SX, SX]
"""A vector (3) and its rates (3 x n) [1/rad]."""


@dataclass(frozen=True)
class Wrap:
    """A run of tendon round a body: its ends, the centre and the axis (zero for a sphere) in the base, and their rates.

    `home` (3 x 3) has the axes of the body's link in the base.
    """

    body: Any
    start: Moving
    end: Moving
    centre: Moving
    axis: Moving
    side: SX
    home: SX

    @classmethod
    def of(cls, finger: Finger, run: Any, q: SX) -> Self:
        """A run at joint angles q (n) [rad]."""

        def place(link: str, local: SX) -> Moving:
            return point_of_link(finger, q, link_number(finger, link), local)

        body, centre = run.body, ca.vertcat(*run.body.at)
        middle = place(body.link, centre)

        def from_centre(local: SX) -> Moving:
            point = place(body.link, centre + local)
            return point[0] - middle[0], point[1] - middle[1]

        start, end = (place(point.link, ca.vertcat(*point.at)) for point in (run.start, run.end))
        axis, side = (SX.zeros(3), SX.zeros(3, q.numel())), SX.zeros(3)
        if body.axis is not None:
            direction = ca.vertcat(*body.axis)
            axis = from_centre(body.radius * direction / ca.norm_2(direction))
            axis = axis[0] / body.radius, axis[1] / body.radius
        if body.side is not None:
            side = place(body.carrier or body.link, ca.vertcat(*body.side))[0] - middle[0]
        home = ca.horzcat(*(from_centre(body.radius * unit)[0] / body.radius for unit in ca.horzsplit(SX.eye(3))))
        return cls(body, start, end, middle, axis, side, home)

    @property
    def radius(self) -> SX:
        """Radius [m] of the body."""
        return SX(self.body.radius)

    @cached_property
    def heights(self) -> list[SX]:
        """Distances [m] of both ends from the centre, along the axis."""
        return [ca.dot(self.axis[0], point - self.centre[0]) for point, _ in (self.start, self.end)]

    @cached_property
    def across(self) -> list[SX]:
        """Both ends (3) [m] from the centre, across the axis."""
        places = [point - self.centre[0] for point, _ in (self.start, self.end)]
        return [place - self.axis[0] * height for place, height in zip(places, self.heights, strict=True)]

    @cached_property
    def distances(self) -> list[SX]:
        """Distances [m] of both ends from the axis."""
        return [ca.norm_2(end) for end in self.across]

    @cached_property
    def tangents(self) -> list[SX]:
        """Lengths [m] of the tangents from both ends, across the axis."""
        return [ca.sqrt((distance - self.radius) * (distance + self.radius)) for distance in self.distances]

    def passing(self) -> SX:
        """On which side the run passes the body: positive where the side point is, or with the same turn about the axis."""
        (first, last), side = self._directions(), self.side / self.radius
        if self.body.axis is None:
            return ca.dot(side, first) + ca.dot(side, last)
        return ca.dot(ca.cross(self.axis[0], side), last - first)

    def same_side(self, other: Wrap) -> SX:
        """Positive where a run passes the body on the same side in two poses.

        Without a side point, or past half a turn round a sphere, the vectors tell about which the run turns. Such a vector
        may also change where both ends are in nearly one direction from the body, for there the run is straight.
        """
        if self.body.side is None:
            first, last = self._directions()
            sides = ca.dot(first, last)
        else:
            sides = self.passing() * other.passing()
            if self.body.axis is not None:
                return sides
        turns = ca.dot(self.home.T @ self._sine(), other.home.T @ other._sine())
        return (sides + turns + ca.fabs(sides - turns)) / 2

    def _sine(self) -> SX:
        """A vector (3) about which the run turns, as long as the sine of its angle."""
        sense = 1 if self.body.side is None else ca.sign(self.passing())
        start, end = self.across
        return sense * ca.cross(start, end) / (self.distances[0] * self.distances[1])

    def _directions(self) -> tuple[SX, SX]:
        first, last = (end / distance for end, distance in zip(self.across, self.distances, strict=True))
        return first, last

    @cached_property
    def turn(self) -> SX:
        """The unit vector (3) about which the run turns round the body."""
        start, end = self.across
        product = ca.cross(start, end)
        if self.body.axis is None:
            return product / ca.norm_2(product) * (1 if self.body.side is None else ca.sign(self.passing()))
        sense = ca.dot(self.axis[0], product) if self.body.side is None else self.passing()
        return ca.sign(sense) * self.axis[0]

    @cached_property
    def arc(self) -> SX:
        """The angle [rad] along which the run touches the body; negative where it does not."""
        (start, end), (one, other) = self.across, self.tangents
        # Half an angle has the tangent (1 - cos) / sin.
        product = self.distances[0] * self.distances[1]
        angle = 2 * ca.atan2(product - ca.dot(start, end), ca.dot(self.turn, ca.cross(start, end)))
        return angle - ca.atan2(self.radius * (one + other), self.radius**2 - one * other)

    @cached_property
    def touches(self) -> SX:
        """1 where the run touches the body, or nearly does, else 0: there the straight line has the same arms."""
        return (1 + ca.sign(self.arc - float(LEAST_ARC))) / 2

    def _lengths(self) -> tuple[SX, SX, SX]:
        """Lengths [m] across the axis, straight and round the body, and the one that applies."""
        straight, round_ = ca.norm_2(self.across[1] - self.across[0]), sum(self.tangents) + self.radius * self.arc
        return straight, round_, (1 - self.touches) * straight + self.touches * round_

    def length(self) -> SX:
        """Length [m] of the run."""
        planar = self._lengths()[2]
        return planar if self.body.axis is None else ca.norm_2(ca.vertcat(planar, self.heights[1] - self.heights[0]))

    def arms(self) -> SX:
        """Arms (1 x n) [m/rad]: the virtual work of unit tension on both ends and on the body."""
        straight, round_, planar = self._lengths()
        rise = self.heights[1] - self.heights[0]
        total, (start, end) = self.length(), self.across
        contacts, forces = [], []
        for sign, place, distance, tangent in zip((1, -1), self.across, self.distances, self.tangents, strict=True):
            ahead = sign * (self.radius * tangent / distance**2) * ca.cross(self.turn, place)
            contact = (self.radius / distance) ** 2 * place + ahead
            tangential = sign * (contact - place) / tangent
            flat = (1 - self.touches) * (end - start) / straight + self.touches * tangential
            forces.append((planar * flat + rise * self.axis[0]) / total)
            height = (
                self.heights[0] + rise * tangent / round_ if sign > 0 else self.heights[1] - rise * tangent / round_
            )
            contacts.append(contact + height * self.axis[0])
        pressure = forces[0] - forces[1]
        arms = forces[1].T @ self.end[1] - forces[0].T @ self.start[1] + pressure.T @ self.centre[1]
        if self.body.axis is not None:
            moment = ca.cross(contacts[0], forces[0]) - ca.cross(contacts[1], forces[1])
            arms += self.touches * ca.cross(moment, self.axis[0]).T @ self.axis[1]
        return arms
