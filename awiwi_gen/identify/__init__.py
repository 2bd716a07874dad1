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
from awiwi_gen.hand.lever import POWERS, Lever

Array = np.ndarray[Any, Any]

OUTLIER = 8.0  # times the typical residual: one in 10^14 of normal errors is as far off
VAGUE = 0.5  # standard deviation, as a share of its value, from which on a parameter counts as unknown
LEAST_COVERAGE = 0.9  # of a period, of the lever's travel: a fit tells nothing of what it has not seen


# -- friction and ripple of motors ------------------------------------------------------------------------


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
    angle, tau = _recording({"theta": theta, "torque": torque}, least=8)
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
            f"theta has {len(angle)} points, too few or too regular to tell {len(lines)} ripples apart; "
            f"the fastest has a period of {fastest:.3g} rad"
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


# -- calibration of lever springs -------------------------------------------------------------------------


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
    """Fit the polynomials of one unit to what its sensor reads while the tendon is pulled.

    ``elongation`` [m] counts from the slack end, where the length in the mechanism is ``rest`` [m]. Pull and release:
    the fit then runs through the middle of the hysteresis. The stiffness is the slope of force over elongation.
    """
    reading, x, f = _recording({"counts": counts, "elongation": elongation, "force": force}, least=2 * POWERS)
    place = _places(reading, ends)
    if np.min(f) < 0:
        worst = int(np.argmin(f))
        raise InputError(f"force[{worst}] = {f[worst]:.4g} N; a tendon cannot push")
    fits = {"elongation": x, "force": f}
    curves = {}
    for name, values in fits.items():
        curves[name] = chebyshev.Chebyshev.fit(place, values, POWERS - 1, domain=[-1, 1])
        _no_outliers(curves[name](place) - values, {"counts": reading, name: values})
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
    missed = {name: curves[name](place) - values for name, values in fits.items()}
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
    reading, f = _recording({"counts": counts, "force": force}, least=8)
    place = _places(reading, ends)
    lever = Lever(spring)
    poses = [lever.at(lever.slack + (lever.taut - lever.slack) * (u + 1) / 2) for u in place]
    geometry = np.array([pose.force / (lever.rate * pose.stretch) for pose in poses])
    length = np.array([pose.stretch for pose in poses]) + lever.free_length
    matrix = np.stack([geometry * length, -geometry], axis=1)
    (rate, pretension), *_ = np.linalg.lstsq(matrix, f, rcond=None)
    errors = matrix @ [rate, pretension] - f
    _no_outliers(errors, {"counts": reading, "force": f})
    if not (rate > 0 and pretension > 0):
        raise InputError(f"force gives the spring a rate of {rate:.4g} N/m and a pretension of {-pretension:.4g} N")
    free = pretension / rate
    jacobian = np.stack([geometry * (length - free), -geometry * rate], axis=1)
    spread = _deviations(jacobian, errors)
    return UnitFit(float(rate), float(free), (spread[0], spread[1]), float(np.sqrt(np.mean(errors**2))))


# -- what all recordings must be --------------------------------------------------------------------------


def _recording(columns: Mapping[str, Any], least: int) -> list[Array]:
    """Columns of equal length, of finite numbers, long enough. Raises InputError with all faults."""
    faults, arrays = [], []
    for name, values in columns.items():
        try:
            array = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            faults.append(Fault(key=name, message="is not a column of numbers"))
            continue
        arrays.append(array)
        if array.ndim != 1 or len(array) < least:
            shape = " x ".join(map(str, array.shape)) or "one number"
            faults.append(Fault(key=name, message=f"is {shape}; expected a column of at least {least} numbers"))
        elif not np.isfinite(array).all():
            index = int(np.argmin(np.isfinite(array)))
            faults.append(Fault(key=f"{name}[{index}]", message=f"= {array[index]} is not a number to reckon with"))
    if not faults and len({len(array) for array in arrays}) > 1:
        sizes = ", ".join(f"{name} {len(array)}" for name, array in zip(columns, arrays, strict=True))
        faults.append(Fault(message=f"the columns differ in length: {sizes}"))
    if faults:
        raise InputError(faults)
    return arrays


def _places(reading: Array, ends: tuple[float, float]) -> Array:
    """Where readings lie between the sensor's ends: from -1 to 1. Raises InputError for absurd or too few of them."""
    if not abs(ends[1] - ends[0]) > 0:
        raise InputError(f"ends are both {ends[0]:.6g} counts; the sensor would measure nothing")
    place: Array = (2 * reading - ends[0] - ends[1]) / (ends[1] - ends[0])
    farthest = int(np.argmax(np.abs(place)))
    if abs(place[farthest]) > 1.01:
        raise InputError(f"counts[{farthest}] = {reading[farthest]:.6g} is beyond the sensor's ends {ends}")
    if np.ptp(place) < 2 * LEAST_COVERAGE:
        raise InputError(f"counts cover {np.ptp(place) / 2:.0%} of the travel; expected at least {LEAST_COVERAGE:.0%}")
    distinct = len(np.unique(reading))
    if distinct < 2 * POWERS:
        raise InputError(f"counts has {distinct} different readings; expected at least {2 * POWERS}")
    return place


def _no_outliers(errors: Array, columns: Mapping[str, Array]) -> None:
    """Raise InputError for the worst point if it is far farther off than is typical; what was fitted comes last."""
    size, fitted = np.abs(errors), [*columns.values()][-1]
    typical = 1.4826 * float(np.median(size)) + 1e-6 * float(np.ptp(fitted))  # models of exact data err a little too
    worst = int(np.argmax(size))
    if size[worst] > OUTLIER * typical:
        values = ", ".join(f"{name} {column[worst]:.6g}" for name, column in columns.items())
        raise InputError(f"point {worst} ({values}) is {size[worst] / typical:.0f} times farther off than the others")


def _deviations(jacobian: Array, errors: Array) -> Array:
    """Standard deviations of least-squares parameters, from the residuals' size."""
    freedom = max(len(errors) - jacobian.shape[1], 1)
    variance = float(np.sum(errors**2)) / freedom
    deviations: Array = np.sqrt(variance * np.diag(np.linalg.pinv(jacobian.T @ jacobian)))
    return deviations
