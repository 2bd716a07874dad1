"""A joint between two motors with nonlinear springs, under a compiled law on the hand's clock.

Torques are computed from one sample and act from the next on (3 kHz, 333 us); in between they are held, and the plant
is integrated with steps of its own. The springs pull ever harder, as tendons on levers do: their torque is an
exponential of the elongation, so that the pretension decides the stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.loops.joint import Array
from awiwi_gen.loops.pair import SIDES, Pair
from awiwi_gen.loops.sampled import PERIOD

SUBSTEPS = 4  # of the integration in each sample
FLOOR = 0.1  # N m: the exponential's torque less this one is the spring's


@dataclass(frozen=True)
class Setting:
    """A pair of motors, the pretension [N m] at which its springs have the pair's stiffness, and gains."""

    pair: Pair
    pretension: float
    impedance: Array
    tuning: Array

    def springs(self, elongation: Array) -> tuple[Array, Array]:
        """Torques (..., 2) [N m], and (slope, curvature) of each spring (..., 2, 2), at elongations (..., 2) [rad]."""
        length = (self.pretension + FLOOR) / np.array(self.pair.k)
        pull = FLOOR * np.exp(np.clip(elongation / length, -50, 50))
        return pull - FLOOR, np.stack([pull / length, pull / length**2], axis=-1)

    def at_rest(self) -> Array:
        """The state (q, q', theta1, theta2, theta1', theta2') under the pretension alone."""
        length = (self.pretension + FLOOR) / np.array(self.pair.k)
        theta = length * np.log((self.pretension + FLOOR) / FLOOR)
        return np.array([0, 0, *theta, 0, 0])


@dataclass(frozen=True)
class Run:
    """What happened, sample by sample: position (samples, ...), both springs' torques, energy and its rate."""

    times: Array
    q: Array
    torques: Array
    V: Array
    Vdot: Array


def simulate(library: Any, setting: Setting, until: float, desired: Callable[[float], Any]) -> Run:
    """Run the exact law from rest; ``desired`` gives q_d and four derivatives (..., 5), for any number of cases."""
    m, b = setting.pair.m, np.array(setting.pair.b)
    h, times = PERIOD / SUBSTEPS, np.arange(0, until, PERIOD)
    cases = np.shape(desired(0.0))[:-1]

    def flow(x: Array, motors: Array) -> Array:
        torque, _ = setting.springs(x[..., 2:4] - SIDES * x[..., :1])
        link = (torque @ SIDES / m)[..., None]
        return np.concatenate([x[..., 1:2], link, x[..., 4:], (motors - torque) / b], axis=-1)

    x = np.broadcast_to(setting.at_rest(), (*cases, 6))
    motors = np.full((*cases, 2), setting.pretension)
    seen = []
    for t in times:
        torque, springs = setting.springs(x[..., 2:4] - SIDES * x[..., :1])
        given = {
            "joint": x[..., :2],
            "torques": np.stack([torque, springs[..., 0] * (x[..., 4:] - SIDES * x[..., 1:2])], axis=-1),
            "desired": desired(float(t)),
            "pretension": (setting.pretension, 0.0, 0.0),
            "external": (0.0, 0.0),
            "inertias": (m, *b),
            "springs": springs,
            "impedance": setting.impedance,
            "tunings": np.broadcast_to(setting.tuning, (2, 4)),
        }
        watched = library.backstepping_antagonistic_lyapunov(**given)
        seen.append((x[..., 0], torque, watched.V, watched.Vdot))
        for _ in range(SUBSTEPS):
            k1 = flow(x, motors)
            k2 = flow(x + h / 2 * k1, motors)
            k3 = flow(x + h / 2 * k2, motors)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + flow(x + h * k3, motors))
        motors = library.backstepping_antagonistic(**given).tau_m
    return Run(times, *(np.array(column) for column in zip(*seen, strict=True)))
