#!/bin/sh
# MuJoCo 4.0.0 and Pinocchio 4.1.0: a link of a URDF without `inertial` weighs as much as its collision geometry, or nothing.
#
# Expected. URDF says that a link without `inertial` has no mass and no inertia. Two readers of one file give a robot the
#   same mass.
# Observed. MuJoCo gives a moving link without `inertial` the mass and inertia of its collision geometry at 1000 kg/m^3: a
#   fingertip pad of 20 x 10 x 10 mm weighs 2 g. Pinocchio gives it nothing. Neither says a word. The same pad with an
#   `inertial` of mass 0, which means the same in URDF, is refused by MuJoCo.
# Cost. Published grippers have such pads. A mass matrix from one engine differs from the other's by parts of ten, and
#   whoever compares two engines looks for the mistake in the kinematics.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check mujoco==4.0.0 pin==4.1.0 numpy==2.4.6

cat > finger.urdf <<'URDF'
<robot name="finger">
  <link name="palm"/>
  <link name="bone">
    <inertial><origin xyz="0.02 0 0"/><mass value="0.010"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="pad"><collision><geometry><box size="0.02 0.01 0.01"/></geometry></collision></link>
  <joint name="knuckle" type="revolute"><parent link="palm"/><child link="bone"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="tip" type="revolute"><parent link="bone"/><child link="pad"/><origin xyz="0.04 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
URDF

venv/bin/python - <<'PYTHON'
import sys

import mujoco
import numpy as np
import pinocchio

text = open("finger.urdf").read()


def in_mujoco(urdf):
    """Mass [g] of the pad, and the inertia [g mm^2] that the knuckle feels."""
    model = mujoco.MjModel.from_xml_string(urdf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    for i in range(model.nv):
        unit = np.zeros(model.nv)
        unit[i] = 1
        mujoco.mj_mulM(model, data, matrix[i], unit)
    return 1e3 * model.body("pad").mass[0], 1e9 * matrix[0, 0]


model = pinocchio.buildModelFromXML(text)
matrix = pinocchio.crba(model, model.createData(), pinocchio.neutral(model))
ours = 1e3 * model.inertias[model.getJointId("tip")].mass, 1e9 * matrix[0, 0]
theirs = in_mujoco(text)
massless = '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
try:
    in_mujoco(text.replace("<collision>", massless))
    refused = ""
except ValueError as error:
    refused = str(error).splitlines()[0]
print("mujoco", mujoco.__version__, "pinocchio", pinocchio.__version__)
print(f"pinocchio: pad {ours[0]:.3f} g, inertia about the knuckle {ours[1]:.0f} g mm^2")
print(f"mujoco:    pad {theirs[0]:.3f} g, inertia about the knuckle {theirs[1]:.0f} g mm^2")
print(f"mujoco, pad with an inertial of mass 0: {refused or 'read'}")
sys.exit(not (ours[0] == 0 and abs(theirs[0] - 2) < 1e-9 and theirs[1] > 1.5 * ours[1] and "mjMINVAL" in refused))
PYTHON
