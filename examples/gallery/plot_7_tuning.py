"""
Gains from costs
================

What ``awiwi-gen tune --costs costs.toml`` does, for one joint: the weights of a quadratic cost become the gains of the
regulator that is optimal for the plant as known. The ratio of two weights is a trade: a motor torque that costs less
makes the joint faster.
"""

import matplotlib.pyplot as plt
import numpy as np

import awiwi_gen
from awiwi_gen.loops.regulator import cancelling, loop_of, regulator
from awiwi_gen.tune.tendons import plants

WEIGHTS = 9  # 2 in tests

hand = awiwi_gen.Hand.load()
lib = awiwi_gen.build(hand)
driven = plants(lib, hand, "index", hand.fingers["index"], force=10.0)  # one for each tendon, under a force of 10 N
plant = next(plant for joint, plant in driven if joint == "pip")
Q = np.diag([100.0, 0.01, 0.01, 0.01])  # weights of q, q', tau, tau'
times = np.linspace(0, 0.2, 400)

# %%
# What is fast bears less delay: the margin of each loop, beside the sample of a clock of 3 kHz.
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
margins = []
for R in np.geomspace(1e-3, 10, WEIGHTS):
    loop = loop_of(plant, regulator(plant, Q, R) + cancelling(plant))
    left.plot(times, loop.step(0.2, times), color=plt.cm.viridis(np.log10(R) / 4 + 0.75), label=f"R = {R:.2g}")
    margins.append((R, 1e3 * loop.delay_margin()))
left.set(xlabel="time [s]", ylabel="angle [rad]", title="a step, by the weight of the torque")
left.legend(fontsize="small")
right.loglog(*np.transpose(margins), "o-", label="delay margin")
right.axhline(1 / 3, color="k", ls=":", label="one sample at 3 kHz")
right.set(xlabel="R", ylabel="delay [ms]")
right.legend()
plt.show()
