"""One joint between two tendons with their motors, run by compiled laws on the hand's clock (chapters 9 and 11).

The joint turns pulleys of radius R, so the tendons pull at it with the torques -R f1 and R f2; the motors wind them up
on pulleys of radius r. Torques follow from what was measured a tick earlier and are held for one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.kernels.fingers_control import antagonists, groups, senses

Array = np.ndarray[Any, Any]

PERIOD, SUBSTEPS = 1 / 3000, 6
PULL = np.array([-1.0, 1.0])  # the torques of the tendons on the joint, over R f


@dataclass(frozen=True)
class Spring:
    """A tendon's force f [N] over its elongation x [m], with the stiffness k [N/m] at each; it only pulls."""

    x: Array
    f: Array
    k: Array

    @classmethod
    def of(cls, library: Any, finger: str, rows: int = 400) -> Spring:
        """A finger's first tendon, over the forces that its kernel is documented for."""
        kernel = library[f"{finger}_tendon_stiffness"]
        port = kernel.inputs[0]
        f = np.linspace(max(port["low"][0], 1e-3), port["high"][0], rows)
        k = kernel(np.repeat(f[:, None], port["shape"][0], axis=1)).k[:, 0]
        grown = np.diff(f) * (1 / k[1:] + 1 / k[:-1]) / 2  # by trapezia
        return cls(f[0] / k[0] + np.concatenate([[0.0], np.cumsum(grown)]), f, k)

    def force(self, x: Array) -> Array:
        """Linear below the curve, down to slack, and above it [N]."""
        below, above = self.f[0] * np.maximum(x, 0) / self.x[0], self.f[-1] + self.k[-1] * (x - self.x[-1])
        return np.where(x < self.x[0], below, np.where(x > self.x[-1], above, np.interp(x, self.x, self.f)))

    def elongation(self, f: Array) -> Array:
        """Where the force is f [m]."""
        found: Array = np.interp(f, self.f, self.x)
        return found

    def stiffness(self, f: Array) -> Array:
        """Where the force is f [N/m]."""
        found: Array = np.interp(f, self.f, self.k)
        return found


@dataclass(frozen=True)
class Gains:
    """Of the joint: K [N m/rad] and D [N m s/rad]; of the motors: kp, kd; and what the motors feed forward.

    Each a number, or one for each run.
    """

    K: Any
    D: Any
    kp: float = 10.0
    kd: float = 0.2
    feed_forward: Any = 1.0  # share of the desired force
    compensation: Any = 0.0  # share of the motors' friction


@dataclass(frozen=True)
class Joint:
    """Inertias of link and motor [kg m^2], radii of joint and motor [m], damping of the link, the motors' friction."""

    library: Any
    spring: Spring
    inertia: float
    motor: float
    R: float
    r: float
    friction: tuple[float, float, float]  # steepness, level, viscosity
    limit: float  # of the motors' torque [N m]
    damping: float = 1e-3

    @classmethod
    def of(cls, library: Any, hand: Hand) -> Joint | None:
        """The joint of the hand that one pair of tendons has for itself, with the largest pulley if there are several."""
        found = []
        for name, finger in hand.fingers.items():
            for group in groups(finger):
                turned = senses(finger, finger.tendons[group[0]])
                if len(group) == 2 and antagonists(finger, group) and len(turned) == 1:
                    (joint,) = turned
                    found.append((float(finger.radii[joint]), name, finger.joints.index(joint)))
        if not found or hand.motor is None:
            return None
        radius, name, index = max(found)
        inertia = library[f"{name}_mass_matrix"](np.zeros(len(hand.fingers[name].joints)))[index, index]
        motor, rub = hand.motor, hand.motor.friction
        return cls(
            library, Spring.of(library, name), float(inertia),
            float(motor.gear_inertia) + float(motor.rotor_inertia) * float(motor.gear_ratio) ** 2,
            radius, float(motor.pulley), (float(rub.steepness), float(rub.level), float(rub.viscosity)),
            float(motor.torque),
        )  # fmt: skip

    def stiffness(self, f: Array) -> Any:
        """Stiffness of the joint by its tendons of forces f (..., 2) [N m/rad]."""
        return self.R**2 * self.spring.stiffness(f).sum(axis=-1)

    def rub(self, thd: Array) -> Array:
        """Friction torques of the motors."""
        steepness, level, viscosity = self.friction
        found: Array = level * np.arctan(steepness * thd) + viscosity * thd
        return found

    def forces(self, x: Array) -> Array:
        """Tendon forces (..., 2) in states (..., 6)."""
        return self.spring.force(self.r * x[..., 2:4] - PULL * self.R * x[..., :1])

    def at_rest(self, pretension: Array) -> Array:
        """States (runs, 6), each (q, q', theta1, theta2, theta1', theta2'), at q = 0."""
        states = np.zeros((len(pretension), 6))
        states[:, 2:4] = self.spring.elongation(pretension)[:, None] / self.r
        return states

    def rates(self, x: Array, tau: Array) -> Array:
        """Of states (runs, 6) under motor torques (runs, 2)."""
        f = self.forces(x)
        link = (self.R * f @ PULL - self.damping * x[:, 1]) / self.inertia
        motors = (tau - self.rub(x[:, 4:]) - self.r * f) / self.motor
        return np.concatenate([x[:, 1:2], link[:, None], x[:, 4:], motors], axis=1)

    def law(self, x: Array, q_des: Array, pretension: Array, gains: Gains) -> Array:
        """Motor torques (runs, 2) of the two time scales: the joint's impedance shared by the pair, the compiled law."""
        tau = gains.K * (q_des - x[:, 0]) - gains.D * x[:, 1]
        wanted = pretension[:, None] + PULL * tau[:, None] / (2 * self.R)
        f_des = np.clip(wanted, self.spring.f[0], self.spring.f[-1])
        theta_des = (self.spring.elongation(f_des) + PULL * self.R * x[:, :1]) / self.r
        fed, rubbed = np.reshape(gains.feed_forward, (-1, 1)), np.reshape(gains.compensation, (-1, 1))
        found: Array = self.library.motor_impedance(
            x[:, 2:4], x[:, 4:], theta_des, f_des * fed, rubbed * self.rub(x[:, 4:]), self.r, gains.kp, gains.kd
        ).tau
        return np.clip(found, -self.limit, self.limit)

    def run(self, q_des: Array, pretension: Array, gains: Gains) -> Array:
        """States (ticks, runs, 6) for desired angles and pretensions (ticks, runs), from rest at the first pretension."""
        x, found = self.at_rest(pretension[0]), []
        held = self.law(x, q_des[0], pretension[0], gains)
        step = PERIOD / SUBSTEPS
        for angle, pull in zip(q_des, pretension, strict=True):
            found.append(x)
            tau, held = held, self.law(x, angle, pull, gains)
            for _ in range(SUBSTEPS):
                x = x + step * self.rates(x + step / 2 * self.rates(x, tau), tau)
        return np.array(found)
