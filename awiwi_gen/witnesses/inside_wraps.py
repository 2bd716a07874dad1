"""Tendons through the inside of a sphere or cylinder, by the law of reflection, with arms by virtual work.

With the angle p between the string and the normal where it bends, the laws of sines of both triangles give the angles at
the ends, and the angles at the body add up to G: 2 p - asin(A sin p) - asin(B sin p) = G. The left side is convex in p, so
Newton's iteration converges from above. The surface is smooth: it presses along the normal, without a moment about the
axis, or about a sphere's centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
from casadi import SX

from awiwi_gen.hand.wraps import INSIDE_CLEARANCE
from awiwi_gen.witnesses.wraps import Wrap

_STEPS = 12


@dataclass(frozen=True)
class InsideWrap(Wrap):
    """A run of tendon through the inside of a body."""

    def converges(self) -> SX:
        """Positive where both ends have the clearance that iterations need, or the string is straight."""
        return _larger(_larger(self._nearest - float(INSIDE_CLEARANCE), -self._nearest), -self._lift)

    @cached_property
    def _nearest(self) -> SX:
        """How far the nearer end is outside the body: (distance / radius)^2 - 1."""
        first, last = (ca.sumsqr(end) / self.radius**2 - 1 for end in self.across)
        return -_larger(-first, -last)

    @cached_property
    def _lift(self) -> SX:
        """How far a straight line misses the body: the cosine of the ends' angle, less that where it just touches."""
        (start, end), (one, other) = self.across, self.distances
        squares = [_larger(SX(0), distance**2 - self.radius**2) for distance in (one, other)]
        return (ca.dot(start, end) - self.radius**2 + ca.sqrt(squares[0] * squares[1])) / (one * other)

    @cached_property
    def touches(self) -> SX:
        """1 where the run bends at the surface, 0 where it is straight."""
        return (1 + ca.sign(self._lift)) / 2 * (1 + ca.sign(self._nearest)) / 2

    @cached_property
    def bend(self) -> SX:
        """The point (3) [m] of the surface where the run bends, from the centre, across the axis."""
        first, last = self._directions()
        one, other = (self.touches * self.radius / distance for distance in self.distances)
        product = ca.cross(first, last)
        angle = self.touches * ca.atan2(ca.norm_2(product), ca.dot(first, last))
        p = -_larger(-angle / (2 - one - other), SX(-ca.pi / 2))
        for _ in range(_STEPS):
            sines, slope = [ratio * ca.sin(p) for ratio in (one, other)], SX(2)
            for ratio, sine in zip((one, other), sines, strict=True):
                slope -= ratio * ca.cos(p) / ca.sqrt(1 - sine**2)
            p -= (2 * p - _arc_sine(sines[0]) - _arc_sine(sines[1]) - angle) / slope
        turned = p - _arc_sine(one * ca.sin(p))
        sideways = ca.cross(product / ca.norm_2(product), first)
        return self.radius * (ca.cos(turned) * first + ca.sin(turned) * sideways)

    def _pieces(self) -> list[SX]:
        """Both pieces of the bent run, as vectors (3) [m] from the ends to the bend, across the axis."""
        return [self.bend - end for end in self.across]

    def length(self) -> SX:
        """Length [m] of the run."""
        straight, bent = ca.norm_2(self.across[1] - self.across[0]), sum(map(ca.norm_2, self._pieces()))
        planar = (1 - self.touches) * straight + self.touches * bent
        return planar if self.body.axis is None else ca.norm_2(ca.vertcat(planar, self.heights[1] - self.heights[0]))

    def arms(self) -> SX:
        """Arms (1 x n) [m/rad]: the virtual work of unit tension on both ends and of the pressure on the body."""
        (start, end), rise = self.across, self.heights[1] - self.heights[0]
        pieces, straight = self._pieces(), end - start
        planar = sum(map(ca.norm_2, pieces)) * self.touches + (1 - self.touches) * ca.norm_2(straight)
        total = self.length()
        forces = []
        for sign, piece in zip((1, -1), pieces, strict=True):
            flat = self.touches * sign * piece / ca.norm_2(piece)
            flat += (1 - self.touches) * straight / ca.norm_2(straight)
            forces.append((planar * flat + rise * self.axis[0]) / total)
        pressure = forces[0] - forces[1]
        arms = forces[1].T @ self.end[1] - forces[0].T @ self.start[1] + pressure.T @ self.centre[1]
        if self.body.axis is not None:
            height = self.heights[0] + rise * ca.norm_2(pieces[0]) / planar
            moment = ca.cross(self.bend + height * self.axis[0], pressure)
            arms += self.touches * ca.cross(moment, self.axis[0]).T @ self.axis[1]
        return arms


def _larger(one: SX, other: SX) -> SX:
    return (one + other + ca.fabs(one - other)) / 2


def _arc_sine(sine: SX) -> SX:
    return ca.atan2(sine, ca.sqrt(1 - sine**2))
