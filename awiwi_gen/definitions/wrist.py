"""The wrist by its definition: three bars, solved one after the other by angles (chapter 6, eq. 6.1 to 6.9).

A wrist is anything with the attributes a0[3], a[3], b[3], palm[3] and tendons[i].forearm[3], .palm[3], which
`hand/wrist.py` describes. q71 and q73 are the internal angles [rad]. Frame {0}: origin B0, x distal, y from B0 to C0.

The plane of the side bars contains B0C0 and is rotated about it by q71. In it, B and C move on circles about B0 and C0.
Eq. 6.1 prints one centre for both, and so does 6.2; with C0 = (0, D) all of 6.3 and 6.4 follows.
"""

from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation

Wrist = Any


@dataclass(frozen=True)
class Palm:
    """The palm triangle (3 x 1 each, m, in {0}), M in the middle of BC, and the guards that must be positive."""

    a: Matrix
    b: Matrix
    c: Matrix
    guards: list[Expr]

    @property
    def m(self) -> Matrix:
        """The middle of BC."""
        return (self.b + self.c) / 2


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
    forearm, width = Matrix(wrist.a0), wrist.b[1]
    side = sympy.sqrt(sum(x**2 for x in wrist.b))
    along = Matrix([sympy.cos(q71), 0, sympy.sin(q71)])
    normal = Matrix([-sympy.sin(q71), 0, sympy.cos(q71)])
    across = Matrix([0, 1, 0])
    t_b = sympy.pi / 2 - q73
    # The second root of eq. 6.3; the first is the parallelogram that is not crossed, whose palm does not rotate.
    t_c = derivation.name(sympy.atan2(
        (width**2 + side**2) * sympy.sin(t_b) - 2 * side * width, (side**2 - width**2) * sympy.cos(t_b)))  # fmt: skip
    b = derivation.name_all(side * (sympy.cos(t_b) * along + sympy.sin(t_b) * across))
    c = derivation.name_all(side * sympy.cos(t_c) * along + (width + side * sympy.sin(t_c)) * across)

    # Frame {BCM}: x towards C, z along the normal. A lies on a circle about M in its y-z plane (eq. 6.5). Its radius is
    # R_AM, where 6.5 and 6.7 print R_AA0; it is negative if the palm is drawn with A above BC.
    height = wrist.b[2] - wrist.a[2]
    axes = Matrix.hstack((c - b) / width, normal.cross((c - b) / width), normal)
    x, y, z = derivation.name_all(axes.T * (forearm - (b + c) / 2))  # of A0 (eq. 6.6)
    middle = sum((p - q) ** 2 for p, q in zip(wrist.a, wrist.a0, strict=True))
    reach = derivation.name((x**2 + y**2 + z**2 + height**2 - middle) / (2 * height))
    distance = derivation.name(sympy.sqrt(y**2 + z**2))
    # Eq. 6.7: y cos t_a + z sin t_a = reach. The root with the plus sign has the bar AA0 crossed.
    t_a = derivation.name(sympy.atan2(z, y) + sympy.acos(reach / distance))
    circle = derivation.name_all(Matrix([0, height * sympy.cos(t_a), height * sympy.sin(t_a)]))
    a = derivation.name_all((b + c) / 2 + axes * circle)  # 6.8 prints the matrix of 6.6, but needs its inverse
    return Palm(a, b, c, [sympy.sin(q73), 2 * height * z, 4 * (distance**2 - reach**2)])


def _pose(wrist: Wrist, palm: Palm, derivation: Derivation) -> Matrix:
    """y along CB, z along AM: parallel to {0} in the neutral pose, for which the hand file has the origin."""
    y = (palm.b - palm.c) / wrist.b[1]
    z = (palm.m - palm.a) / (wrist.b[2] - wrist.a[2])
    axes = derivation.name_all(Matrix.hstack(y.cross(z), y, z))
    drawn = Matrix(wrist.palm) - Matrix([wrist.b[0], wrist.b[1] / 2, wrist.b[2]])
    origin = derivation.name_all(palm.m + axes * drawn)
    return Matrix([[axes, origin], [sympy.zeros(1, 3), sympy.ones(1, 1)]])


def _lengths(wrist: Wrist, q71: Expr, q73: Expr, derivation: Derivation) -> tuple[list[Expr], list[Expr]]:
    palm = _palm(wrist, q71, q73, derivation)
    pose = _pose(wrist, palm, derivation)
    lengths = []
    for tendon in wrist.tendons:
        run = derivation.name_all((pose * Matrix([*tendon.palm, 1]))[:3, :] - Matrix(tendon.forearm))
        lengths.append(derivation.name(sympy.sqrt(sum(x**2 for x in run))))
    return lengths, palm.guards
