"""The laws of chapter 15 without a recursion: from their closed loop, by inverse dynamics.

Eliminating all errors but one from the closed loop leaves a differential equation for that one. Solved for its highest
derivative, it gives the desired motion of the motor, and the motor's own equation gives the torque. Energies are
differentiated along the plant under that torque, automatically.
"""

from __future__ import annotations

import casadi as ca
from casadi import SX

SIDES = (1, -1)


def backstepping_academic(_: object, x: SX, k: SX) -> tuple[SX, list[SX]]:
    """Control of the example (eq. 15.10): the error of x2 has the rate -k2 z2 - x1."""
    error = _academic_error(x, k)
    drift = ca.jtimes(error, x, ca.vertcat(_academic_drift(x), 0))
    control = (-k[1] * error - x[0] - drift) / ca.jacobian(error, x)[1]
    return control, ca.vertsplit(k)


def backstepping_academic_lyapunov(part: object, x: SX, k: SX) -> tuple[SX, SX, SX]:
    """Energy and its rate (eq. 15.6), and the virtual control of x2."""
    energy = (x[0] ** 2 + _academic_error(x, k) ** 2) / 2
    rate = ca.jtimes(energy, x, ca.vertcat(_academic_drift(x), backstepping_academic(part, x, k)[0]))
    return energy, rate, x[1] - _academic_error(x, k)


def _academic_drift(x: SX) -> SX:
    return x[0] ** 2 - x[0] ** 3 + x[1]


def _academic_error(x: SX, k: SX) -> SX:
    return x[1] + x[0] * (x[0] + k[0])


def backstepping_position(_: object, motion: SX, desired: SX, plant: SX, rates: SX, scales: SX) -> tuple[SX, list[SX]]:
    """Motor torque for the fourth derivative that the characteristic polynomial of the errors asks for (eq. 15.17)."""
    m, b, k = ca.vertsplit(plant)
    highest = desired[4] - ca.dot(_error_polynomials(rates, scales)[-1][:4], motion - desired[:4])
    control = b * m / k * highest + (b + m) * motion[2]
    return control, [*ca.vertsplit(plant), *ca.vertsplit(rates), *ca.vertsplit(scales)]


def backstepping_position_lyapunov(
    part: object, motion: SX, desired: SX, plant: SX, rates: SX, scales: SX
) -> tuple[SX, SX, SX]:
    """Energy of the errors and its rate (eq. 15.46), and the virtual controls of q', q'' and q'''."""
    m, b, k = ca.vertsplit(plant)
    following = (
        k / (b * m) * (backstepping_position(part, motion, desired, plant, rates, scales)[0] - (b + m) * motion[2])
    )
    difference, weights = motion - desired[:4], ca.vertcat(1, scales)
    errors = [ca.dot(p, difference[: p.numel()]) for p in _error_polynomials(rates, scales)[:4]]
    energy = ca.dot(weights, ca.vertcat(*errors) ** 2) / 2
    rate = ca.jtimes(energy, motion, ca.vertcat(motion[1:], following)) + ca.jtimes(energy, desired, _shifted(desired))
    return energy, rate, ca.vertcat(*(motion[i] - errors[i] for i in (1, 2, 3)))


def _error_polynomials(rates: SX, scales: SX) -> list[SX]:
    """Coefficients, constant first, of the errors z1 .. z5 as polynomials of d/dt that act on q - q_d; z5 must vanish.

    z_(i+1) = z_i' + k_i z_i + (c_(i-1) / c_i) z_(i-1): the continuants of a tridiagonal matrix.
    """
    weights = ca.vertcat(1, scales)
    polynomials = [SX(1), ca.vertcat(rates[0], 1)]
    for i in (1, 2, 3):
        last, before = polynomials[-1], polynomials[-2]
        following = ca.vertcat(0, last) + rates[i] * ca.vertcat(last, 0)
        polynomials.append(following + weights[i - 1] / weights[i] * ca.vertcat(before, 0, 0))
    return polynomials


def backstepping_impedance(
    part: object, state: SX, desired: SX, external: SX, plant: SX, gains: SX, weights: SX
) -> tuple[SX, list[SX]]:
    """Motor torque of the impedance law behind a linear spring (eq. 15.62)."""
    return backstepping_nonlinear(part, state, desired, external, plant[:2], ca.vertcat(plant[2], 0), gains, weights)


def backstepping_nonlinear(
    _: object, state: SX, desired: SX, external: SX, bodies: SX, spring: SX, gains: SX, weights: SX
) -> tuple[SX, list[SX]]:
    """Motor torque of the impedance law behind any spring (eq. 15.77, mended)."""
    m, b = bodies[0], bodies[1]
    accelerated, jerk = (state[2] + external[0]) / m, (state[3] + external[1]) / m
    motion = ca.vertcat(state[:2], accelerated, jerk)
    pull, _target = _closed_loop(1, SX(1), motion, state[2:], desired, SX(0), m, gains[:2], gains[2:], weights)
    control = _motor_torque(state[2], state[3], pull, b, spring[0], spring[1], accelerated)
    return control, [*ca.vertsplit(bodies), spring[0], *ca.vertsplit(gains), *ca.vertsplit(weights)]


def backstepping_impedance_lyapunov(
    part: object, state: SX, desired: SX, external: SX, plant: SX, gains: SX, weights: SX
) -> tuple[SX, SX, SX]:
    """Energy and its rate (eq. 15.64, 15.66), and the virtual controls of tau and tau'."""
    m, b, k = ca.vertsplit(plant)
    motor = backstepping_impedance(part, state, desired, external, plant, gains, weights)[0]
    accelerated = (state[2] + external[0]) / m
    flow = ca.vertcat(state[1], accelerated, state[3], k * ((motor - state[2]) / b - accelerated))
    motion = ca.vertcat(state[:2], accelerated, (state[3] + external[1]) / m)
    _pull, target = _closed_loop(1, SX(1), motion, state[2:], desired, SX(0), m, gains[:2], gains[2:], weights)
    errors = state[2:] - target
    energy = _link_energy(state[:2], desired, m, gains[0]) + ca.dot(weights, errors**2) / 2
    rate = ca.jtimes(energy, state, flow)
    rate += ca.jtimes(energy, desired, _shifted(desired)) + ca.jtimes(energy, external, _shifted(external))
    return energy, rate, target


def backstepping_antagonistic(
    _: object, joint: SX, torques: SX, desired: SX, pretension: SX, external: SX,
    inertias: SX, springs: SX, impedance: SX, tunings: SX, neglect_other: bool = False,
) -> tuple[SX, list[SX]]:  # fmt: skip
    """Torques of both motors (eq. 15.104, mended); each alone with the link if ``neglect_other``."""
    accelerated = _link_motion(joint, torques, external, inertias[0])[2]
    motors = []
    for i, side in enumerate(SIDES):
        motion = _link_motion(joint, torques, external, inertias[0], i if neglect_other else None)
        torque, spring, tuning = _row(torques, i), _row(springs, i), _row(tunings, i)
        pull, _target = _closed_loop(
            side, SX(0.5), motion, torque, desired, pretension, inertias[0], impedance, tuning[:2], tuning[2:]
        )
        motors.append(
            _motor_torque(torque[0], torque[1], pull, inertias[i + 1], spring[0], spring[1], side * accelerated)
        )
    positive = (inertias, springs[::2], impedance, tunings)
    return ca.vertcat(*motors), [x for parameters in positive for x in ca.vertsplit(parameters)]


def backstepping_antagonistic_decoupled(
    part: object, joint: SX, torques: SX, desired: SX, pretension: SX, external: SX,
    inertias: SX, springs: SX, impedance: SX, tunings: SX,
) -> tuple[SX, list[SX]]:  # fmt: skip
    """Torques of both motors by the printed decoupling (eq. 15.84 to 15.86)."""
    return backstepping_antagonistic(
        part, joint, torques, desired, pretension, external, inertias, springs, impedance, tunings, neglect_other=True
    )


def backstepping_antagonistic_lyapunov(
    part: object, joint: SX, torques: SX, desired: SX, pretension: SX, external: SX,
    inertias: SX, springs: SX, impedance: SX, tunings: SX,
) -> tuple[SX, SX, SX]:  # fmt: skip
    """Energy of the six states and its rate, and the virtual controls of each motor's torque and its rate."""
    motors, _guards = backstepping_antagonistic(
        part, joint, torques, desired, pretension, external, inertias, springs, impedance, tunings
    )
    motion = _link_motion(joint, torques, external, inertias[0])
    energy, targets, flow = _link_energy(joint, desired, inertias[0], impedance[0]), [], []
    for i, side in enumerate(SIDES):
        torque, spring, tuning = _row(torques, i), _row(springs, i), _row(tunings, i)
        _pull, target = _closed_loop(
            side, SX(0.5), motion, torque, desired, pretension, inertias[0], impedance, tuning[:2], tuning[2:]
        )
        energy += ca.dot(tuning[2:], (torque - target) ** 2) / 2
        targets.append(target)
        stretch_dd = (motors[i] - torque[0]) / inertias[i + 1] - side * motion[2]
        flow += [torque[1], spring[1] * (torque[1] / spring[0]) ** 2 + spring[0] * stretch_dd]
    rate = ca.jtimes(energy, joint, motion[1:3]) + ca.jtimes(energy, torques, ca.vertcat(*flow))
    rate += sum(ca.jtimes(energy, signal, _shifted(signal)) for signal in (desired, pretension, external))
    return energy, rate, ca.vertcat(*targets)


def _row(pair: SX, i: int) -> SX:
    """The row of one motor of two."""
    half = pair.numel() // 2
    return pair[i * half : (i + 1) * half]


def _link_motion(joint: SX, torques: SX, external: SX, m: SX, only: int | None = None) -> SX:
    """The link's position and three derivatives under both torques, or under that of motor ``only``."""
    pull = sum((side * _row(torques, i) for i, side in enumerate(SIDES) if only in (None, i)), external)
    return ca.vertcat(joint, pull / m)


def _closed_loop(
    side: int,
    share: SX,
    motion: SX,
    torque: SX,
    desired: SX,
    pretension: SX,
    m: SX,
    impedance: SX,
    rates: SX,
    weights: SX,
) -> tuple[SX, SX]:
    """Second derivative of a spring's torque in closed loop, and the targets of that torque and of its rate.

    ``torque`` is the torque and its rate, ``motion`` the link's position and three derivatives. With the error e = q - q_d
    of the link, the error t of the torque obeys (D + K_4)(t' + K_3 t + side e' / C_t) + (C_t / C_s) t = 0.
    """
    error = motion - desired[:4]
    offset = ca.vertcat(pretension, SX(3, 1))[:3]
    target = offset + side * share * (m * desired[2:] - impedance[0] * error[:3] - impedance[1] * error[1:])
    fast, slow = rates[0], rates[1]
    t, dt = torque[0] - target[0], torque[1] - target[1]
    decay = (fast + slow) * dt + (fast * slow + weights[0] / weights[1]) * t
    pull = target[2] - decay - side * (error[2] + slow * error[1]) / weights[0]
    return pull, ca.vertcat(target[0], target[1] - fast * t - side * error[1] / weights[0])


def _motor_torque(torque: SX, rate: SX, pull: SX, b: SX, slope: SX, curvature: SX, accelerated: SX) -> SX:
    """The motor torque for a second derivative ``pull`` of its spring's torque (eq. 15.74)."""
    return torque + b * (accelerated + (pull - curvature * (rate / slope) ** 2) / slope)


def _link_energy(joint: SX, desired: SX, m: SX, stiffness: SX) -> SX:
    return (m * (joint[1] - desired[1]) ** 2 + stiffness * (joint[0] - desired[0]) ** 2) / 2


def _shifted(derivatives: SX) -> SX:
    """Each derivative is the rate of the one before it; the last one's rate is not used."""
    return ca.vertcat(derivatives[1:], 0)
