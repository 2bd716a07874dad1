#!/bin/sh
# MuJoCo 4.0.0: degree mode converts the range of a joint, but not other angles of the same joint.
#
# Expected. The reference says that `compiler angle` states the unit of the angles in the file, and that the compiler
#   converts degrees to radians. A fixed tendon over a hinge with coefficient 1 has that joint's angle as its
#   length; a position actuator has it as its control; a joint equality as its constant; a keyframe as its qpos.
# Observed. Only the joint's own range, ref and springref are converted, the range only while it is active (switched
#   on at run time, it limits at 90 rad). 90 stays 90 rad as the limit of the tendon and of the control, 30 stays
#   30 rad in the equality and the keyframe. The default of the format is degrees. `inheritrange="1"` on the
#   same actuator gives 1.57: two spellings of one wish differ by a factor of 57.
# Cost. Limits that never act, and a coupling that turns a finger joint by 30 rad: nearly five turns.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check mujoco==4.0.0 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <compiler angle="degree"/>
  <worldbody><body><joint name="j" axis="0 0 1" range="-90 90" ref="30"/>
    <joint name="free_to_turn" axis="1 0 0" range="-90 90" limited="false"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
  <tendon><fixed range="-90 90"><joint joint="j" coef="1"/></fixed></tendon>
  <equality><joint joint1="j" polycoef="30 0 0 0 0"/></equality>
  <actuator><position joint="j" ctrlrange="-90 90"/><position joint="j" inheritrange="1"/></actuator>
  <keyframe><key qpos="30 0"/></keyframe>
</mujoco>""")
print("mujoco", mujoco.__version__)
right = np.deg2rad(90), np.deg2rad(30)
rows = [
    ("joint range", model.jnt_range[0, 1], right[0], True),
    ("joint ref", model.qpos0[0], right[1], True),
    ("range of an unlimited joint", model.jnt_range[1, 1], right[0], False),
    ("control range, inherited", model.actuator_ctrlrange[1, 1], right[0], True),
    ("control range, written", model.actuator_ctrlrange[0, 1], right[0], False),
    ("range of the tendon", model.tendon_range[0, 1], right[0], False),
    ("equality constant", model.eq_data[0, 0], right[1], False),
    ("keyframe", model.key_qpos[0, 0], right[1], False),
]
for name, observed, expected, _ in rows:
    print(f"{name:28} expected {expected:.4f} rad, observed {observed:.4f} rad")
sys.exit(not all(np.isclose(o, e) if converted else np.isclose(o, np.rad2deg(e)) for _, o, e, converted in rows))
EOF
