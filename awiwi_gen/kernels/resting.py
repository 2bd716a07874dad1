"""The solver of joint angles where springs give the equations that tendon lengths do not, and either bends with the pose.

Without contact, gravity and friction, a finger rests where its springs hold the least energy that lengths and stops allow.
Tendon forces f are unknowns beside the angles: torques of springs and tendons balance at all joints that are not at a stop.
"""

from __future__ import annotations

import math

from awiwi_gen.hand.parts import Finger
from awiwi_gen.kernel import Solver
from awiwi_gen.kernels.estimates import NEAR, SLIDE_UNIT, joint_limits, limit_paths
from awiwi_gen.structure import determined, resting

LENGTH = 2.0**-7  # m, the solver's unit of lengths: near the arms that tendons have at hinges
STEPS = 24  # evaluations of the balance between two changes of stops
STOP = {"f64": "1e-12", "f32": "1e-6"}


def rounds(joints: int) -> int:
    """Changes of stops at most: each of the resting joints comes to one and leaves it, and once more."""
    return 2 * joints + 2


def energy_unit(finger: Finger) -> float:
    """The solver's unit of energy [J]: a power of two near what the stiffest spring of the finger holds at 1 rad."""
    joints = [float(k.spring.stiffness) * (LENGTH**2 if k.slides else 1.0) for k in finger.links if k.spring]
    strings = [float(each.spring.stiffness) * LENGTH**2 for each in finger.strings if each.spring]
    return float(2.0 ** round(math.log2(max(*joints, *strings, 1e-9, 1e-9))))


def resting_estimate(finger: Finger) -> Solver:
    """The solver of a finger with resting joints."""
    low, high = joint_limits(finger)
    joints, tendons = resting(finger)
    known, lengths = determined(finger)
    size = len(low) + len(finger.transmissions)
    calls = 2 + (STEPS - 1) * bool(known) + rounds(len(joints)) * (STEPS + 1)
    scale = [SLIDE_UNIT if joint in finger.sliding else "1" for joint in finger.joints]

    def listed(name: str, numbers: list[int]) -> str:
        return f"    static const int {name}[] = {{{', '.join(map(str, numbers))}}};" if numbers else ""

    return Solver(
        template="resting_estimate.c.j2",
        problem="resting",
        uses=("tendon_lengths", "coupling", "resting_balance"),
        equations=tuple(range(size)),
        unknowns=tuple(range(size)),
        arrays={"low": low, "high": high},
        strings={
            "joints": str(len(low)),
            "tendons": str(len(finger.transmissions)),
            "scale": ", ".join(scale),
            "energy": f"(awiwi_real){energy_unit(finger)!r}",
            "lists": "\n".join(filter(None, (
                listed("resting", joints), listed("pulling", tendons), listed("known", known), listed("lengths", lengths),
                listed("sensed", list(finger.measured)),
            ))),
            "resting_count": str(len(joints)),
            "pulling_count": str(len(tendons)),
            "known_count": str(len(known)),
            "lengths_count": str(len(lengths)),
            "measured_count": str(len(finger.measured)),
            "iterations": str(STEPS),
            "rounds": str(rounds(len(joints))),
        },
        iterations=calls,
        tolerance={"f64": 1e-12, "f32": 1e-5},
        limits=limit_paths(finger),
        stop=STOP,
        near=tuple(NEAR["slide" if joint in finger.sliding else "hinge"] for joint in finger.joints),
        held=finger.measured,
        resting=(tuple(joints), tuple(tendons)),
    )  # fmt: skip
