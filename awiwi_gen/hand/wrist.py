"""The wrist as a hand file describes it: a double inverted parallelogram, drawn once, in its neutral pose (chapter 6).

Frame {0} of the forearm has its origin at B0, x along the arm, y from B0 to C0 and z across the thickness. Three bars
carry the palm, a rigid triangle A, B, C:

    bar BB0     from (0, 0, 0) to `b`: it crosses the width, so `b` lies at y = width
    bar CC0     its mirror image at half width: from (0, width, 0) to C = (b.x, 0, b.z)
    bar AA0     from `a0` to `a`, which lies straight across the palm from M, the middle of BC

The lengths of the bars, the width B0C0 = BC, the height AM and the neutral angles follow from these points, so a
drawing cannot contradict itself. So does the assembly of the linkage: the one with crossed bars.

With `width`, C0 lies at (0, width, 0) wherever B is; with `c`, C is any point in the plane of the side bars that lets
them cross. The bars then differ in length, and A may be any point on the other side of their plane than A0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from awiwi_gen.hand.names import Source
from awiwi_gen.hand.part import Size
from awiwi_gen.hand.parts import Angle, Keys, Part, Point
from awiwi_gen.structure import is_symmetric

__all__ = ["Linkage", "Swing", "Wrist", "WristTendon", "closure"]

Vector = tuple[float, float, float]

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
    width: Size | None = None
    c: Point | None = None
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

    @property
    def far_bar(self) -> tuple[Vector, Vector]:
        """C0 and C in the neutral pose [m]."""
        x, y, z = (float(value) for value in self.b)
        cx, cy, cz = (x, 0.0, z) if self.c is None else (float(value) for value in self.c)
        return (0.0, y if self.width is None else float(self.width), 0.0), (cx, cy, cz)

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers, ready for JSON."""
        return {"tendons": len(self.tendons), **({} if is_symmetric(self) else {"bars": "unequal"})}


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
    if (by <= 0 and is_symmetric(wrist)) or not (bx or bz):
        yield ("b",), "does not cross the width of the wrist: expected y = B0C0 above zero, and x or z other than zero"
        return
    if x0 >= bx:
        yield ("a0", 0), f'= "{wrist.a0[0]}" lies no nearer to the elbow than the palm, with b at x = "{wrist.b[0]}"'
    off_plane = z0 * bx - x0 * bz  # of A0 from the plane of the side bars, times their length in it
    if not is_symmetric(wrist):
        yield from _misdrawn_unequal(wrist)
        return
    for axis, found, wanted in (("x", x, bx), ("y", y, by / 2)):
        if float(found) != float(wanted):
            given, expected = _told_apart(found, wanted)
            yield ("a",), f"has {axis} = {given}; expected {expected}, straight across the palm from the middle of BC"
    if z == bz:
        yield ("a",), "lies on BC: the palm's three points must form a triangle"
    elif off_plane * (bz - z) <= 0:
        yield ("a",), "lies on the same side of the side bars as A0; expected on the other, so that the bars cross"


def _misdrawn_unequal(wrist: Wrist) -> Iterator[tuple[Keys, str]]:
    """The same for bars that differ in length."""
    bx, _, bz = (coordinate.value for coordinate in wrist.b)
    if wrist.c is not None:
        x, _, z = (coordinate.value for coordinate in wrist.c)
        axis, found, wanted = ("z", z, x * bz / bx) if bx else ("x", x, z * bx / bz)
        if not math.isclose(found, wanted, rel_tol=1e-12, abs_tol=1e-15):
            given, expected = _told_apart(found, wanted)
            yield ("c",), f"has {axis} = {given}; expected {expected}, in the plane through B0C0 and B"
            return
    linkage = Linkage.of(wrist)
    if not linkage.crossed:
        yield ("c" if wrist.c else "b",), "is where the bars BB0 and CC0 do not cross"
    elif not linkage.height:
        yield ("a",), "lies on BC: the palm's three points must form a triangle"
    elif not linkage.bent:
        yield ("a",), "lies on the same side of the side bars as A0; expected on the other, so that the bars cross"


def _told_apart(found: Any, wanted: Any) -> tuple[str, str]:
    """Two lengths with as many digits as it takes to tell them apart."""
    digits_of = (f".{digits}g" for digits in range(6, 18))
    pairs = [(f"{float(found) * 1e3:{spec}} mm", f"{float(wanted) * 1e3:{spec}} mm") for spec in digits_of]
    return next((pair for pair in pairs if pair[0] != pair[1]), pairs[-1])


@dataclass(frozen=True)
class Linkage:
    """The lengths that decide whether the bars close [m]: of the bars, of B0C0 and BC, and of A from its foot on BC.

    ``share`` is where that foot is, from the middle of BC towards C. ``height`` is negative where A0 is below the side
    bars. The drawing is ``crossed`` where BB0 and CC0 are, and ``bent`` where A is on the side of AA0's assembly.
    """

    a0: Vector
    side: float
    other: float
    width: float
    palm_width: float
    share: float
    height: float
    middle: float
    crossed: bool
    bent: bool

    @classmethod
    def of(cls, wrist: Wrist) -> Linkage:
        """The linkage of the drawing."""
        a0, a, b = ((float(x), float(y), float(z)) for x, y, z in (wrist.a0, wrist.a, wrist.b))
        c0, c = wrist.far_bar
        bar, span, middle = _minus(c, c0), _minus(c, b), tuple((p + q) / 2 for p, q in zip(b, c, strict=True))
        share = _dot(_minus(a, middle), span) / _dot(span, span)
        foot = tuple(p + share * q for p, q in zip(middle, span, strict=True))
        normal = (-b[2], 0.0, b[0])  # of the side bars
        turned = (-b[0] * span[1], b[0] * span[0] + b[2] * span[2], -b[2] * span[1])  # normal x span
        (y0, z0), (ya, za) = ((_dot(_minus(end, foot), turned), _dot(_minus(end, foot), normal)) for end in (a0, a))
        sign = math.copysign(1.0, _dot(a0, normal))
        return cls(
            a0=a0,
            side=math.hypot(*b),
            other=math.hypot(*bar),
            width=c0[1],
            palm_width=math.hypot(*span),
            share=share,
            height=sign * math.dist(a, foot),
            middle=math.dist(a0, a),
            crossed=(b[0] ** 2 + b[2] ** 2) * bar[1] < (bar[0] * b[0] + bar[2] * b[2]) * (b[1] - c0[1]),
            bent=sign * (y0 * za - z0 * ya) > 0,
        )

    def obstacle(self, q71: float, q73: float) -> str:
        """Why the linkage does not have a pose; empty if it does."""
        x0, y0, z0 = self.a0
        b = (self.side * math.sin(q73), self.side * math.cos(q73))  # in the plane of the side bars
        if not b[0] > _MARGIN * self.side:
            return "the side bars have reached the line B0C0"
        away = z0 * math.cos(q71) - x0 * math.sin(q71)
        if not away * self.height > 0:
            return "the plane of the side bars has reached A0"
        # C is on circles about C0 and B, sideways from the line between them.
        x, y = b[0], b[1] - self.width
        square = x**2 + y**2
        twice = self.other**2 + square - self.palm_width**2
        room = 4 * self.other**2 * square - twice**2
        if not room > (_MARGIN * self.other) ** 2 * square:
            return "bars BB0 and CC0 do not reach BC"
        share, sideways = twice / (2 * square), math.sqrt(room) / (2 * square)
        c = (share * x + sideways * y, self.width + share * y - sideways * x)
        across = ((b[0] - c[0]) / self.palm_width, (b[1] - c[1]) / self.palm_width)
        foot = [(p + q) / 2 + self.share * (q - p) for p, q in zip(b, c, strict=True)]
        p = (x0 * math.cos(q71) + z0 * math.sin(q71) - foot[0], y0 - foot[1])
        reach = (math.hypot(*p, away) ** 2 + self.height**2 - self.middle**2) / (2 * self.height)
        distance = math.hypot(p[0] * across[1] - p[1] * across[0], away)
        return "" if abs(reach) < distance * (1 - _MARGIN) else "bar AA0 does not reach"


def _minus(p: Sequence[float], q: Sequence[float]) -> tuple[float, ...]:
    return tuple(a - b for a, b in zip(p, q, strict=True))


def _dot(p: Sequence[float], q: Sequence[float]) -> float:
    return sum(a * b for a, b in zip(p, q, strict=True))
