"""Designs of the compared laws: their constant inputs from the joint that is believed, a pretension [N] and gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.loops.hand_joint import Joint
from awiwi_gen.loops.joint import Plant
from awiwi_gen.simulate import Array

Values = dict[str, Any]


def rest(believed: Joint, force: float) -> Values:
    """Known elongations and stiffness of the springs at rest."""
    p, k = (of(force * believed.arm) for of in (believed.elongations, believed.slopes))
    return {"elongations": p, "slopes": k, "no_feedback": np.zeros((2, 6))}


def of_modes(link: Array, pull: Array) -> Array:
    """Feedback (2, 6) from that of the link's mode, (q, q', psi, psi'), and of the pretension's, (sigma, sigma')."""
    against = np.concatenate([link[:2] / 2, link[2:] / 4, -link[2:] / 4])
    together = np.concatenate([[0, 0], pull / 2, pull / 2])
    return np.array([against + together, together - against])


def answered(result: Any, law: str) -> Any:
    """A kernel's result. Raises InputError where the kernel fails."""
    if result.status:
        raise InputError(f"{law}: the design has no solution for these gains")
    return result


def motor_pd(_: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """A PD controller for each motor; the link hangs between the tendons' springs."""
    feedback = np.zeros((2, 6))
    for motor in (0, 1):
        feedback[motor, 2 * motor + 2 : 2 * motor + 4] = gains["kp"], gains["kd"]
    return rest(believed, force) | {"feedback": feedback}


def modes_of(believed: Joint, force: float) -> tuple[Plant, Plant]:
    """The link's mode, of both motors behind both springs; and one motor on its spring, the mode of the pretension."""
    m, b, _ = map(float, believed.inertias)
    k = float(believed.slopes(force * believed.arm).mean())
    return Plant(m, 2 * b, 2 * k, dq=believed.damping), Plant(m, b, k)


def pretension_gains(library: Any, motor: Plant, omega: float) -> Array:
    """Gains (2,) on the common motion of both motors."""
    placed = library.pole_placement_motor(b=motor.b, dtheta=0.0, k=motor.k, omega0=omega, xi0=1.0)
    gains: Array = 2 * answered(placed, "pole_placement_motor").K
    return gains


def placed(library: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """Poles of the link's mode and of the pretension's."""
    link, motor = modes_of(believed, force)
    found = library.pole_placement(**link.ports, omega=[gains["slow"], gains["fast"]], xi=[1.0, 1.0])
    pull = pretension_gains(library, motor, gains["pull"])
    return rest(believed, force) | {"feedback": of_modes(answered(found, "pole_placement").K, pull)}


def regulated(library: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """The optimum for costs of the link's error, of the motors' speed and of their torque."""
    link, motor = modes_of(believed, force)
    found = library.lqr(A=link.A, B=link.B, Q=np.diag([gains["error"] ** 2, 0, 0, gains["speed"] ** 2]), R=1.0)
    pull = pretension_gains(library, motor, gains["pull"])
    return rest(believed, force) | {"feedback": of_modes(answered(found, "lqr").K, pull)}


def scheduled(_: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """Impedance of the link over force loops of both tendons; three of the law's four joints stand still."""

    def first(value: float) -> Array:
        return np.diag([value, 1.0, 1.0, 1.0])

    return rest(believed, force) | {
        "mass": first(float(believed.inertias[0])), "coriolis": np.diag([believed.damping, 0, 0, 0]),
        "three": np.zeros(3), "four": np.zeros(4), "stiff": first(gains["K_p"]), "damp": first(gains["K_d"]),
        "omega0": gains["omega"], "xi0": gains["xi"], "force_gains": np.zeros(4), "wound": np.zeros(2),
    }  # fmt: skip


def backstepped(_: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """Gains of all backstepping laws of a pair."""
    tuning = [gains[name] for name in ("K_3", "K_4", "C_t", "C_s")]
    impedance = [gains["K_p"], gains["K_d"]]
    return rest(believed, force) | {"impedance": impedance, "tunings": [tuning] * 2, "torques_wanted": np.zeros(2)}


def state_dependent(_: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """Two optima for the springs' secants: of the link's mode, of inertia 2 b, and of either motor's pull."""
    p = believed.elongations(force * believed.arm)
    k3 = believed.tendons[:, 2].mean()
    slope = believed.slopes(force * believed.arm).mean()
    weight = gains["error"] ** 2
    return rest(believed, force) | {
        "both": 2 * believed.inertias[1], "no_drag": 0.0,
        "difference": [2 * slope, 0.0, 2 * k3],  # phi(p + d) - phi(p - d)
        "spring": believed.tendons.mean(axis=0), "R": 1.0, "K_kept": np.zeros(4), "K_pull": np.zeros(2),
        "weights": [weight, 1e-6, 1e-6, gains["speed"] ** 2], "pull_weights": [weight, gains["speed"] ** 2],
        "sum_wanted": force * believed.arm, "together_wanted": [p.mean(), 0.0],
    }  # fmt: skip


def inverse(_: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """Inverse dynamics of link and motors as one body, with gains on what the motors do, and an integral of the link's."""
    inertia = believed.inertias[1]
    return rest(believed, force) | {
        "whole": believed.inertias.sum(), "shaping": [gains["kp"], gains["kd"], gains["ki"]], "integral": 0.0,
        "holding": [-inertia * gains["kp"], -inertia * gains["kd"]],
        "together_rest": believed.elongations(force * believed.arm).mean(), "torques_wanted": np.zeros(2),
    }  # fmt: skip
