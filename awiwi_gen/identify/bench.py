"""What a table of measurements says about a hand: numbers for its file, with their accuracy and what they leave."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.identify.motors import fit_friction, fit_ripple
from awiwi_gen.identify.recording import Array
from awiwi_gen.identify.springs import fit_elongation, fit_sensor, fit_unit

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand, Motor, Spring


@dataclass(frozen=True)
class Number:
    """A number of the hand file: its key in the section, its value as the file has it, and its standard deviation."""

    key: str
    text: str
    deviation: str


@dataclass(frozen=True)
class Finding:
    """Numbers of one section (`motor`, or `spring` with its units), and how the measurements lie about them.

    ``x`` and ``y`` are the two columns, ``fitted`` is the model at x; ``residual`` is the root of the mean square of
    y - fitted without the hysteresis, which is the distance between pulling and releasing, both in the unit of y.
    """

    section: str
    numbers: tuple[Number, ...]
    labels: tuple[str, str]
    x: Array
    y: Array
    fitted: Array
    unit: str
    residual: float
    hysteresis: float = 0.0


def findings(hand: Hand, columns: Mapping[str, Array], tendon: int | None) -> list[Finding]:
    """What the columns of a table tell. Raises InputError where they are of no known measurement, or tell nothing."""
    known = frozenset(columns)
    if known not in MEASUREMENTS:
        expected = "; ".join(" and ".join(sorted(each)) for each in MEASUREMENTS)
        raise InputError(f"the columns are {', '.join(columns)}; expected {expected}")
    section, measure = MEASUREMENTS[known]
    part = getattr(hand, section)
    if part is None:
        raise InputError(f"the hand file has no section [{section}] that could take the numbers")
    if section == "motor" and tendon is not None:
        raise InputError(
            f"--tendon {tendon}: all motors are of one kind; only springs and their sensors have numbers of their own"
        )
    if section == "spring" and tendon is not None:
        if not 0 <= tendon < hand.tendons:
            raise InputError(f"--tendon {tendon}: the hand has tendons 0 to {hand.tendons - 1}")
        part = part.calibrated.get(tendon, part)
    return measure(part, columns)


def _friction(motor: Motor, columns: Mapping[str, Array]) -> list[Finding]:
    fit = fit_friction(columns["velocity"], columns["torque"])
    units = ("s/rad", "N m", "N m s/rad")
    values = (fit.steepness, fit.level, fit.viscosity)
    numbers = tuple(
        Number(f"friction.{name}", f"{value:.6g} {unit}", f"{deviation:.2g} {unit}")
        for name, value, deviation, unit in zip(
            ("steepness", "level", "viscosity"), values, fit.deviations, units, strict=True
        )
    )
    x, y = columns["velocity"], columns["torque"]
    labels = ("velocity [rad/s]", "torque [N m]")
    return [Finding("motor", numbers, labels, x, y, fit.curve(x), "N m", fit.residual)]


def _ripple(motor: Motor, columns: Mapping[str, Array]) -> list[Finding]:
    """Amplitudes and phases of the waves that the hand file has."""
    harmonics = {shaft: [w.harmonic for w in motor.ripple if w.shaft == shaft] for shaft in ("input", "output")}
    if not motor.ripple:
        raise InputError("the hand file has no [[motor.ripple]]; add one for each wave, with its shaft and harmonic")
    x, y = columns["theta"], columns["torque"]
    fit = fit_ripple(x, y, float(motor.gear_ratio), harmonics["input"], harmonics["output"])
    fitted, numbers = np.full_like(x, fit.offset), []
    for wave in fit.waves:
        if wave.amplitude < 2 * fit.deviation:
            raise InputError(
                f"torque has no ripple of harmonic {wave.harmonic} of the {wave.shaft} shaft beyond its noise"
            )
        index = next(i for i, w in enumerate(motor.ripple) if (w.shaft, w.harmonic) == (wave.shaft, wave.harmonic))
        rate = wave.harmonic * (float(motor.gear_ratio) if wave.shaft == "input" else 1.0)
        fitted += wave.amplitude * np.sin(rate * x + wave.phase)
        spread = np.degrees(fit.deviation / wave.amplitude)
        numbers += [
            Number(f"ripple[{index}].amplitude", f"{wave.amplitude:.6g} N m", f"{fit.deviation:.2g} N m"),
            Number(f"ripple[{index}].phase", f"{np.degrees(wave.phase):.5g} deg", f"{spread:.2g} deg"),
        ]
    labels = ("angle of the output shaft [rad]", "torque [N m]")
    return [Finding("motor", tuple(numbers), labels, x, y, fitted, "N m", fit.residual)]


def _spring_numbers(fit: Any) -> tuple[Number, ...]:
    return (
        Number("rate", f"{fit.rate / 1e3:.6g} N/mm", f"{fit.deviations[0] / 1e3:.2g} N/mm"),
        Number("free_length", f"{fit.free_length * 1e3:.6g} mm", f"{fit.deviations[1] * 1e3:.2g} mm"),
    )


def _by_counts(spring: Spring, columns: Mapping[str, Array]) -> list[Finding]:
    counts, force = columns["counts"], columns["force"]
    fit = fit_unit(spring, counts, force, (float(spring.sensor.slack), float(spring.sensor.taut)))
    labels = ("reading", "force [N]")
    numbers = _spring_numbers(fit)
    return [Finding("spring", numbers, labels, counts, force, fit.fitted, "N", fit.residual, fit.hysteresis)]


def _by_elongation(spring: Spring, columns: Mapping[str, Array]) -> list[Finding]:
    x, force = columns["elongation"], columns["force"]
    fit = fit_elongation(spring, x, force)
    labels = ("elongation [mm]", "force [N]")
    numbers = _spring_numbers(fit)
    return [Finding("spring", numbers, labels, 1e3 * x, force, fit.fitted, "N", fit.residual, fit.hysteresis)]


def _sensor(spring: Spring, columns: Mapping[str, Array]) -> list[Finding]:
    x, counts = columns["elongation"], columns["counts"]
    fit = fit_sensor(spring, x, counts)
    ends = zip(("slack", "taut"), (fit.slack, fit.taut), fit.deviations, strict=True)
    numbers = tuple(Number(f"sensor.{end}", f"{value:.6g}", f"{deviation:.2g}") for end, value, deviation in ends)
    labels = ("elongation [mm]", "reading")
    return [Finding("spring", numbers, labels, 1e3 * x, counts, fit.fitted, "counts", fit.residual, fit.hysteresis)]


def _all_of_a_unit(spring: Spring, columns: Mapping[str, Array]) -> list[Finding]:
    return [*_sensor(spring, columns), *_by_elongation(spring, columns)]


Measure = Callable[[Any, Mapping[str, Array]], list[Finding]]
MEASUREMENTS: dict[frozenset[str], tuple[str, Measure]] = {
    frozenset({"velocity", "torque"}): ("motor", _friction),
    frozenset({"theta", "torque"}): ("motor", _ripple),
    frozenset({"elongation", "force"}): ("spring", _by_elongation),
    frozenset({"counts", "force"}): ("spring", _by_counts),
    frozenset({"counts", "elongation"}): ("spring", _sensor),
    frozenset({"counts", "elongation", "force"}): ("spring", _all_of_a_unit),
}
