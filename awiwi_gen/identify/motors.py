"""Friction and ripple of motors, fitted to recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from awiwi_gen.errors import InputError
from awiwi_gen.identify.recording import LEAST_COVERAGE, Array, deviations_of, recording, refuse_outliers

VAGUE = 0.5  # relative standard deviation from which on a parameter counts as undetermined


@dataclass(frozen=True)
class FrictionFit:
    """The numbers of eq. 3.8, their standard deviations in that order, and the residuals' root mean square [N m]."""

    steepness: float
    level: float
    viscosity: float
    deviations: tuple[float, float, float]
    residual: float

    def curve(self, velocity: Any) -> Array:
        """The fitted friction torque [N m] at speeds [rad/s]."""
        return np.asarray(np.arctan(self.steepness * velocity) * self.level + self.viscosity * velocity)

    @property
    def toml(self) -> str:
        """A line for the section [motor]."""
        numbers = f'steepness = "{self.steepness:.5g} s/rad", level = "{self.level:.5g} N m"'
        return f'friction = {{ {numbers}, viscosity = "{self.viscosity:.5g} N m s/rad" }}'


def fit_friction(velocity: Any, torque: Any) -> FrictionFit:
    """Fit eq. 3.8 to the mean motor torques [N m] at constant speeds [rad/s].

    Level and viscosity enter linearly, so only the steepness is searched: coarsely, then together with them.
    """
    thd, tau = recording({"velocity": velocity, "torque": torque}, least=8)
    if len(np.unique(np.abs(thd))) < 4 or not thd.any():
        raise InputError("velocity takes fewer than 4 different speeds; friction has 3 parameters")
    if np.sum(thd * tau) <= 0:
        raise InputError("torque opposes velocity on the whole; expected the motor's torque, which overcomes friction")

    def linear(steepness: float) -> tuple[Array, float]:
        columns = np.stack([np.arctan(steepness * thd), thd], axis=1)
        solution = np.linalg.lstsq(columns, tau, rcond=None)[0]
        return solution, float(np.sum((columns @ solution - tau) ** 2))

    speeds = np.abs(thd[thd != 0])
    coarse = min(np.geomspace(0.1 / speeds.max(), 100 / speeds.min(), 200), key=lambda steepness: linear(steepness)[1])

    def residuals(x: Array) -> Array:
        return np.asarray(np.arctan(np.exp(x[0]) * thd) * x[1] + x[2] * thd - tau)

    found = least_squares(residuals, [np.log(coarse), *linear(coarse)[0]], x_scale="jac", xtol=1e-15, ftol=1e-15)
    refuse_outliers(found.fun, {"velocity": thd, "torque": tau})
    steepness, level, viscosity = float(np.exp(found.x[0])), float(found.x[1]), float(found.x[2])
    spread = deviations_of(found.jac, found.fun)
    if spread[0] > VAGUE:
        slowest = f"the slowest speed is {speeds.min():.3g} rad/s, the steepness about {steepness:.3g} s/rad"
        raise InputError(f"velocity has no values near enough to standstill to determine the steepness: {slowest}")
    for name, value, deviation in (("level", level, spread[1]), ("viscosity", viscosity, spread[2])):
        if value < -3 * deviation:
            raise InputError(f"torque gives friction a negative {name}, {value:.3g}; expected a positive one")
    residual = float(np.sqrt(np.mean(found.fun**2)))
    return FrictionFit(steepness, level, viscosity, (steepness * spread[0], spread[1], spread[2]), residual)


@dataclass(frozen=True)
class Wave:
    """One ripple: amplitude [N m] times sin(harmonic angle of its shaft + phase [rad])."""

    shaft: str
    harmonic: int
    amplitude: float
    phase: float


@dataclass(frozen=True)
class RippleFit:
    """Ripples, the torque they swing about, the amplitudes' standard deviation and the residuals' RMS, all [N m]."""

    waves: tuple[Wave, ...]
    offset: float
    deviation: float
    residual: float

    @property
    def toml(self) -> str:
        """Tables for the hand file."""
        return "\n".join(
            f'[[motor.ripple]]\nshaft = "{wave.shaft}"\nharmonic = {wave.harmonic}\n'
            f'amplitude = "{wave.amplitude:.5g} N m"\nphase = "{np.degrees(wave.phase):.5g} deg"\n'
            for wave in self.waves
        )


def fit_ripple(
    theta: Any, torque: Any, gear_ratio: float, input_harmonics: Sequence[int], output_harmonics: Sequence[int] = ()
) -> RippleFit:
    """Fit ripples of given harmonics of both shafts to torques [N m] at angles theta [rad] of the output shaft."""
    angle, tau = recording({"theta": theta, "torque": torque}, least=8)
    lines = [("input", n, n * gear_ratio) for n in input_harmonics] + [
        ("output", n, float(n)) for n in output_harmonics
    ]
    slowest, fastest = (2 * np.pi / extreme(f for _, _, f in lines) for extreme in (min, max))
    if np.ptp(angle) < LEAST_COVERAGE * slowest:
        raise InputError(f"theta covers {np.ptp(angle):.3g} rad; the slowest ripple has a period of {slowest:.3g} rad")
    columns = [np.ones_like(angle)]
    for _, _, frequency in lines:
        columns += [np.sin(frequency * angle), np.cos(frequency * angle)]
    matrix = np.stack(columns, axis=1)
    if len(angle) < 2 * matrix.shape[1] or np.linalg.cond(matrix) > 30:
        raise InputError(
            f"theta has {len(angle)} points, too few or too regular to distinguish {len(lines)} ripples; "
            f"the fastest has a period of {fastest:.3g} rad"
        )
    solution = np.linalg.lstsq(matrix, tau, rcond=None)[0]
    errors = matrix @ solution - tau
    refuse_outliers(errors, {"theta": angle, "torque": tau})
    waves = tuple(
        Wave(shaft, harmonic, float(np.hypot(a, b)), float(np.arctan2(b, a)))
        for (shaft, harmonic, _), a, b in zip(lines, solution[1::2], solution[2::2], strict=True)
    )
    deviation = float(np.max(deviations_of(matrix, errors)))
    return RippleFit(waves, float(solution[0]), deviation, float(np.sqrt(np.mean(errors**2))))
