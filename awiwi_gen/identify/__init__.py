"""Parameters of a hand from recordings: friction, ripple and calibration, with the accuracy that the data allow.

    fit = fit_friction(velocity, torque)           # mean torques at constant speeds, eq. 3.7
    fit = fit_ripple(theta, torque, gear_ratio)    # torques without friction, over the angle
    fit = fit_calibration(counts, elongation, force, ends)
    fit = fit_unit(spring, counts, force)          # the design's spring, adjusted
    print(fit.toml)                                # lines for the hand file

Data that do not determine the parameters raise `InputError`, which names the reading or what is missing.
"""

from awiwi_gen.identify.motors import FrictionFit, RippleFit, Wave, fit_friction, fit_ripple
from awiwi_gen.identify.springs import CalibrationFit, UnitFit, fit_calibration, fit_unit

__all__ = [
    "CalibrationFit", "FrictionFit", "RippleFit", "UnitFit", "Wave",
    "fit_calibration", "fit_friction", "fit_ripple", "fit_unit",
]  # fmt: skip
