#!/bin/sh
# Pinocchio 4.1.0 reading MJCF: `ref` of a joint shifts its limits, but not its coordinate.
#
# Expected. In MJCF, `ref` is the value of the coordinate in the drawn configuration; `range` limits that same
#   coordinate. MuJoCo gives lower 0 and upper 1.5 for range="0 1.5" ref="0.5", and so does Drake 1.51.
# Observed. Pinocchio takes over MuJoCo's coordinate (the link stands at the same place for the same q), yet
#   its limits are the range less `ref`: -0.5 and 1. Forward kinematics agrees everywhere, so that a comparison of
#   poses, mass matrices or torques does not show it.
# Cost. A finger drawn half bent: inverse kinematics, trajectory limits and random configurations let it bend 0.5 rad
#   backwards and refuse the last third of its travel.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check \
    pin==4.1.0 libpinocchio==4.1.0 mujoco==4.0.0 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys

import mujoco
import numpy as np
import pinocchio

with open("hand.xml", "w") as file:
    file.write("""
<mujoco>
  <compiler angle="radian"/>
  <worldbody><body name="link"><joint name="j" axis="0 0 1" range="0 1.5" ref="0.5"/>
    <inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
</mujoco>""")
mj, pin = mujoco.MjModel.from_xml_path("hand.xml"), pinocchio.buildModelFromMJCF("hand.xml")
mj_data, pin_data = mujoco.MjData(mj), pin.createData()
same_pose = True
for q in (0.0, 0.5, 1.5):
    mj_data.qpos[0] = q
    mujoco.mj_forward(mj, mj_data)
    same_pose &= np.allclose(mj_data.xipos[1], pinocchio.centerOfMass(pin, pin_data, np.array([q])))
observed = pin.lowerPositionLimit[0], pin.upperPositionLimit[0]
print("pinocchio", pinocchio.__version__, "mujoco", mujoco.__version__)
print("same pose for the same q:", same_pose)
print("expected limits:", mj.jnt_range[0].tolist())
print("observed limits:", list(map(float, observed)))
sys.exit(not (same_pose and np.allclose(mj.jnt_range[0], (0, 1.5)) and np.allclose(observed, (-0.5, 1))))
EOF
