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
from awiwi_gen.identify.recording import Array, deviations_of, positions, recording, refuse_outliers


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
    """A unit's own spring: rate [N/m], free length [m], their standard deviations, the residuals' RMS [N]."""

    rate: float
    free_length: float
    deviations: tuple[float, float]
    residual: float

    @property
    def toml(self) -> str:
        """Lines for a table [[spring.units]] of the hand file."""
        return f'rate = "{self.rate / 1e3:.6g} N/mm"\nfree_length = "{self.free_length * 1e3:.6g} mm"'


def fit_unit(spring: Spring, counts: Any, force: Any, ends: tuple[float, float]) -> UnitFit:
    """Adjust the design's spring to the forces [N] of one unit: its geometry is trusted, its spring is not.

    At a lever angle the force is (K s - K s0) times what the geometry makes of it, so K and K s0 enter linearly.
    """
    reading, f = recording({"counts": counts, "force": force}, least=8)
    position = positions(reading, ends)
    lever = Lever(spring)
    poses = [lever.at(lever.slack + (lever.taut - lever.slack) * (u + 1) / 2) for u in position]
    geometry = np.array([pose.force / (lever.rate * pose.stretch) for pose in poses])
    length = np.array([pose.stretch for pose in poses]) + lever.free_length
    matrix = np.stack([geometry * length, -geometry], axis=1)
    (rate, pretension), *_ = np.linalg.lstsq(matrix, f, rcond=None)
    errors = matrix @ [rate, pretension] - f
    refuse_outliers(errors, {"counts": reading, "force": f})
    if not (rate > 0 and pretension > 0):
        raise InputError(f"force gives the spring a rate of {rate:.4g} N/m and a pretension of {-pretension:.4g} N")
    free = pretension / rate
    jacobian = np.stack([geometry * (length - free), -geometry * rate], axis=1)
    spread = deviations_of(jacobian, errors)
    return UnitFit(float(rate), float(free), (spread[0], spread[1]), float(np.sqrt(np.mean(errors**2))))
