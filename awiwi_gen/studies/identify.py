"""Numbers of a hand from recordings: friction, ripple and calibration, each with how well the data determine it.

    fit = fit_friction(velocity, torque)           # mean torques at constant speeds, eq. 3.7
    fit = fit_ripple(theta, torque, gear_ratio)    # what friction leaves, against the angle
    fit = fit_calibration(counts, elongation, force, ends)
    fit = fit_unit(spring, counts, force)          # the design's spring, adjusted
    print(fit.toml)                                # ready for the hand file

Data that cannot determine what is asked raise `InputError`, which names the reading or the lack.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from scipy.optimize import least_squares

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand import Spring
from awiwi_gen.hand_lever import POWERS, Lever

Array = np.ndarray[Any, Any]

OUTLIER = 8.0  # times the typical residual: one in 10^14 of normal errors is as far off
VAGUE = 0.5  # standard deviation, as a share of its value, from which on a parameter counts as unknown
LEAST_COVERAGE = 0.9  # of the lever's travel: a polynomial tells nothing of what it has not seen


# -- friction and ripple of motors ------------------------------------------------------------------------


@dataclass(frozen=True)
class FrictionFit:
    """The numbers of eq. 3.8, their standard deviations in the same order, and the residuals' root mean square [N m]."""

    steepness: float
    level: float
    viscosity: float
    deviations: tuple[float, float, float]
    residual: float

    @property
    def toml(self) -> str:
        """A line for the section [motor]."""
        numbers = f'steepness = "{self.steepness:.5g} s/rad", level = "{self.level:.5g} N m"'
        return f'friction = {{ {numbers}, viscosity = "{self.viscosity:.5g} N m s/rad" }}'


def fit_friction(velocity: Any, torque: Any) -> FrictionFit:
    """Fit eq. 3.8 to the mean motor torques [N m] that keep constant speeds [rad/s].

    Level and viscosity enter linearly, so only the steepness is searched: coarsely, then together with them.
    """
    thd, tau = _recording({"velocity": velocity, "torque": torque}, least=8)
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
    _no_outliers(found.fun, {"velocity": thd, "torque": tau})
    steepness, level, viscosity = float(np.exp(found.x[0])), float(found.x[1]), float(found.x[2])
    spread = _deviations(found.jac, found.fun)
    if spread[0] > VAGUE:
        slowest = f"the slowest speed is {speeds.min():.3g} rad/s, the steepness about {steepness:.3g} s/rad"
        raise InputError(f"velocity does not come near enough to standstill to tell how friction begins: {slowest}")
    for name, value, deviation in (("level", level, spread[1]), ("viscosity", viscosity, spread[2])):
        if value < -3 * deviation:
            raise InputError(f"torque gives friction a {name} of {value:.3g}, below zero: that is no friction")
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
    """Ripples, the constant torque beside them, the amplitudes' standard deviation and the residuals' RMS, all [N m]."""

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
    angle, tau = _recording({"theta": theta, "torque": torque}, least=8)
    lines = [("input", n, n * gear_ratio) for n in input_harmonics] + [("output", n, float(n)) for n in output_harmonics]
    slowest = min(frequency for _, _, frequency in lines)
    if np.ptp(angle) < 2 * np.pi / slowest:
        raise InputError(
            f"theta covers {np.ptp(angle):.3g} rad; the slowest ripple needs one period, {2 * np.pi / slowest:.3g} rad"
        )
    columns = [np.ones_like(angle)]
    for _, _, frequency in lines:
        columns += [np.sin(frequency * angle), np.cos(frequency * angle)]
    matrix = np.stack(columns, axis=1)
    if len(angle) < 2 * matrix.shape[1] or np.linalg.cond(matrix) > 30:
        raise InputError(
            f"theta has {len(angle)} points, too few or too regular to tell {len(lines)} ripples apart; "
            f"the fastest has a period of {2 * np.pi / max(f for _, _, f in lines):.3g} rad"
        )
    solution = np.linalg.lstsq(matrix, tau, rcond=None)[0]
    errors = matrix @ solution - tau
    _no_outliers(errors, {"theta": angle, "torque": tau})
    waves = tuple(
        Wave(shaft, harmonic, float(np.hypot(a, b)), float(np.arctan2(b, a)))
        for (shaft, harmonic, _), a, b in zip(lines, solution[1::2], solution[2::2], strict=True)
    )
    deviation = float(np.max(_deviations(matrix, errors)))
    return RippleFit(waves, float(solution[0]), deviation, float(np.sqrt(np.mean(errors**2))))
