"""Where results exist, for kernels whose formulas do not ask: one expression per condition, positive where it holds."""

from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import coordinates, loose_ends, middle, wraps
from awiwi_gen.witnesses.inside_wraps import InsideWrap
from awiwi_gen.witnesses.joints import followed
from awiwi_gen.witnesses.wraps import Wrap


def loops_close(finger: Any, q: SX, *_: SX) -> list[SX]:
    """For every four-bar of a finger, the squared area of its triangle by its sides (Heron), relative to the largest."""
    place, guards = coordinates(finger), []
    for link in finger.links:
        bar = link.four_bar
        if bar is not None:
            angle = followed(finger, link.joint, q[place[link.joint]])[0]
            end = bar.crank * ca.cos(angle + bar.reference), bar.crank * ca.sin(angle + bar.reference)
            squared = (bar.ground - end[0]) ** 2 + end[1] ** 2
            longest, shortest = (bar.coupler + bar.rocker) ** 2, (bar.coupler - bar.rocker) ** 2
            guards.append((longest - squared) * (squared - shortest) / (2 * bar.coupler * bar.rocker) ** 2)
    return guards


def wraps_hold(finger: Any, q: SX, *_: SX) -> list[SX]:
    """For every body that a tendon wraps round, that points stay outside it, and the side that of the joints' middles.

    For every body that a string bends inside of, that its ends are away from the surface, or the string is straight.
    """
    guards, still = [], ca.vertcat(*middle(finger))
    for _number, run in wraps(finger):
        if run.body.inside:
            guards.append(InsideWrap.of(finger, run, q).converges())
            continue
        wrap = Wrap.of(finger, run, q)
        ends = {run.first: wrap.distances[0], run.last: wrap.distances[1]}
        guards += [(ends[index] / wrap.radius - 1) * (ends[index] / wrap.radius + 1) for index in loose_ends(run)]
        guards += [ca.sumsqr(wrap.side / wrap.radius) - 1] if run.body.carrier else []
        guards.append(wrap.same_side(Wrap.of(finger, run, still)))
    return guards


def within_travel(motor: Any, theta: SX, *_: SX) -> list[SX]:
    """Whether the motor's angle is within its travel, with a margin of 1 / 256, from both ends."""
    share = theta / (motor.travel + motor.travel / 256)
    return [(1 - share) * (1 + share)]
