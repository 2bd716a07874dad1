#!/bin/sh
# Pinocchio 4.1.0 reading MJCF: `ref` of a joint shifts its limits, and limits that are switched off are on.
#
# Expected. In MJCF, `ref` is the value of the coordinate in the drawn configuration; `range` limits that same
#   coordinate. MuJoCo gives lower 0 and upper 1.5 for range="0 1.5" ref="0.5", and so does Drake 1.51. With
#   limited="false" neither has a limit, whatever `range` says.
# Observed. Pinocchio takes over MuJoCo's coordinate (the link stands at the same place for the same q), yet
#   its limits are the range less `ref`: -0.5 and 1. It limits the joint with limited="false" too. Forward
#   kinematics agrees everywhere: a comparison of poses, mass matrices or torques does not show it.
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


def load(attributes):
    with open("hand.xml", "w") as file:
        file.write(f"""<mujoco><compiler angle="radian"/><worldbody><body name="link"><joint name="j" {attributes}/>
                       <inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>""")
    mj, pin = mujoco.MjModel.from_xml_path("hand.xml"), pinocchio.buildModelFromMJCF("hand.xml")
    mj_data, pin_data = mujoco.MjData(mj), pin.createData()
    same_pose = True
    for q in (0.0, 0.5, 1.5):
        mj_data.qpos[0] = q
        mujoco.mj_forward(mj, mj_data)
        same_pose &= np.allclose(mj_data.xipos[1], pinocchio.centerOfMass(pin, pin_data, np.array([q])))
    expected = mj.jnt_range[0].tolist() if mj.jnt_limited[0] else [-np.inf, np.inf]
    observed = [float(pin.lowerPositionLimit[0]), float(pin.upperPositionLimit[0])]
    print(f"{attributes}: same pose {same_pose}, limits expected {expected}, observed {observed}")
    return same_pose, expected, observed


print("pinocchio", pinocchio.__version__, "mujoco", mujoco.__version__)
shifted = load('range="0 1.5" ref="0.5"')
unlimited = load('range="0 1.5" limited="false"')
sys.exit(not (shifted == (True, [0, 1.5], [-0.5, 1]) and unlimited == (True, [-np.inf, np.inf], [0, 1.5])))
EOF
