"""What a format holds only approximately: polynomials for linkages and springs, with their greatest errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from awiwi_gen.hand.lever import Lever
from awiwi_gen.hand.links import FourBar, Link
from awiwi_gen.hand.pose import coupler_angle
from awiwi_gen.interchange.model import Array

__all__ = ["Fit", "coupler_fit", "coupler_motion", "elongation_curve", "polynomial", "spring_fit"]

_SAMPLES = 400
_SHIFTS = 41  # places tried for the zero of a spring's polynomial
STIFFNESSES = 3  # coefficients that MuJoCo has for a tendon's spring


@dataclass(frozen=True)
class Fit:
    """A polynomial of (x - origin), ascending powers, and its greatest error over the samples."""

    coefficients: tuple[float, ...]
    origin: float
    error: float


def nodes(low: float, high: float) -> Array:
    """Samples from low to high, both included, denser at the ends: least squares there nearly have the least maximum."""
    return low + (high - low) * (1 - np.cos(np.pi * np.arange(_SAMPLES + 1) / _SAMPLES)) / 2


def polynomial(x: Array, y: Array, powers: range, origin: float) -> Fit:
    """The least squares of the powers of (x - origin) that are fitted; the others are zero."""
    scale = float(np.abs(x - origin).max())
    columns = np.stack([((x - origin) / scale) ** power for power in powers], axis=1)
    found = np.linalg.lstsq(columns, y, rcond=None)[0]
    coefficients = np.zeros(powers.stop)
    coefficients[powers.start :] = found / scale ** np.array(powers)
    return Fit(tuple(map(float, coefficients)), origin, float(np.abs(columns @ found - y).max()))


# -- four-bars -------------------------------------------------------------------------------------------------------


def coupler_motion(bar: FourBar, start: float, q: Array) -> Array:
    """Angle of the coupler against the crank for joint angles q [rad], zero at the joint angle `start`."""
    coupler = np.unwrap([coupler_angle(bar, float(angle) + float(bar.reference)) for angle in q])
    at_start = coupler_angle(bar, start + float(bar.reference))
    turns = np.round((np.interp(start, q, coupler) - at_start) / (2 * np.pi))
    return np.asarray(coupler - at_start - 2 * np.pi * turns - (q - start))


def coupler_fit(link: Link, degree: int) -> Fit:
    """The motion of a four-bar's coupler against its crank, as a polynomial of the joint angle less its start [rad]."""
    if link.four_bar is None or link.low is None or link.high is None:
        raise ValueError(f"{link.joint} is no four-bar with limits")
    q, start = nodes(float(link.low), float(link.high)), float(link.start)
    return polynomial(q, coupler_motion(link.four_bar, start, q), range(degree + 1), start)


# -- lever springs ---------------------------------------------------------------------------------------------------


def elongation_curve(lever: Lever, fibre_stiffness: float | None) -> tuple[Array, Array]:
    """Elongation [m] of a lever spring and the fibre behind it, from the slack end on, and the force [N] at each."""
    poses = [lever.at(float(angle)) for angle in nodes(lever.slack, lever.taut)]
    force = np.array([pose.force for pose in poses])
    stretch = np.array([poses[0].path - pose.path for pose in poses])
    if fibre_stiffness is not None:
        stretch = stretch + (force - force[0]) / fibre_stiffness
    return stretch, force


def spring_fit(stretch: Array, force: Array) -> Fit:
    """Force k0 x + k1 x^2 + k2 x^3 with x = stretch - origin, which never falls where x > 0, as MuJoCo has it."""
    most = float(stretch[-1])
    fits = [
        polynomial(stretch, force, range(1, 1 + STIFFNESSES), -most * share)
        for share in np.linspace(0, 1, _SHIFTS) ** 2
    ]
    rising = [fit for fit in fits if _rises(fit, most)]
    if not rising:
        straight = polynomial(stretch, force, range(1, 2), -most)
        rising = [replace(straight, coefficients=straight.coefficients + (0.0,) * (STIFFNESSES - 1))]
    return min(rising, key=lambda fit: fit.error)


def _rises(fit: Fit, most: float) -> bool:
    slope = np.polynomial.Polynomial(fit.coefficients).deriv()
    return bool(np.all(slope(np.linspace(0, most - fit.origin, _SAMPLES)) > 0))
