"""
The workspace of a fingertip
============================

Where can the tip of the index finger be, and where can it move well? Random joint angles within the limits give its
places; the manipulability of each, the product of the Jacobian's singular values, gives the colour.
"""

import matplotlib.pyplot as plt
import numpy as np

import awiwi_gen

SAMPLES = 20_000  # 200 in tests

hand = awiwi_gen.Hand.load()
lib = awiwi_gen.build(hand)
port = lib["index_fingertip_pose"].inputs[0]  # joint angles, with the range of each
q = np.random.default_rng(1).uniform(port["low"], port["high"], (SAMPLES, 4))
q[:, 0] = 0.0  # no abduction: the tip stays in a plane

poses, jacobians = lib.index_pose_and_jacobian(q)
tips = 1e3 * poses[:, :3, 3]  # mm, in the finger's base frame
planar = jacobians[:, [0, 2], 1:]  # of x and z, by the three joints that bend
manipulability = np.sqrt(np.linalg.det(planar @ planar.transpose(0, 2, 1)))

# %%
# The finger bends in the plane of x and z. Where it is stretched it can hardly move along itself.
figure, axes = plt.subplots(layout="constrained")
dots = axes.scatter(tips[:, 0], tips[:, 2], c=1e6 * manipulability, s=2, rasterized=True)
figure.colorbar(dots, label="manipulability [mm²]")
axes.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal", title="reach of the index fingertip")
plt.show()
print(f"reach {np.linalg.norm(tips, axis=1).max():.0f} mm")
