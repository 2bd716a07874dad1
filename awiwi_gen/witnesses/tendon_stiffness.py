"""Stiffness of whole tendons over their forces, by the balance of moments and by Neville's scheme and its derivatives."""

from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.hand.lever import BEYOND, READING_NODES, chebyshev
from awiwi_gen.witnesses import fibre
from awiwi_gen.witnesses.interpolation import interpolate
from awiwi_gen.witnesses.spring import Pose, pose_at


def tendon_stiffness(elastic: Any, tension: SX) -> tuple[SX, SX, SX, list[SX]]:
    """k [N/m], dk/df [1/m] and d2k/df2 [1/(N m)] of each tendon (m) at its force (m) [N]."""
    if elastic.limits:
        return _between(elastic.limits, tension)
    columns: list[list[SX]] = [[], [], []]
    farthest = SX(0)
    for force, spring in zip(ca.vertsplit(tension), elastic.springs, strict=True):
        slack, taut = (_pose(spring, end).force for end in (0.0, 1.0))
        poses = [_pose(spring, float(share)) for share in chebyshev(READING_NODES)]
        whole = [_whole(elastic.fibre, pose.stiffness) for pose in poses]
        k = interpolate([pose.force for pose in poses], whole, force)
        for column, value in zip(columns, (k, ca.gradient(k, force), ca.hessian(k, force)[0]), strict=True):
            column.append(value)
        distance = ((2 * force - slack - taut) / (taut - slack)) ** 2
        farthest = (farthest + distance + ca.fabs(farthest - distance)) / 2  # the larger of the two
    k, slope, curvature = (ca.vertcat(*column) for column in columns)
    return k, slope, curvature, [float(BEYOND) - farthest]


def _between(limits: Any, tension: SX) -> tuple[SX, SX, SX, list[SX]]:
    """For hands without springs: the two limits of stiffness, weighted by the distance of the force from its ends."""
    largest = limits.tendon_force
    columns: list[list[SX]] = [[], [], []]
    farthest = SX(0)
    for force in ca.vertsplit(tension):
        k = (limits.tendon_stiffness_low * (largest - force) + limits.tendon_stiffness_high * force) / largest
        for column, value in zip(columns, (k, ca.gradient(k, force), ca.hessian(k, force)[0]), strict=True):
            column.append(value)
        distance = ((force + force - largest) / largest) ** 2
        farthest = (farthest + distance + ca.fabs(farthest - distance)) / 2
    k, slope, curvature = (ca.vertcat(*column) for column in columns)
    return k, slope, curvature, [float(BEYOND) - farthest]


def _whole(strand: Any, spring: SX) -> SX:
    return fibre.stiffness(strand, spring) if strand else spring


def _pose(spring: Any, share: float) -> Pose:
    return pose_at(spring, spring.slack + share * (spring.taut - spring.slack))
