"""The wrist by algebra, without inverse trigonometric functions; couplings by automatic differentiation.

All is computed in axes that rotate with q71: e1 in the plane of the side bars, e2 along B0C0, e3 normal to both. There
C is a rational function of B, and A follows from the foot of A0 in the plane that bisects BC.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import is_symmetric

Wrist = Any


@dataclass(frozen=True)
class Palm:
    """The palm in the rotating axes: points a, b, c, m and unit vectors x, y, z of the palm frame (3 each).

    `axes` takes the rotating axes to those of {0}. The `guards` must be positive for the palm to exist.
    """

    a: SX
    b: SX
    c: SX
    x: SX
    y: SX
    z: SX
    axes: SX
    guards: list[SX]

    @property
    def m(self) -> SX:
        """The middle of BC."""
        return (self.b + self.c) / 2


def points(wrist: Wrist, q71: SX, q73: SX) -> tuple[Any, ...]:
    """A, B, C (3 each) [m] in {0}, and the guards."""
    palm = _palm(wrist, q71, q73)
    return palm.axes @ palm.a, palm.axes @ palm.b, palm.axes @ palm.c, palm.guards


def palm_pose(wrist: Wrist, q71: SX, q73: SX) -> tuple[Any, ...]:
    """Pose (4 x 4) of the palm in {0}, and the guards."""
    palm = _palm(wrist, q71, q73)
    pose = ca.horzcat(palm.axes @ palm.x, palm.axes @ palm.y, palm.axes @ palm.z, palm.axes @ _origin(wrist, palm))
    return ca.vertcat(pose, SX([[0, 0, 0, 1]])), palm.guards


def tendon_lengths(wrist: Wrist, q71: SX, q73: SX) -> tuple[Any, ...]:
    """Lengths (m) [m] of the tendons' runs through the wrist, and the guards (eq. 6.9)."""
    return _lengths(wrist, q71, q73)


def coupling(wrist: Wrist, q71: SX, q73: SX) -> tuple[Any, ...]:
    """Derivatives (m x 2) [m/rad] of the tendon lengths with respect to q71 and q73, and the guards."""
    lengths, guards = _lengths(wrist, q71, q73)
    return ca.densify(ca.jacobian(lengths, ca.vertcat(q71, q73))), guards


def _palm(wrist: Wrist, q71: SX, q73: SX) -> Palm:
    drawn = _Drawing(wrist)
    width, height = drawn.width, drawn.height
    side_squared = wrist.b[0] ** 2 + wrist.b[1] ** 2 + wrist.b[2] ** 2
    side = ca.sqrt(side_squared)
    c71, s71 = ca.cos(q71), ca.sin(q71)
    axes = ca.vertcat(ca.horzcat(c71, 0, -s71), ca.horzcat(0, 1, 0), ca.horzcat(s71, 0, c71))

    b = (side * ca.sin(q73), side * ca.cos(q73))
    if is_symmetric(wrist):
        # In a crossed parallelogram the diagonals B0C and C0B are parallel, and their product is R^2 - D^2 (eq. 6.4).
        product = side_squared - width**2
        stretch = 1 / ((side_squared + width**2) / product - 2 * width * side / product * ca.cos(q73))
        c, closes = (stretch * b[0], stretch * (b[1] - width)), []
        foot = (b[0] + c[0], b[1] + c[1])  # twice, as all that follows
    else:
        # C is on circles about C0 and B: `share` of the way from C0 to B, and sideways from there, where the bars cross.
        x, y = b[0], b[1] - width
        square, other = x**2 + y**2, drawn.c[0] ** 2 + (drawn.c[1] - width) ** 2 + drawn.c[2] ** 2
        twice = other + square - drawn.palm_width**2
        closes = [4 * other * square - twice**2]
        share, sideways = twice / (2 * square), ca.sqrt(closes[0]) / (2 * square)
        c = (share * x + sideways * y, width + share * y - sideways * x)
        foot = tuple((1 - 2 * drawn.share) * p + (1 + 2 * drawn.share) * q for p, q in zip(b, c, strict=True))
    y = ((b[0] - c[0]) / drawn.palm_width, (b[1] - c[1]) / drawn.palm_width)

    # Eq. 6.7, doubled as 2 M is B + C. From M, the foot of A0 in the plane that bisects BC lies at `off` along
    # (y[1], -y[0], 0) and at `away` along e3. A lies at `reach` towards the foot and at `across` normal to that.
    away = c71 * (2 * wrist.a0[2]) - s71 * (2 * wrist.a0[0])
    run = (c71 * (2 * wrist.a0[0]) + s71 * (2 * wrist.a0[2]) - foot[0], 2 * wrist.a0[1] - foot[1])
    off = run[0] * y[1] - run[1] * y[0]
    middle = sum((p - q) ** 2 for p, q in zip(wrist.a, wrist.a0, strict=True))
    reach = (run[0] ** 2 + run[1] ** 2 + away**2 + 4 * (height**2 - middle)) / (4 * height)
    distance_squared = off**2 + away**2
    across_squared = distance_squared - reach**2
    across = ca.sqrt(across_squared)
    # z, from A to M, makes the same angle with the line from the foot to M.
    tilt = (across * away - reach * off) / distance_squared
    rise = -(across * off + reach * away) / distance_squared
    own = (
        ca.vertcat(rise * y[1], -rise * y[0], -tilt),
        ca.vertcat(*y, 0),
        ca.vertcat(tilt * y[1], -tilt * y[0], rise),
    )
    z = own[2]
    if not is_symmetric(wrist):
        own = tuple(ca.horzcat(*own) @ row.T for row in ca.vertsplit(drawn.triad))
    return Palm(
        a=ca.vertcat(*foot, 0) / 2 - height * z,
        b=ca.vertcat(*b, 0),
        c=ca.vertcat(*c, 0),
        x=own[0],
        y=own[1],
        z=own[2],
        axes=axes,
        guards=[ca.sin(q73), height * away, across_squared, *closes],
    )


class _Drawing:
    """The neutral pose: C, |B0C0| and |BC|; the foot of A on BC, by its `share` of BC from the middle, and A's distance.

    The columns of ``triad`` are what the axes of a palm drawn along its bars would be.
    """

    def __init__(self, wrist: Wrist) -> None:
        self.width = self.palm_width = wrist.b[1] if wrist.width is None else wrist.width
        self.c = (wrist.b[0], SX(0), wrist.b[2]) if wrist.c is None else wrist.c
        self.height = wrist.b[2] - wrist.a[2]
        self.share, self.triad = SX(0), SX.eye(3)
        self.middle = (ca.vertcat(*wrist.b) + ca.vertcat(*self.c)) / 2
        if is_symmetric(wrist):
            return
        a, b, c = ca.vertcat(*wrist.a), ca.vertcat(*wrist.b), ca.vertcat(*self.c)
        self.palm_width = ca.sqrt(ca.dot(c - b, c - b))
        self.share = ca.dot(a - self.middle, c - b) / ca.dot(c - b, c - b)
        up = self.middle + self.share * (c - b) - a
        side = wrist.a0[2] * wrist.b[0] - wrist.a0[0] * wrist.b[2]
        self.height = ca.sqrt(ca.dot(up, up)) * side / ca.sqrt(side**2)  # which side A0 is on
        y, z = (b - c) / self.palm_width, up / self.height
        self.triad = ca.horzcat(ca.cross(y, z), y, z)


def _origin(wrist: Wrist, palm: Palm) -> SX:
    """The palm frame's origin in the rotating axes; the palm frame is parallel to {0} in the neutral pose."""
    drawn = [wrist.palm[0] - wrist.b[0], wrist.palm[1] - wrist.b[1] / 2, wrist.palm[2] - wrist.b[2]]
    if not is_symmetric(wrist):
        drawn = ca.vertsplit(ca.vertcat(*wrist.palm) - _Drawing(wrist).middle)
    origin: SX = palm.m + drawn[0] * palm.x + drawn[1] * palm.y + drawn[2] * palm.z
    return origin


def _lengths(wrist: Wrist, q71: SX, q73: SX) -> tuple[SX, list[SX]]:
    """Each square is expanded about the feet of the tendon's points in the plane y = 0 of either frame.

    Tendons that share pulley axles, as all of one layer do, share these feet. The rest of each is a constant and three
    products with its positions along the two axles.
    """
    palm = _palm(wrist, q71, q73)
    origin, back = _origin(wrist, palm), palm.axes.T
    lengths = []
    for tendon in wrist.tendons:
        (x, y, z), (palm_x, palm_y, palm_z) = tendon.forearm, tendon.palm
        feet = origin + palm_x * palm.x + palm_z * palm.z - back @ ca.vertcat(x, 0, z)
        common = ca.dot(feet, feet)
        sideways = palm_y * (2 * ca.dot(feet, palm.y)) - y * (2 * feet[1])
        along = y * palm_y * (2 * palm.y[1])
        lengths.append(ca.sqrt(common + (y**2 + palm_y**2) + sideways - along))
    return ca.vertcat(*lengths), palm.guards
