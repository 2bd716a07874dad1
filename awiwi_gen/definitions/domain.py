"""Where results exist, for kernels whose formulas do not ask: one expression per condition, positive where it holds."""

from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.inside_wraps import converges
from awiwi_gen.definitions.kinematics import frames, joint_angles
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.wraps import clearance, same_side, seen_from_body
from awiwi_gen.structure import loose_ends, middle, wraps


def loops_close(finger: Any, q: Matrix, *_: Matrix) -> list[Expr]:
    """For every four-bar of a finger, how far its diagonal is from the longest and the shortest, by the law of cosines."""
    guards = []
    for link, angle in zip(finger.links, joint_angles(finger, q).values(), strict=True):
        bar = link.four_bar
        if bar is not None:
            crank = angle + bar.reference
            squared = bar.ground**2 + bar.crank**2 - 2 * bar.ground * bar.crank * sympy.cos(crank)
            guards.append(1 - ((bar.coupler**2 + bar.rocker**2 - squared) / (2 * bar.coupler * bar.rocker)) ** 2)
    return guards


def wraps_hold(finger: Any, q: Matrix, *_: Matrix) -> list[Expr]:
    """For every body that a tendon wraps round, that points stay outside it, and the side that of the joints' middles.

    For every body that a string bends inside of, that its ends are away from the surface, or the string is straight.
    """
    derivation = Derivation()
    here, there = (frames(finger, each, derivation)[:-1] for each in (q, Matrix(middle(finger))))
    guards = []
    for _number, run in wraps(finger):
        wrap = seen_from_body(finger, run, here, derivation)
        if run.body.inside:
            guards.append(converges(wrap))
            continue
        ends = {run.first: wrap.start, run.last: wrap.end}
        guards += [clearance(wrap, ends[index]) for index in loose_ends(run)]
        guards += [clearance(wrap, wrap.side)] if run.body.carrier else []
        guards.append(same_side(wrap, seen_from_body(finger, run, there, derivation)))
    return guards


def within_travel(motor: Any, theta: Matrix, *_: Matrix) -> list[Expr]:
    """Whether the motor's angle is within its travel, with a margin of 1 / 256."""
    return [1 - (theta[0] / (motor.travel * sympy.Rational(257, 256))) ** 2]
