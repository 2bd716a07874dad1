"""
A law in closed loop
====================

The joint PIP of the index finger between its two tendons, at 3 kHz, a sample late, with noise and friction: a step of
0.2 rad by the law ``backstepping_antagonistic``, on the plant that it knows and on plants that it does not.
"""

import matplotlib.pyplot as plt
import numpy as np

import awiwi_gen
from awiwi_gen.loops.hand_joint import joint_of
from awiwi_gen.loops.laws import law_of
from awiwi_gen.loops.scenarios import BEFORE, PLANTS, STEP, run

TICKS = 900  # 200 in tests

hand = awiwi_gen.Hand.load()
lib = awiwi_gen.build(hand)
joint = joint_of(lib, hand, "index", "pip")
law = law_of("backstepping_antagonistic")
gains = law.gains_with({}, joint)
print("gains:", ", ".join(f"{name} = {value:.4g}" for name, value in gains.items()))

# %%
# The commands ``awiwi-gen simulate`` and ``awiwi-gen tune`` use the same loop.
figure, axes = plt.subplots(layout="constrained")
for name in ("as known", "springs 30 % soft", "link three times heavier"):
    true = joint.perturbed(**PLANTS[name])
    trace = run(lib, law, gains, true, joint.believed(), 10.0, ["step"], ticks=TICKS)["step"]
    axes.plot(1e3 * (trace.time - BEFORE * joint.period), np.asarray(trace["x"])[:, 0], label=name)
axes.axhline(STEP, color="k", lw=0.5)
axes.set(xlabel="time [ms]", ylabel="angle [rad]", title="a step of index PIP under 10 N")
axes.legend()
plt.show()
