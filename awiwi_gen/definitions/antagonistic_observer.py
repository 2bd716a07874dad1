"""Observer of a joint between two tendons: its state from its sensors, and one sample ahead, when the torque will act.

Three motions are observed in the same way, of the link and of both motors. A motion has a position p, a speed v, and an
acceleration a that its model does not explain. Over a sample T with the modelled acceleration s, the measurement y
corrects it:

    p- = p + T v + T^2/2 (s + a)    v- = v + T (s + a)    e = y - p-
    p+ = p- + (1 - z^3) e           v+ = v- + 3/2 (1 - z)^2 (1 + z) e / T           a+ = a + (1 - z)^3 e / T^2

All three errors vanish with the triple pole z = exp(-w T), for any plant. The unexplained acceleration comes from the
load on the link, and for the motors from friction beyond its model.

A tendon's torque is the measured one, low-pass filtered; between samples it follows the elongation by the spring's slope.
The scale of the spring relative to its model phi is estimated from the ratio of torque and phi. With pretension this
works even at rest.
"""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix, exp

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.plants import SIDES, pull, resistance, taut

MOTORS, TORQUES, SCALES = (3, 6), (9, 10), (11, 12)  # indices in the memory, after those of the link
FLOOR = 100  # a spring's scale is estimated where its elongation is above about 1/FLOOR rad


def antagonistic_observer(
    _: Any, memory: Matrix, thetas: Matrix, stretches: Matrix, measured: Matrix, acted: Matrix, acting: Matrix,
    inertias: Matrix, tendons: Matrix, damping: Matrix, friction: Matrix, bandwidths: Matrix, period: Matrix,
) -> tuple[Any, ...]:  # fmt: skip
    """The memory (13), and one sample ahead joint (2), motors (4), torques (4), springs (4), load (1) and two resistances.

    The motor torques ``acted`` are those of the sample that ended, ``acting`` those of the next. The last two outputs (2
    each) are the torques that resist the motors: by the friction model alone, and in total.
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

    def driven(i: int, motor: Expr, torque: Expr, speed: Expr) -> Expr:  # linearly implicit, as friction may be steep
        steep = friction[0] * friction[1] / (1 + (friction[0] * speed) ** 2) + friction[2]
        return names.name((motor - torque - resistance(friction, speed)) / (inertias[i + 1] + T / 2 * steep))

    last, old = [memory[i] for i in TORQUES], memory[:3, :]
    angle = ((thetas[0] - stretches[0]) - (thetas[1] - stretches[1])) / 2
    link = corrected(old, pulled(last, old[1]), angle, z[0])
    motors, torques, springs, scales = [], [], [], []
    for i, (start, side) in enumerate(zip(MOTORS, SIDES, strict=True)):
        before = memory[start : start + 3, :]
        motor = corrected(before, driven(i, acted[i], last[i], before[1]), thetas[i], z[1])
        k1, k2, k3 = spring = tendons[3 * i : 3 * i + 3, :]
        p = names.name(taut(motor[0] - side * link[0]))
        slope, force, scale = names.name(k1 + p * (2 * k2 + 3 * p * k3)), names.name(pull(spring, p)), memory[SCALES[i]]
        moved = motor[0] - before[0] - side * (link[0] - old[0])
        follows = names.name(last[i] + scale * slope * moved)
        torque = names.name(follows + (1 - z[2]) * (measured[i] - follows))
        gain = (1 - z[3]) * force / (force**2 + (k1 / FLOOR) ** 2)
        scale = names.name(scale + gain * (torque - scale * force))
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
    unmodelled = Matrix([-inertias[i + 1] * moving[2] for i, moving in enumerate(later)])
    moved_motors = Matrix([*later[0][:2], *later[1][:2]])
    outputs = known, joint[:2, :], moved_motors, Matrix(pulls), Matrix(springs), load, modelled, modelled + unmodelled
    return *outputs, [T, *inertias]


def _ahead(motion: Matrix, known: Expr, T: Expr) -> Matrix:
    """A motion (p, v, a) a sample later; ``known`` is its modelled acceleration."""
    total = known + motion[2]
    return Matrix([motion[0] + T * motion[1] + T**2 / 2 * total, motion[1] + T * total, motion[2]])
