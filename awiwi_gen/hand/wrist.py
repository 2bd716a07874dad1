"""The wrist as a hand file describes it: a double inverted parallelogram, drawn once, in its neutral pose (chapter 6).

Frame {0} of the forearm has its origin at B0, x along the arm, y from B0 to C0 and z across the thickness. Three bars
carry the palm, a rigid triangle A, B, C:

    bar BB0     from (0, 0, 0) to `b`: it crosses the width, so `b` lies at y = width
    bar CC0     its mirror image at half width: from (0, width, 0) to C = (b.x, 0, b.z)
    bar AA0     from `a0` to `a`, which lies straight across the palm from M, the middle of BC

The lengths of the bars, the width B0C0 = BC, the height AM and the neutral angles follow from these points, so a
drawing cannot contradict itself. So does the assembly of the linkage: the one with crossed bars.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from awiwi_gen.hand.names import Source
from awiwi_gen.hand.parts import Angle, Keys, Part, Point

__all__ = ["Linkage", "Swing", "Wrist", "WristTendon", "closure"]

_STEPS = 40  # per axis, of the grid of poses on which the bars must close
_MARGIN = 1e-6  # relative distance that a bar keeps from the end of its reach


class Swing(Part):
    """Range of an internal angle of the wrist, relative to its neutral value."""

    low: Angle
    high: Angle


class WristTendon(Part):
    """A tendon's straight run through the wrist, between a point in the forearm frame and one in the palm frame."""

    forearm: Point
    palm: Point


class Wrist(Part):
    """Two degrees of freedom between forearm and palm, and the tendons through the wrist.

    The palm frame is parallel to {0} in the neutral pose, with its origin at `palm`. `q71` turns the plane of B and C
    about B0C0, `q73` is the angle between B0C0 and bar BB0 in that plane.
    """

    a0: Point
    a: Point
    b: Point
    palm: Point
    q71: Annotated[Swing, Field(examples=['{ low = "-30 deg", high = "30 deg" }'])]
    q73: Annotated[Swing, Field(examples=['{ low = "-20 deg", high = "20 deg" }'])]
    tendons: Annotated[tuple[WristTendon, ...], Field(strict=False, examples=["[{ forearm = [...], palm = [...] }]"])]
    source: Source

    @property
    def neutral(self) -> tuple[float, float]:
        """The internal angles q71, q73 of the neutral pose [rad]."""
        x, y, z = (float(value) for value in self.b)
        return math.atan2(z, x), math.atan2(math.hypot(x, z), y)

    @property
    def range(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lowest and highest internal angles: (q71, q73), (q71, q73) [rad]."""
        q71, q73 = self.neutral
        low = q71 + float(self.q71.low), q73 + float(self.q73.low)
        return low, (q71 + float(self.q71.high), q73 + float(self.q73.high))

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers, ready for JSON."""
        return {"tendons": len(self.tendons)}


def closure(wrist: Wrist) -> Iterator[tuple[Keys, str]]:
    """Why the drawn linkage cannot move through its whole range: complaints as in `lint`."""
    if drawn := list(_misdrawn(wrist)):
        yield from drawn
        return
    linkage, (low, high) = Linkage.of(wrist), wrist.range
    for i in range(_STEPS + 1):
        for k in range(_STEPS + 1):
            pose = low[0] + (high[0] - low[0]) * i / _STEPS, low[1] + (high[1] - low[1]) * k / _STEPS
            if reason := linkage.obstacle(*pose):
                q71, q73 = (f"{math.degrees(angle):.4g} deg" for angle in pose)
                away = " and ".join(f"{math.degrees(p - n):+.4g}" for p, n in zip(pose, wrist.neutral, strict=True))
                yield (), f"does not close at q71 = {q71}, q73 = {q73} ({away} deg from the neutral pose): {reason}"
                return


def _misdrawn(wrist: Wrist) -> Iterator[tuple[Keys, str]]:
    """Conditions that the points of the neutral pose break."""
    x0, _, z0 = (coordinate.value for coordinate in wrist.a0)
    x, y, z = (coordinate.value for coordinate in wrist.a)
    bx, by, bz = (coordinate.value for coordinate in wrist.b)
    if by <= 0 or not (bx or bz):
        yield ("b",), "does not cross the width of the wrist: expected y = B0C0 above zero, and x or z other than zero"
    for axis, found, wanted in (("x", x, bx), ("y", y, by / 2)):
        if float(found) != float(wanted):
            digits = next(
                (n for n in range(6, 18) if f"{float(found) * 1e3:.{n}g}" != f"{float(wanted) * 1e3:.{n}g}"), 17
            )
            given, expected = (f"{float(value) * 1e3:.{digits}g} mm" for value in (found, wanted))
            yield ("a",), f"has {axis} = {given}; expected {expected}, straight across the palm from the middle of BC"
    if x0 >= bx:
        yield ("a0", 0), f'= "{wrist.a0[0]}" lies no nearer to the elbow than the palm, with b at x = "{wrist.b[0]}"'
    off_plane = z0 * bx - x0 * bz  # of A0 from the plane of the side bars, times their length in it
    if z == bz:
        yield ("a",), "lies on BC: the palm's three points must form a triangle"
    elif off_plane * (bz - z) <= 0:
        yield ("a",), "lies on the same side of the side bars as A0; expected on the other, so that the bars cross"


@dataclass(frozen=True)
class Linkage:
    """The lengths that decide whether the bars close [m]."""

    a0: tuple[float, float, float]
    side: float
    width: float
    height: float
    middle: float

    @classmethod
    def of(cls, wrist: Wrist) -> Linkage:
        """The linkage of the drawing."""
        x, y, z = (float(value) for value in wrist.a0)
        points = [tuple(float(value) for value in point) for point in (wrist.a, wrist.b)]
        a, b = points
        return cls((x, y, z), math.hypot(*b), b[1], b[2] - a[2], math.dist((x, y, z), a))

    def obstacle(self, q71: float, q73: float) -> str:
        """Why the linkage does not have a pose; empty if it does."""
        x0, y0, z0 = self.a0
        along, across = self.side * math.sin(q73), self.side * math.cos(q73)  # B, in the plane of the side bars
        if not along > _MARGIN * self.side:
            return "the side bars have reached the line B0C0"
        away = z0 * math.cos(q71) - x0 * math.sin(q71)
        if not away * self.height > 0:
            return "the plane of the side bars has reached A0"
        # C lies on the parallel to C0B through B0 (eq. 6.4).
        stretch = (self.side**2 - self.width**2) / math.hypot(along, across - self.width) ** 2
        c = (stretch * along, stretch * (across - self.width))
        y = ((along - c[0]) / self.width, (across - c[1]) / self.width)
        p = (x0 * math.cos(q71) + z0 * math.sin(q71) - (along + c[0]) / 2, y0 - (across + c[1]) / 2)
        reach = (math.hypot(*p, away) ** 2 + self.height**2 - self.middle**2) / (2 * self.height)
        distance = math.hypot(p[0] * y[1] - p[1] * y[0], away)
        return "" if abs(reach) < distance * (1 - _MARGIN) else "bar AA0 does not reach"
