"""Calibration of lever springs, fitted to recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Spring
from awiwi_gen.hand.lever import POWERS, Lever
from awiwi_gen.identify.recording import (
    LEAST_COVERAGE,
    Array,
    deviations_of,
    positions,
    recording,
    refuse_bends,
    refuse_outliers,
    without_hysteresis,
)

MOST_RESIDUAL = 0.02  # of the largest force, or of the sensor's range


@dataclass(frozen=True)
class CalibrationFit:
    """Inputs of the kernel `calibration_polynomials`, and the residuals' root mean squares [m], [N], [N/m].

    Coefficients begin with the constant; the argument is -1 at `ends[0]`, where the lever is slack, and 1 at `ends[1]`.
    """

    ends: Array
    length_powers: Array
    force_powers: Array
    stiffness_powers: Array
    residuals: Mapping[str, float]


def fit_calibration(counts: Any, elongation: Any, force: Any, ends: tuple[float, float], rest: float) -> CalibrationFit:
    """Fit the polynomials of one unit to its sensor's readings while the tendon is pulled.

    ``elongation`` [m] counts from the slack end, where the length in the mechanism is ``rest`` [m]. Pull and release:
    the fit then runs through the middle of the hysteresis. The stiffness is the slope of force over elongation.
    """
    reading, x, f = recording({"counts": counts, "elongation": elongation, "force": force}, least=2 * POWERS)
    position = positions(reading, ends)
    if np.min(f) < 0:
        worst = int(np.argmin(f))
        raise InputError(f"force[{worst}] = {f[worst]:.4g} N; a tendon cannot push")
    fits = {"elongation": x, "force": f}
    curves = {}
    for name, values in fits.items():
        curves[name] = chebyshev.Chebyshev.fit(position, values, POWERS - 1, domain=[-1, 1])
        refuse_outliers(curves[name](position) - values, {"counts": reading, name: values})
    grid = chebyshev.chebpts2(8 * POWERS)
    rising = {name: curve.deriv()(grid) for name, curve in curves.items()}
    for name, slope in rising.items():
        if not np.all(slope > 0):
            count = (ends[0] + ends[1] + grid[int(np.argmin(slope))] * (ends[1] - ends[0])) / 2
            raise InputError(f"{name} does not rise from slack to taut at {count:.0f} counts")
    stiffness = rising["force"] / rising["elongation"]
    curves["stiffness"] = chebyshev.Chebyshev.fit(grid, stiffness, POWERS - 1, domain=[-1, 1])
    powers = {name: curve.convert(kind=polynomial.Polynomial).coef for name, curve in curves.items()}
    powers = {name: np.pad(coefficients, (0, POWERS - len(coefficients))) for name, coefficients in powers.items()}
    missed = {name: curves[name](position) - values for name, values in fits.items()}
    missed["stiffness"] = curves["stiffness"](grid) - stiffness
    residuals = {name: float(np.sqrt(np.mean(error**2))) for name, error in missed.items()}
    length = np.eye(POWERS)[0] * rest - powers["elongation"]
    return CalibrationFit(np.array(ends, float), length, powers["force"], powers["stiffness"], residuals)


@dataclass(frozen=True)
class UnitFit:
    """A unit's own spring: rate [N/m], free length [m], their standard deviations, and what is left [N].

    ``residual`` is the RMS about the fit, without half of the ``hysteresis`` between pulling and releasing.
    """

    rate: float
    free_length: float
    deviations: tuple[float, float]
    residual: float
    fitted: Array
    hysteresis: float

    @property
    def toml(self) -> str:
        """Lines for a table [[spring.units]] of the hand file."""
        return f'rate = "{self.rate / 1e3:.6g} N/mm"\nfree_length = "{self.free_length * 1e3:.6g} mm"'


def fit_unit(spring: Spring, counts: Any, force: Any, ends: tuple[float, float]) -> UnitFit:
    """Adjust the design's spring to the forces [N] of one unit at its sensor's readings.

    Raises InputError for data that do not tell, or that are of no such mechanism.
    """
    reading, f = recording({"counts": counts, "force": force}, least=8)
    share = (positions(reading, ends) + 1) / 2
    return _spring_fit(Lever(spring), share, f, "counts", reading)


def fit_elongation(spring: Spring, elongation: Any, force: Any) -> UnitFit:
    """Adjust the design's spring to the forces [N] at elongations [m] from the slack end; errors as of `fit_unit`."""
    x, f = recording({"elongation": elongation, "force": force}, least=8)
    lever = Lever(spring)
    return _spring_fit(lever, _shares(lever, x), f, "elongation", x)


def _spring_fit(lever: Lever, share: Array, f: Array, name: str, shown: Array) -> UnitFit:
    """The geometry is trusted, the spring is not; ``share`` is the lever's way from slack to taut.

    At a lever angle the force is (K s - K s0) times what the geometry makes of it, so K and K s0 enter linearly.
    """
    poses = [lever.at(lever.slack + (lever.taut - lever.slack) * u) for u in share]
    geometry = np.array([pose.force / (lever.rate * pose.stretch) for pose in poses])
    length = np.array([pose.stretch for pose in poses]) + lever.free_length
    matrix = np.stack([geometry * length, -geometry], axis=1)
    (rate, pretension), *_ = np.linalg.lstsq(matrix, f, rcond=None)
    errors = matrix @ [rate, pretension] - f
    refuse_outliers(errors, {name: shown, "force": f})
    if not (rate > 0 and pretension > 0):
        raise InputError(f"force gives the spring a rate of {rate:.4g} N/m and a pretension of {-pretension:.4g} N")
    refuse_bends(share, f, (name, "force"))
    hysteresis, residual = without_hysteresis(share, errors, MOST_RESIDUAL * float(f.max()), "force")
    free = pretension / rate
    jacobian = np.stack([geometry * (length - free), -geometry * rate], axis=1)
    spread = deviations_of(jacobian, errors)
    fitted = matrix @ [rate, pretension]
    return UnitFit(float(rate), float(free), (spread[0], spread[1]), residual, fitted, hysteresis)


@dataclass(frozen=True)
class SensorFit:
    """Readings at the lever's ends, their standard deviations, and what is left [counts], as of `UnitFit`."""

    slack: float
    taut: float
    deviations: tuple[float, float]
    residual: float
    fitted: Array
    hysteresis: float


def fit_sensor(spring: Spring, elongation: Any, counts: Any) -> SensorFit:
    """The ends of a lever's sensor by its readings at elongations [m] from the slack end: its zero and its range.

    Readings are linear in the lever's angle, which the geometry has of the elongation. Errors as of `fit_unit`.
    """
    x, reading = recording({"elongation": elongation, "counts": counts}, least=8)
    share = _shares(Lever(spring), x)
    refuse_bends(share, reading, ("elongation", "counts"))
    matrix = np.stack([1 - share, share], axis=1)
    (slack, taut), *_ = np.linalg.lstsq(matrix, reading, rcond=None)
    fitted = matrix @ [slack, taut]
    refuse_outliers(fitted - reading, {"elongation": x, "counts": reading})
    hysteresis, residual = without_hysteresis(share, fitted - reading, MOST_RESIDUAL * abs(taut - slack), "counts")
    spread = deviations_of(matrix, fitted - reading)
    return SensorFit(float(slack), float(taut), (spread[0], spread[1]), residual, fitted, hysteresis)


def _shares(lever: Lever, elongation: Array) -> Array:
    """The lever's way from slack to taut, 0 to 1, at elongations from the slack end."""
    travel, steps = lever.travel, 2000
    beyond = np.maximum(-elongation, elongation - travel)
    worst = int(np.argmax(beyond))
    if beyond[worst] > 0.01 * travel:
        ends = f"0 to {travel * 1e3:.4g} mm"
        raise InputError(f"elongation[{worst}] = {elongation[worst] * 1e3:.4g} mm is beyond the lever's travel, {ends}")
    if np.ptp(elongation) < LEAST_COVERAGE * travel:
        covered = np.ptp(elongation) / travel
        raise InputError(f"elongation covers {covered:.0%} of the travel; expected at least {LEAST_COVERAGE:.0%}")
    paths = np.array([lever.at(angle).path for angle in lever.angles(steps)])
    return np.asarray(np.interp(elongation, paths[0] - paths, np.linspace(0, 1, steps + 1)))
