"""The lever spring's curves: samples by the balance of moments, Neville's scheme between them."""

from collections.abc import Callable
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.hand.lever import BEYOND, CURVE_NODES, READING_NODES, chebyshev
from awiwi_gen.witnesses.interpolation import interpolate
from awiwi_gen.witnesses.spring import Pose, pose_at

Quantity = Callable[[Pose, Pose], SX]


def force(spring: Any, x: SX) -> tuple[SX, list[SX]]:
    """Tendon force [N] of the elongation x [m], counted from the slack end of the lever's travel."""
    return _curve(spring, x, _elongation, lambda pose, _: pose.force)


def stiffness(spring: Any, x: SX) -> tuple[SX, list[SX]]:
    """Tendon stiffness [N/m] at the elongation x [m]."""
    return _curve(spring, x, _elongation, lambda pose, _: pose.stiffness)


def elongation(spring: Any, f: SX) -> tuple[SX, list[SX]]:
    """Elongation [m] at which the tendon's force is f [N]."""
    return _curve(spring, f, lambda pose, _: pose.force, _elongation)


def readings(spring: Any, readings: SX) -> tuple[SX, SX, SX, list[SX]]:
    """dL [m], force [N] and stiffness [N/m] of each tendon (m) from its sensor's readings (m)."""
    (length, force, stiffness), guards = _of_readings(spring, readings, 3)
    return length, force, stiffness, guards


def tensions(spring: Any, readings: SX) -> tuple[SX, SX, list[SX]]:
    """dL [m] and force [N] of each tendon (m) from its sensor's readings (m)."""
    (length, force), guards = _of_readings(spring, readings, 2)
    return length, force, guards


def _of_readings(spring: Any, readings: SX, quantities: int) -> tuple[list[SX], list[SX]]:
    """The first of dL, force and stiffness of all tendons, and the guards."""
    shares = [SX(float(share)) for share in chebyshev(READING_NODES)]
    calibrated = spring.calibrated
    samples = {
        tendon: [_pose(each, share) for share in shares] for tendon, each in {None: spring, **calibrated}.items()
    }
    columns: list[list[SX]] = [[] for _ in range(quantities)]
    farthest = SX(0)
    for tendon, count in enumerate(ca.vertsplit(readings)):
        sensor = calibrated.get(tendon, spring).sensor
        share = (count - sensor.slack) / (sensor.taut - sensor.slack)
        poses = samples.get(tendon, samples[None])
        curves = ([pose.length for pose in poses], [pose.force for pose in poses], [pose.stiffness for pose in poses])
        for column, curve in zip(columns, curves[:quantities], strict=True):
            column.append(interpolate(shares, curve, share))
        distance = (2 * share - 1) ** 2
        farthest = (farthest + distance + ca.fabs(farthest - distance)) / 2  # the larger of the two
    return [ca.vertcat(*column) for column in columns], [float(BEYOND) - farthest]


def _curve(spring: Any, argument: SX, over: Quantity, of: Quantity) -> tuple[SX, list[SX]]:
    slack, taut = _pose(spring, SX(0)), _pose(spring, SX(1))
    poses = [_pose(spring, SX(float(share))) for share in chebyshev(CURVE_NODES)]
    nodes = [over(pose, slack) for pose in poses]
    first, last = over(slack, slack), over(taut, slack)
    normalised = (2 * argument - first - last) / (last - first)
    return interpolate(nodes, [of(pose, slack) for pose in poses], argument), [float(BEYOND) - normalised**2]


def _elongation(pose: Pose, slack: Pose) -> SX:
    return slack.length - pose.length


def _pose(spring: Any, share: SX) -> Pose:
    return pose_at(spring, spring.slack + share * (spring.taut - spring.slack))
