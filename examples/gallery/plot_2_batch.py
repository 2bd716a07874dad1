"""
A batch of samples
==================

A million inverse dynamics cost Python what they cost C. Batches run in vector units and on all cores, with the bits
that each sample has alone.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import awiwi_gen

LARGEST = 200_000  # 200 in tests

lib = awiwi_gen.build(awiwi_gen.Hand.load())
gravity = np.array([0.0, 0.0, -9.81])
random = np.random.default_rng(1)

sizes = np.unique(np.geomspace(1, LARGEST, 12).astype(int))
seconds = []
for size in sizes:
    q, qd, qdd = random.uniform(-0.2, 0.2, (3, size, 4))
    lib.index_inverse_dynamics(q, qd, qdd, gravity)  # the first call also fills caches
    began = time.perf_counter()
    torques = lib.index_inverse_dynamics(q, qd, qdd, gravity)
    seconds.append(time.perf_counter() - began)

# %%
# One sample alone has the same bits as in the batch.
alone = lib.index_inverse_dynamics(q[-1], qd[-1], qdd[-1], gravity)
assert np.array_equal(alone, torques[-1])
print(f"shape {torques.shape}, and the last row has the bits of a call of its own")

figure, axes = plt.subplots(layout="constrained")
axes.loglog(sizes, 1e9 * np.array(seconds) / sizes, "o-")
axes.set(xlabel="samples in a call", ylabel="time for a sample [ns]", title="index_inverse_dynamics")
plt.show()
