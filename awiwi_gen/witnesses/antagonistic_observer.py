"""The observer with matrices: three chains of integrators side by side, forces as gradients of energies."""

from __future__ import annotations

from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.plants import dry, gradients, pulling, taut

FLOOR = 100
LENGTHENED = ca.DM([[-1, 1, 0], [1, 0, 1]])  # elongations by (q, theta1, theta2)


def antagonistic_observer(
    _: Any, memory: SX, thetas: SX, stretches: SX, measured: SX, acted: SX, acting: SX,
    inertias: SX, tendons: SX, damping: SX, friction: SX, bandwidths: SX, period: SX,
) -> tuple[Any, ...]:  # fmt: skip
    """The memory (13) and the law's inputs, a sample later; guards. Matrices of motions have a column for each body."""
    bodies = (inertias, damping, friction, period)
    poles = ca.exp(-bandwidths * period)
    before, last, scales = ca.reshape(memory[:9], 3, 3), memory[9:11], memory[11:]
    seen = ca.horzcat(ca.dot(ca.SX([1, -1]), thetas - stretches) / 2, thetas.T)
    predicted = _moved(before, acted, last, *bodies)
    gains = ca.horzcat(*(_gains(poles[i], period) for i in (0, 1, 1)))
    present = predicted + gains * ca.repmat(seen - predicted[0, :], 3, 1)

    elongations, changes = LENGTHENED @ present[0, :].T, LENGTHENED @ (present - before)[0, :].T
    torques, new_scales, local = SX(2, 1), SX(2, 1), SX(2, 2)
    for i in (0, 1):
        force, slope, curvature = gradients(pulling(tendons[3 * i :]), taut(elongations[i]))
        expected = last[i] + scales[i] * slope * changes[i]
        torques[i] = poles[2] * expected + (1 - poles[2]) * measured[i]
        weight = force / (force**2 + (tendons[3 * i] / FLOOR) ** 2)
        confidence = (1 - poles[3]) * weight * force
        new_scales[i] = (1 - confidence) * scales[i] + (1 - poles[3]) * weight * torques[i]
        local[:, i] = new_scales[i] * ca.vertcat(slope, curvature)

    ahead = _moved(present, acting, torques, *bodies)
    values = torques + local[0, :].T * (LENGTHENED @ (ahead - present)[0, :].T)
    rates = local[0, :].T * (LENGTHENED @ ahead[1, :].T)
    modelled = ca.vertcat(*(_friction(friction, ahead[1, i])[0] for i in (1, 2)))
    unexplained = inertias * ahead[2, :].T
    return (
        ca.vertcat(ca.vec(present), torques, new_scales),
        ahead[:2, 0],
        ca.vec(ahead[:2, 1:]),
        ca.vec(ca.horzcat(values, rates).T),
        ca.vec(local),
        unexplained[0],
        modelled,
        modelled - unexplained[1:],
        [period, *ca.vertsplit(inertias)],
    )


def _moved(motions: SX, motors: SX, torques: SX, inertias: SX, damping: SX, friction: SX, period: SX) -> SX:
    """Motions (3, 3) a sample later: positions integrate speeds, and speeds accelerations."""
    forces = ca.vertcat(0, motors) - LENGTHENED.T @ torques
    resisting = ca.vertcat(damping * motions[1, 0], *(_friction(friction, motions[1, i])[0] for i in (1, 2)))
    steep = ca.vertcat(0, *(_friction(friction, motions[1, i])[1] for i in (1, 2)))
    known = (forces - resisting) / (inertias + period / 2 * steep)
    chain = ca.SX(ca.DM([[0, 1, 0], [0, 0, 1], [0, 0, 0]])) * period
    pushed = ca.vertcat(motions[:2, :], motions[2, :] + known.T)
    later = pushed + chain @ pushed + chain @ chain @ pushed / 2
    return ca.vertcat(later[:2, :], motions[2, :])


def _gains(pole: SX, period: SX) -> SX:
    """Observer gains (3) for which det(x - (1 - gains (1, 0, 0)) F) is (x - pole)^3."""
    position = 1 - pole * pole**2
    acceleration = position - 3 * pole * (1 - pole)
    speed = 3 * (1 - pole) - position - acceleration / 2
    return ca.vertcat(position, speed / period, acceleration / period**2)


def _friction(numbers: SX, speed: SX) -> tuple[SX, SX]:
    """Friction torque at a speed, and its slope."""
    v = ca.SX.sym("v")
    torque = ca.gradient(dry(numbers, v), v)
    values = ca.substitute([torque, ca.gradient(torque, v)], [v], [speed])
    return values[0], values[1]
