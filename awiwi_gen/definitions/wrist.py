"""The wrist by its definition: three bars, solved one after the other by angles (chapter 6, eq. 6.1 to 6.9).

A wrist is anything with the attributes a0[3], a[3], b[3], palm[3], width, c[3] and tendons[i].forearm[3], .palm[3],
which `hand/wrist.py` describes. Where width and c are None, the side bars are a crossed parallelogram. q71 and q73 are
the internal angles [rad]. Frame {0}: origin B0, x distal, y from B0 to C0.

The plane of the side bars contains B0C0 and is rotated about it by q71. In it, B and C move on circles about B0 and C0.
Eq. 6.1 prints one centre for both, and so does 6.2; with C0 = (0, D) all of 6.3 and 6.4 follows.
"""

from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.structure import is_symmetric

Wrist = Any


@dataclass(frozen=True)
class Palm:
    """The palm triangle (3 x 1 each, m, in {0}), the foot of A on BC, and the guards that must be positive."""

    a: Matrix
    b: Matrix
    c: Matrix
    foot: Matrix
    guards: list[Expr]

    @property
    def m(self) -> Matrix:
        """The middle of BC."""
        return (self.b + self.c) / 2


class Drawing:
    """The neutral pose: its points (3 x 1 each), |B0C0|, |BB0|, |CC0|, |BC|, and A at `height` from BC.

    ``height`` is negative if the palm is drawn with A on the other side than A0 has below the side bars.
    """

    def __init__(self, wrist: Wrist) -> None:
        self.symmetric = is_symmetric(wrist)
        self.b, self.width = Matrix(wrist.b), wrist.b[1] if wrist.width is None else wrist.width
        self.c = Matrix([wrist.b[0], 0, wrist.b[2]] if wrist.c is None else wrist.c)
        self.m = (self.b + self.c) / 2
        self.side = sympy.sqrt(self.b.dot(self.b))
        self.share, self.palm_width, self.height = sympy.S.Zero, self.width, wrist.b[2] - wrist.a[2]
        if not self.symmetric:
            across, off = self.c - self.b, Matrix(wrist.a) - self.m
            self.palm_width = sympy.sqrt(across.dot(across))
            self.share = off.dot(across) / self.palm_width**2
            away = off - self.share * across
            plane = wrist.a0[2] * wrist.b[0] - wrist.a0[0] * wrist.b[2]
            self.height = sympy.sqrt(away.dot(away)) * plane / sympy.sqrt(plane**2)
        self.foot = self.m + self.share * (self.c - self.b)


def points(wrist: Wrist, q71: Matrix, q73: Matrix) -> tuple[Any, ...]:
    """A, B, C (3 x 1 each) [m] in {0}, and the guards."""
    palm = _palm(wrist, q71[0], q73[0], Derivation("w"))
    return palm.a, palm.b, palm.c, palm.guards


def palm_pose(wrist: Wrist, q71: Matrix, q73: Matrix) -> tuple[Any, ...]:
    """Pose (4 x 4) of the palm in {0}, and the guards (fig. 6.8)."""
    derivation = Derivation("w")
    palm = _palm(wrist, q71[0], q73[0], derivation)
    return _pose(wrist, palm, derivation), palm.guards


def tendon_lengths(wrist: Wrist, q71: Matrix, q73: Matrix) -> tuple[Any, ...]:
    """Lengths (m) [m] of the tendons' runs through the wrist, and the guards (eq. 6.9)."""
    lengths, guards = _lengths(wrist, q71[0], q73[0], Derivation("w"))
    return Matrix(lengths), guards


def coupling(wrist: Wrist, q71: Matrix, q73: Matrix) -> tuple[Any, ...]:
    """Derivatives (m x 2) [m/rad] of the tendon lengths with respect to q71 and q73, and the guards."""
    derivation = Derivation("w")
    lengths, guards = _lengths(wrist, q71[0], q73[0], derivation)
    return Matrix([[derivation.partial(length, q) for q in (q71[0], q73[0])] for length in lengths]), guards


def _palm(wrist: Wrist, q71: Expr, q73: Expr, derivation: Derivation) -> Palm:
    forearm, drawn = Matrix(wrist.a0), Drawing(wrist)
    width, side = drawn.width, drawn.side
    along = Matrix([sympy.cos(q71), 0, sympy.sin(q71)])
    normal = Matrix([-sympy.sin(q71), 0, sympy.cos(q71)])
    across = Matrix([0, 1, 0])
    t_b = sympy.pi / 2 - q73
    b = derivation.name_all(side * (sympy.cos(t_b) * along + sympy.sin(t_b) * across))
    if drawn.symmetric:
        # The second root of eq. 6.3; the first is the parallelogram that is not crossed, whose palm does not rotate.
        t_c = derivation.name(sympy.atan2(
            (width**2 + side**2) * sympy.sin(t_b) - 2 * side * width, (side**2 - width**2) * sympy.cos(t_b)))  # fmt: skip
        other, closes = side, []
    else:
        # CC0 is clockwise of C0B, seen along the normal: the bars cross. The law of cosines has the angle between them.
        towards = (side * sympy.cos(t_b), side * sympy.sin(t_b) - width)
        square = derivation.name(towards[0] ** 2 + towards[1] ** 2)
        rest = drawn.c - Matrix([0, width, 0])
        other = sympy.sqrt(rest.dot(rest))
        twice = derivation.name(other**2 + square - drawn.palm_width**2)
        angle = sympy.acos(twice / (2 * other * sympy.sqrt(square)))
        t_c = derivation.name(sympy.atan2(towards[1], towards[0]) - angle)
        closes = [4 * other**2 * square - twice**2]
    c = derivation.name_all(other * sympy.cos(t_c) * along + (width + other * sympy.sin(t_c)) * across)

    # Frame {BCM}: x towards C, z along the normal. A lies on a circle about M in its y-z plane (eq. 6.5), or about another
    # foot on BC. Its radius is R_AM, where 6.5 and 6.7 print R_AA0; it is negative if the palm is drawn with A above BC.
    height = drawn.height
    axes = Matrix.hstack((c - b) / drawn.palm_width, normal.cross((c - b) / drawn.palm_width), normal)
    foot = (b + c) / 2 if drawn.symmetric else (b + c) / 2 + drawn.share * (c - b)
    x, y, z = derivation.name_all(axes.T * (forearm - foot))  # of A0 (eq. 6.6)
    middle = sum((p - q) ** 2 for p, q in zip(wrist.a, wrist.a0, strict=True))
    reach = derivation.name((x**2 + y**2 + z**2 + height**2 - middle) / (2 * height))
    distance = derivation.name(sympy.sqrt(y**2 + z**2))
    # Eq. 6.7: y cos t_a + z sin t_a = reach. The root with the plus sign has the bar AA0 crossed.
    t_a = derivation.name(sympy.atan2(z, y) + sympy.acos(reach / distance))
    circle = derivation.name_all(Matrix([0, height * sympy.cos(t_a), height * sympy.sin(t_a)]))
    a = derivation.name_all(foot + axes * circle)  # 6.8 prints the matrix of 6.6, but needs its inverse
    return Palm(a, b, c, foot, [sympy.sin(q73), 2 * height * z, 4 * (distance**2 - reach**2), *closes])


def _pose(wrist: Wrist, palm: Palm, derivation: Derivation) -> Matrix:
    """Parallel to {0} in the neutral pose, for which the hand file has the origin; y is along CB and z along AM then.

    With a palm of other bars, y and z of the drawing are along these lines turned by constant angles.
    """
    drawn = Drawing(wrist)

    def triad(b: Matrix, c: Matrix, foot: Matrix, a: Matrix) -> Matrix:
        y, z = (b - c) / drawn.palm_width, (foot - a) / drawn.height
        return Matrix.hstack(y.cross(z), y, z)

    axes = derivation.name_all(triad(palm.b, palm.c, palm.foot, palm.a))
    if not drawn.symmetric:
        axes = derivation.name_all(axes * triad(drawn.b, drawn.c, drawn.foot, Matrix(wrist.a)).T)
    origin = derivation.name_all(palm.m + axes * (Matrix(wrist.palm) - drawn.m))
    return Matrix([[axes, origin], [sympy.zeros(1, 3), sympy.ones(1, 1)]])


def _lengths(wrist: Wrist, q71: Expr, q73: Expr, derivation: Derivation) -> tuple[list[Expr], list[Expr]]:
    palm = _palm(wrist, q71, q73, derivation)
    pose = _pose(wrist, palm, derivation)
    lengths = []
    for tendon in wrist.tendons:
        run = derivation.name_all((pose * Matrix([*tendon.palm, 1]))[:3, :] - Matrix(tendon.forearm))
        lengths.append(derivation.name(sympy.sqrt(sum(x**2 for x in run))))
    return lengths, palm.guards
