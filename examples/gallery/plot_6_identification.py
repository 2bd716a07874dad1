"""
Friction from a recording
=========================

A motor turned at constant speeds, and its torque was recorded. ``fit_friction`` finds the three numbers of the friction
model, with standard deviations, and prints the line for the hand file. The recording here is made by the kernel
``motor_friction`` itself, with noise, so that the truth is known.
"""

import matplotlib.pyplot as plt
import numpy as np

import awiwi_gen
from awiwi_gen.identify import fit_friction

POINTS = 80  # 40 in tests

hand = awiwi_gen.Hand.load()
lib = awiwi_gen.build(hand)
random = np.random.default_rng(1)
speeds = np.linspace(-8, 8, POINTS)  # rad/s
torque = np.ravel(lib.motor_friction(speeds[:, None])) + random.normal(0, 2e-3, POINTS)

fit = fit_friction(speeds, torque)
truth = hand.motor.friction
for name, found, spread in zip(("steepness", "level", "viscosity"), (fit.steepness, fit.level, fit.viscosity),
                               fit.deviations, strict=True):  # fmt: skip
    print(f"{name:9} {found:8.4f} +- {spread:.4f}, in truth {float(getattr(truth, name)):.4f}")
print(fit.toml)

# %%
# The fit runs through the middle of the noise, also where the curve bends.
figure, axes = plt.subplots(layout="constrained")
axes.plot(speeds, torque, ".", label="recorded")
fine = np.linspace(-8, 8, 400)
axes.plot(fine, fit.curve(fine), label="fitted")
axes.set(xlabel="speed [rad/s]", ylabel="torque [N m]")
axes.legend()
plt.show()
