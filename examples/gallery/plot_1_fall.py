"""
A finger falls
==============

The index finger hangs in its base, and gravity pulls it down. Its equations of motion are one kernel,
``index_forward_dynamics``; a library integrates them. What gravity loses the motion must gain, so their sum tells how
exact it all is. The joints have no stops here: the finger swings through.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

import awiwi_gen

DURATION = 0.4  # 0.02 in tests

lib = awiwi_gen.build(awiwi_gen.Hand.load())
gravity = np.array([0.0, 0.0, -9.81])  # m/s^2, in the base frame


def rate(_, state):
    """Velocities, and accelerations without any torque."""
    q, qd = state[:4], state[4:]
    return np.concatenate([qd, lib.index_forward_dynamics(q, qd, np.zeros(4), gravity)])


start = np.concatenate([[0.1, 0.3, 0.4, 0.3], np.zeros(4)])
fall = solve_ivp(rate, (0, DURATION), start, rtol=1e-10, atol=1e-10, max_step=2e-3)

# %%
# All samples at once: kernels take leading dimensions as NumPy functions do.
q, qd = fall.y[:4].T, fall.y[4:].T
kinetic, potential = lib.index_energy(q, qd, gravity)
drift = np.ptp(kinetic + potential) / np.ptp(potential)
print(f"{len(q)} steps; the energy stays, to {drift:.0e} of what moved")
assert drift < 1e-7

figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
above.plot(fall.t, np.degrees(q), label=["abduction", "flexion", "pip", "dip"])
above.set(ylabel="angle [deg]")
above.legend(ncols=4)
below.plot(fall.t, 1e3 * (kinetic - kinetic[0]), label="kinetic")
below.plot(fall.t, 1e3 * (potential - potential[0]), "--", label="potential")
below.set(xlabel="time [s]", ylabel="energy [mJ]")
below.legend()
plt.show()
