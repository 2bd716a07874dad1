#!/bin/sh
# Pinocchio 4.1.0 reading MJCF: `axisangle` with an axis that is not a unit vector gives a matrix that is no rotation.
#
# Expected. The reference says that the axis is normalized, so that any length other than 0 may be written: "1 1 0 40"
#   is 40 degrees about the diagonal. MuJoCo and Drake 1.51 do that.
# Observed. Pinocchio puts the axis into Rodrigues' formula as it stands. The placement of the joint has determinant
#   2.07 instead of 1: bodies behind it are stretched and sheared, and an inertia becomes another one. There is no
#   error. The same reader normalizes `quat` and `zaxis`.
# Cost. Oblique axes are what thumbs have. Lengths of links change with the pose, which no later step can repair.
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
    file.write("""<mujoco><worldbody><body name="link" axisangle="1 1 0 40"><joint name="j"/>
                  <inertial pos="0 0 0" mass="1" diaginertia="1 2 2.5"/></body></worldbody></mujoco>""")
model = mujoco.MjModel.from_xml_path("hand.xml")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
expected = data.xmat[1].reshape(3, 3)
observed = pinocchio.buildModelFromMJCF("hand.xml").jointPlacements[1].rotation
print("pinocchio", pinocchio.__version__, "mujoco", mujoco.__version__)
print("expected:", expected.round(4).tolist(), "determinant", round(np.linalg.det(expected), 4))
print("observed:", observed.round(4).tolist(), "determinant", round(np.linalg.det(observed), 4))
sys.exit(not (np.isclose(np.linalg.det(expected), 1) and abs(np.linalg.det(observed) - 1) > 0.1))
EOF
