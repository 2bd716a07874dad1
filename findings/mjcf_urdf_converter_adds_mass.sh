#!/bin/sh
# mjcf-urdf-simple-converter 0.7.3: each joint of the hand adds a gram, and loses rotor inertia, damping and friction.
#
# Expected. A converter keeps mass and inertia. Its documentation says that the bodies it puts in for joint offsets have
#   negligible mass; a body without `inertial` has none at all in URDF. Damping and friction have an element in URDF,
#   `dynamics`, with the same meaning.
# Observed. Each joint gets a body of 1 g, also where it has no offset. `damping` and `frictionloss` are dropped,
#   although URDF has them, `armature` too (URDF cannot), all without a word.
# Cost. A distal phalanx weighs a few grams. Here the inertia about the joint is 2.6e-5 instead of 2.8e-4 kg m^2. A
#   hand of 19 joints is 19 g heavier.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check \
    mjcf_urdf_simple_converter==0.7.3 mujoco==4.0.0 numpy==2.4.6 scipy==1.17.1

venv/bin/python - <<'EOF'
import sys

import mjcf_urdf_simple_converter
import mujoco
import numpy as np

with open("finger.xml", "w") as file:
    file.write("""<mujoco><compiler angle="radian"/><worldbody>
  <body name="palm"><inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>
    <body name="distal"><joint name="flexion" axis="0 0 1" range="0 1.5" damping="0.1" frictionloss="0.2"
        armature="2.5e-4"/>
      <inertial pos="0.05 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/></body></body></worldbody></mujoco>""")
mjcf_urdf_simple_converter.convert("finger.xml", "finger.urdf")


def properties(path):
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.zeros((1, 1))
    mujoco.mj_fullM(model, data, inertia)
    moving = model.body_mass[model.jnt_bodyid[0] :].sum()
    return moving, inertia[0, 0], model.dof_damping[0], model.dof_frictionloss[0]


expected, observed = properties("finger.xml"), properties("finger.urdf")
print("mass that moves, inertia about the joint, damping, friction")
print("expected: %g kg %g kg m^2 %g %g" % expected)
print("observed: %g kg %g kg m^2 %g %g" % observed)
same = np.isclose(observed[0] - expected[0], 0.001) and observed[1] < 0.1 * expected[1] and observed[2:] == (0, 0)
sys.exit(not same)
EOF
