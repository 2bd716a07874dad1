"""Checks that all recordings must pass, and standard deviations of what is fitted to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand.lever import POWERS

Array = np.ndarray[Any, Any]

OUTLIER = 8.0  # times the typical residual: one in 10^14 of normal errors is as large
MOST_HYSTERESIS = 4.0  # times the largest residual
LEAST_COVERAGE = 0.9  # of a period, or of the lever's travel: a fit does not extrapolate


def recording(columns: Mapping[str, Any], least: int) -> list[Array]:
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
            faults.append(Fault(key=f"{name}[{index}]", message=f"= {array[index]} is not finite"))
    if not faults and len({len(array) for array in arrays}) > 1:
        sizes = ", ".join(f"{name} {len(array)}" for name, array in zip(columns, arrays, strict=True))
        faults.append(Fault(message=f"the columns differ in length: {sizes}"))
    if faults:
        raise InputError(faults)
    return arrays


def positions(reading: Array, ends: tuple[float, float]) -> Array:
    """Readings scaled to -1 to 1 between the sensor's ends. Raises InputError if they are out of range or too few."""
    if not abs(ends[1] - ends[0]) > 0:
        raise InputError(f"ends are both {ends[0]:.6g} counts; the sensor would measure nothing")
    position: Array = (2 * reading - ends[0] - ends[1]) / (ends[1] - ends[0])
    farthest = int(np.argmax(np.abs(position)))
    if abs(position[farthest]) > 1.01:
        raise InputError(f"counts[{farthest}] = {reading[farthest]:.6g} is beyond the sensor's ends {ends}")
    if np.ptp(position) < 2 * LEAST_COVERAGE:
        raise InputError(
            f"counts cover {np.ptp(position) / 2:.0%} of the travel; expected at least {LEAST_COVERAGE:.0%}"
        )
    distinct = len(np.unique(reading))
    if distinct < 2 * POWERS:
        raise InputError(f"counts has {distinct} different readings; expected at least {2 * POWERS}")
    return position


def refuse_bends(x: Array, y: Array, names: tuple[str, str]) -> None:
    """Raise InputError unless y goes one way with x, in the means of eighths of the points in the order of x."""
    means = np.array([part.mean() for part in np.array_split(y[np.argsort(x, kind="stable")], 8)])
    steps = np.diff(means) * np.sign(means[-1] - means[0])
    if not np.all(steps > 0):
        at = np.sort(x)[int((int(np.argmin(steps)) + 1) / 8 * len(x))]
        raise InputError(f"{names[1]} does not go one way with {names[0]}: it turns at about {at:.4g}")


def without_hysteresis(x: Array, errors: Array, limit: float, what: str) -> tuple[float, float]:
    """The distance between the errors of rising and of falling x, and the RMS of the errors about both.

    Points are in the order of the measurement. Raises InputError where either is above its limit: a fit through the
    middle is then none of the mechanism.
    """
    rising = np.gradient(x) >= 0
    groups = [errors[rising], errors[~rising]]
    both = min(map(len, groups)) >= 8
    hysteresis = float(abs(groups[0].mean() - groups[1].mean())) if both else 0.0
    left = np.concatenate([group - group.mean() for group in groups]) if both else errors
    residual = float(np.sqrt(np.mean(left**2)))
    for name, value, most in (("a hysteresis", hysteresis, MOST_HYSTERESIS * limit), ("a residual", residual, limit)):
        if value > most:
            raise InputError(
                f"{what} has {name} of {value:.3g} where {most:.3g} is the most; is this the mechanism of the hand file?"
            )
    return hysteresis, residual


def refuse_outliers(errors: Array, columns: Mapping[str, Array]) -> None:
    """Raise InputError for the worst point if its error is far above the typical one; the last column was fitted."""
    size, fitted = np.abs(errors), [*columns.values()][-1]
    typical = 1.4826 * float(np.median(size)) + 1e-6 * float(
        np.ptp(fitted)
    )  # models have small errors even for exact data
    worst = int(np.argmax(size))
    if size[worst] > OUTLIER * typical:
        values = ", ".join(f"{name} {column[worst]:.6g}" for name, column in columns.items())
        raise InputError(f"point {worst} ({values}) is {size[worst] / typical:.0f} times farther off than typical")


def deviations_of(jacobian: Array, errors: Array) -> Array:
    """Standard deviations of least-squares parameters, from the residuals' size."""
    freedom = max(len(errors) - jacobian.shape[1], 1)
    variance = float(np.sum(errors**2)) / freedom
    deviations: Array = np.sqrt(variance * np.diag(np.linalg.pinv(jacobian.T @ jacobian)))
    return deviations
