"""The lever spring's curves: force and stiffness over the elongation or over the sensor's reading.

Elongation and force are both closed forms of the lever angle, but the angle cannot be eliminated in closed form. So the
mechanism is evaluated at Chebyshev points of its travel, and polynomials through these samples replace it, as the
calibration polynomials of section 4.1 do. The samples are formulas of the hand's numbers; the coefficients become
constants when the numbers are bound. A polynomial's argument is -1 at the slack end and 1 at the taut end; guards refuse
arguments far beyond.
"""

from collections.abc import Callable
from typing import Any

from sympy import Abs, Expr, Matrix, Rational

from awiwi_gen.definitions.interpolation import coefficients, horner
from awiwi_gen.definitions.naming import Derivation, Named
from awiwi_gen.definitions.spring import Pose, pose_at
from awiwi_gen.hand.lever import BEYOND, CURVE_NODES, READING_NODES, chebyshev

Quantity = Callable[[Pose, Pose], Expr]
"""A function of a pose and of the pose at the slack end."""


def force(spring: Any, x: Matrix) -> tuple[Expr, list[Expr]]:
    """Tendon force [N] of the elongation x [m], counted from the slack end of the lever's travel."""
    return _curve(spring, x[0], _elongation, lambda pose, _: pose.force)


def stiffness(spring: Any, x: Matrix) -> tuple[Expr, list[Expr]]:
    """Tendon stiffness [N/m] at the elongation x [m]."""
    return _curve(spring, x[0], _elongation, lambda pose, _: pose.stiffness)


def elongation(spring: Any, f: Matrix) -> tuple[Expr, list[Expr]]:
    """Elongation [m] at which the tendon's force is f [N]."""
    return _curve(spring, f[0], lambda pose, _: pose.force, _elongation)


def readings(spring: Any, readings: Matrix) -> tuple[Matrix, Matrix, Matrix, list[Expr]]:
    """dL [m], force [N] and stiffness [N/m] of each tendon (m) from its sensor's readings (m), linear in the angle."""
    table, guards = _of_readings(spring, readings, 3)
    return table[:, 0], table[:, 1], table[:, 2], guards


def tensions(spring: Any, readings: Matrix) -> tuple[Matrix, Matrix, list[Expr]]:
    """dL [m] and force [N] of each tendon (m) from its sensor's readings (m), linear in the angle."""
    table, guards = _of_readings(spring, readings, 2)
    return table[:, 0], table[:, 1], guards


def _of_readings(spring: Any, readings: Matrix, quantities: int) -> tuple[Matrix, list[Expr]]:
    """The first of dL, force and stiffness of each tendon, in columns, and the guards."""
    derivation = Derivation("c")
    calibrated = spring.calibrated
    powers = {tendon: _powers_of_readings(each, derivation) for tendon, each in {None: spring, **calibrated}.items()}
    rows, farthest = [], Rational(0)
    for tendon, count in enumerate(readings):
        sensor = calibrated.get(tendon, spring).sensor
        x = _normalised(count, sensor.slack, sensor.taut, derivation)
        rows.append([horner(each, x, derivation) for each in powers.get(tendon, powers[None])[:quantities]])
        farthest = derivation.name((farthest + x**2 + Abs(farthest - x**2)) / 2)  # the larger of the two
    return Matrix(rows), [BEYOND - farthest]


def _powers_of_readings(spring: Any, derivation: Derivation) -> list[list[Expr]]:
    """Coefficients of dL, force and stiffness over the sensor's reading."""
    shares = chebyshev(READING_NODES)
    poses = [_pose(spring, share, derivation) for share in shares]
    curves = zip(*((pose.length, pose.force, pose.stiffness) for pose in poses), strict=True)
    return [coefficients([Rational(2 * share - 1) for share in shares], curve, derivation) for curve in curves]


def _curve(spring: Any, argument: Expr, over: Quantity, of: Quantity) -> tuple[Expr, list[Expr]]:
    derivation = Derivation("e")
    slack, taut = (_pose(spring, Rational(end), derivation) for end in (0, 1))

    def normalised(value: Expr) -> Expr:
        return _normalised(value, over(slack, slack), over(taut, slack), derivation)

    poses = [_pose(spring, share, derivation) for share in chebyshev(CURVE_NODES)]
    powers = coefficients(
        [normalised(over(pose, slack)) for pose in poses], [of(pose, slack) for pose in poses], derivation
    )
    return horner(powers, normalised(argument), derivation), [BEYOND - normalised(argument) ** 2]


def _elongation(pose: Pose, slack: Pose) -> Expr:
    return slack.length - pose.length


def _pose(spring: Any, share: Any, derivation: Derivation) -> Pose:
    """The mechanism at a share of its travel, 0 at the slack end, 1 at the taut one."""
    angle = Named(f"angle{share}", spring.slack + Rational(share) * (spring.taut - spring.slack))
    return pose_at(spring, angle, derivation)


def _normalised(value: Expr, slack: Expr, taut: Expr, derivation: Derivation) -> Expr:
    """A value scaled linearly to -1 at the slack end and 1 at the taut end."""
    return derivation.name((2 * value - slack - taut) / (taut - slack))
