"""Parameters of a hand from recordings: friction, ripple and calibration, with the accuracy that the data allow.

    fit = fit_friction(velocity, torque)           # mean torques at constant speeds, eq. 3.7
    fit = fit_ripple(theta, torque, gear_ratio)    # torques without friction, over the angle
    fit = fit_calibration(counts, elongation, force, ends)
    fit = fit_unit(spring, counts, force, ends)    # the design's spring, adjusted; fit_elongation without a sensor
    fit = fit_sensor(spring, elongation, counts)   # the ends of the sensor
    print(fit.toml)                                # lines for the hand file

Data that do not determine the parameters raise `InputError`, which names the reading or what is missing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from awiwi_gen.identify.motors import FrictionFit, RippleFit, Wave, fit_friction, fit_ripple
    from awiwi_gen.identify.springs import (
        CalibrationFit,
        SensorFit,
        UnitFit,
        fit_calibration,
        fit_elongation,
        fit_sensor,
        fit_unit,
    )

__all__ = [
    "CalibrationFit", "FrictionFit", "RippleFit", "SensorFit", "UnitFit", "Wave",
    "fit_calibration", "fit_elongation", "fit_friction", "fit_ripple", "fit_sensor", "fit_unit",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import what fits at its first use: the command line starts without SciPy."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    of_motors = name in ("FrictionFit", "RippleFit", "Wave", "fit_friction", "fit_ripple")
    return getattr(import_module(f"{__name__}.{'motors' if of_motors else 'springs'}"), name)
