"""What a joint between two tendons does, from its sensors; and a sample ahead, when the torque found now will act.

Three motions are observed, of the link and of either motor, by one rule. A motion has a position p, a speed v, and an
acceleration a that its model does not explain. Over a sample T, in which the model knows of s, a measurement y corrects

    p- = p + T v + T^2/2 (s + a)    v- = v + T (s + a)    e = y - p-
    p+ = p- + (1 - z^3) e           v+ = v- + 3/2 (1 - z)^2 (1 + z) e / T           a+ = a + (1 - z)^3 e / T^2

so that all three errors die out with the triple pole z = exp(-w T), whatever the plant is. What is not explained is the
load on the link, and of the motors whatever friction does beyond its model.

A tendon's torque is the measured one, smoothed: in between it follows the elongation by the spring's slope. How stiff
the spring is, compared to its model phi, is learnt from the torque's ratio to phi; pretension shows it even at rest.
"""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix, exp

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.plants import SIDES, pull, resistance, taut

MOTORS, TORQUES, SCALES = (3, 6), (9, 10), (11, 12)  # where they are in the memory, behind the link
FLOOR = 100  # a spring is learnt from where its elongation is above 1/FLOOR rad or so


def antagonistic_observer(
    _: Any, memory: Matrix, thetas: Matrix, stretches: Matrix, measured: Matrix, acted: Matrix, acting: Matrix,
    inertias: Matrix, tendons: Matrix, damping: Matrix, friction: Matrix, bandwidths: Matrix, period: Matrix,
) -> tuple[Any, ...]:  # fmt: skip
    """The memory (13); ahead: joint (2), motors (4), torques (4), springs (4), load (1), modelled and resistance (2).

    The torques ``acted`` moved the motors in the sample that ended, ``acting`` will in the next. The last two outputs
    are torques that the motors must overcome: by the model of friction, and in all.
    """
    names, T = Derivation(), period[0]
    z = [names.name(exp(-w * T)) for w in bandwidths]

    def corrected(motion: Matrix, known: Expr, seen: Expr, pole: Expr) -> Matrix:
        ahead = _ahead(motion, known, T)
        error = names.name(seen - ahead[0])
        gains = (1 - pole**3, (1 - pole) ** 2 * (1 + pole) * 3 / (2 * T), (1 - pole) ** 3 / T**2)
        return names.name_all(ahead + Matrix(gains) * error)

    def pulled(torques: list[Expr], speed: Expr) -> Expr:
        return names.name((torques[0] - torques[1] - damping[0] * speed) / inertias[0])

    def driven(i: int, motor: Expr, torque: Expr, speed: Expr) -> Expr:  # linearly implicit: friction may be steep
        steep = friction[0] * friction[1] / (1 + (friction[0] * speed) ** 2) + friction[2]
        return names.name((motor - torque - resistance(friction, speed)) / (inertias[i + 1] + T / 2 * steep))

    felt, old = [memory[i] for i in TORQUES], memory[:3, :]
    place = ((thetas[0] - stretches[0]) - (thetas[1] - stretches[1])) / 2
    link = corrected(old, pulled(felt, old[1]), place, z[0])
    motors, torques, springs, scales = [], [], [], []
    for i, (start, side) in enumerate(zip(MOTORS, SIDES, strict=True)):
        before = memory[start : start + 3, :]
        motor = corrected(before, driven(i, acted[i], felt[i], before[1]), thetas[i], z[1])
        k1, k2, k3 = spring = tendons[3 * i : 3 * i + 3, :]
        p = names.name(taut(motor[0] - side * link[0]))
        slope, force, scale = names.name(k1 + p * (2 * k2 + 3 * p * k3)), names.name(pull(spring, p)), memory[SCALES[i]]
        moved = motor[0] - before[0] - side * (link[0] - old[0])
        follows = names.name(felt[i] + scale * slope * moved)
        torque = names.name(follows + (1 - z[2]) * (measured[i] - follows))
        learnt = (1 - z[3]) * force / (force**2 + (k1 / FLOOR) ** 2)
        scale = names.name(scale + learnt * (torque - scale * force))
        motors.append(motor)
        torques.append(torque)
        scales.append(scale)
        springs += [names.name(scale * slope), scale * (2 * k2 + 6 * p * k3)]
    joint = names.name_all(_ahead(link, pulled(torques, link[1]), T))
    later, pulls = [], []
    for i, side in enumerate(SIDES):
        moving = names.name_all(_ahead(motors[i], driven(i, acting[i], torques[i], motors[i][1]), T))
        change = moving[0] - motors[i][0] - side * (joint[0] - link[0])
        later.append(moving)
        pulls += [torques[i] + springs[2 * i] * change, springs[2 * i] * (moving[1] - side * joint[1])]
    known = Matrix([*link, *motors[0], *motors[1], *torques, *scales])
    load = inertias[0] * link[2]
    modelled = Matrix([resistance(friction, moving[1]) for moving in later])
    besides = Matrix([-inertias[i + 1] * moving[2] for i, moving in enumerate(later)])
    turning = Matrix([*later[0][:2], *later[1][:2]])
    return known, joint[:2, :], turning, Matrix(pulls), Matrix(springs), load, modelled, modelled + besides


def _ahead(motion: Matrix, known: Expr, T: Expr) -> Matrix:
    """A motion (p, v, a) a sample later, with the acceleration that is known besides."""
    total = known + motion[2]
    return Matrix([motion[0] + T * motion[1] + T**2 / 2 * total, motion[1] + T * total, motion[2]])
