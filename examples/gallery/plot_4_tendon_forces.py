"""
Tendon forces for a torque and a stiffness
==========================================

Tendons only pull, and there are two for each joint: one torque can be had with many forces. The more both sides pull, the
stiffer the joint. ``index_tendon_distribution`` finds the forces within their limits that come nearest to a wanted torque
and a wanted stiffness.
"""

import matplotlib.pyplot as plt
import numpy as np

import awiwi_gen

STEPS = 25  # 3 in tests

lib = awiwi_gen.build(awiwi_gen.Hand.load())
kernel = lib["index_tendon_distribution"]
print(kernel.signature)

q = np.array([0.0, 0.4, 0.5, 0.3])
f_min, f_max = 5.0, 80.0  # N
flexion = np.linspace(-0.3, 0.3, STEPS)  # N m, the torque of the flexion joint
wanted = np.zeros((STEPS, 4))
wanted[:, 1] = flexion

# %%
# The torque comes first. Of 5 N m/rad the limits leave less: one tendon of the pair pulls all it may.
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for stiffness, style in ((2.0, "-"), (5.0, "--")):
    K = np.diag(np.full(4, stiffness))  # N m/rad
    forces = kernel(q, wanted, K, f_min, f_max).f
    torque = lib.index_joint_torque(q, forces)
    left.plot(flexion, forces[:, 0], "C0" + style, label=f"tendon 0, {stiffness:g} N m/rad")
    left.plot(flexion, forces[:, 1], "C1" + style, label=f"tendon 1, {stiffness:g} N m/rad")
    right.plot(flexion, torque[:, 1], "C2" + style, label=f"{stiffness:g} N m/rad")
left.set(xlabel="wanted torque of flexion [N m]", ylabel="tendon force [N]")
left.legend()
right.plot(flexion, flexion, "k:", label="wanted")
right.set(xlabel="wanted torque of flexion [N m]", ylabel="torque [N m]")
right.legend()
plt.show()
