#!/bin/sh
# Pinocchio 4.1.0 reading MJCF: two options of `compiler` that change the model are misread, or not read.
#
# Expected. In `eulerseq` lower-case letters are rotations about the turned axes and capitals about the fixed ones:
#   "XYZ" is roll, pitch and yaw of URDF. `inertiagrouprange` names the groups of shapes that have mass, so that shapes for
#   display have none. MuJoCo does both; Drake 1.51 reads "XYZ" alike.
# Observed. Capitals are taken as lower case: the body of this example is turned by 12 degrees. Shapes for display
#   count: the body here has nine times its mass. There is no message.
# Cost. A hand ported from URDF keeps its angles by writing eulerseq="XYZ". Joint axes, gravity torques and mass matrix
#   are then those of another hand.
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


def load(option, content):
    with open("hand.xml", "w") as file:
        file.write(f"""<mujoco><compiler {option}/><worldbody><body name="link" euler="10 20 30">
                       <joint name="j"/>{content}</body></worldbody></mujoco>""")
    model = mujoco.MjModel.from_xml_path("hand.xml")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pin = pinocchio.buildModelFromMJCF("hand.xml")
    turn = data.xmat[1].reshape(3, 3).T @ pin.jointPlacements[1].rotation
    angle = np.rad2deg(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    return round(float(angle), 1), float(model.body_mass[1]), float(pin.inertias[1].mass)


inertial = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
shapes = '<geom size="0.1" group="3"/><geom size="0.2" group="1"/>'
lower, upper = load('eulerseq="xyz"', inertial)[0], load('eulerseq="XYZ"', inertial)[0]
_, expected, observed = load('inertiagrouprange="3 3"', shapes)
print("pinocchio", pinocchio.__version__, "mujoco", mujoco.__version__)
print(f"degrees between the bodies of both readers: expected 0; observed {lower} for xyz, {upper} for XYZ")
print(f"mass with inertiagrouprange: expected {expected:.3f}, observed {observed:.3f} kg")
sys.exit(not (lower == 0 and upper > 5 and np.isclose(observed, 9 * expected)))
EOF
