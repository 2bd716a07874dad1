#!/bin/sh
# MuJoCo 4.0.0: the inertia of a tendon that couples two branches of the tree is only half there.
#
# Expected. The reference says that `armature="m"` of a tendon adds the kinetic energy m v^2 / 2, where v is the
#   rate of the tendon's length. With v = J qd that is the term m J'J in the mass matrix, in all of its elements.
# Observed. If two joints of one tendon are not ancestor and descendant, the element between them stays 0: only
#   the diagonal of m J'J arrives. There is no error and no warning, and mass matrix, kinetic energy and forward
#   dynamics agree with each other, so that no internal check reveals it. Here the joints turn in opposite senses
#   250 times too slowly, and a motion that leaves the tendon's length alone has the inertia of the tendon.
# Cost. A differential, or a motor that pulls two fingers by one tendon, has a reflected rotor inertia on each
#   joint alone. Closed loops tuned on that simulator are tuned for another hand.
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

link = """<body pos="{0} 0 0"><joint name="{1}" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="1" diaginertia=".004 .004 .004"/></body>"""
model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>{link.format(0, "left")}{link.format(1, "right")}</worldbody>
  <tendon><fixed armature="2"><joint joint="left" coef="1"/><joint joint="right" coef="-1"/></fixed></tendon>
</mujoco>""")
data = mujoco.MjData(model)
data.qfrc_applied[:] = [1, 0]
mujoco.mj_forward(model, data)
observed = np.zeros((2, 2))
mujoco.mj_fullM(model, data, observed)

J = np.array([[1.0, -1.0]])
expected = 0.004 * np.eye(2) + 2 * J.T @ J
print("mujoco", mujoco.__version__)
print("expected mass matrix:", expected.tolist())
print("observed mass matrix:", observed.tolist())
print("expected acceleration for torques (1, 0):", np.linalg.solve(expected, [1, 0]).tolist())
print("observed acceleration for torques (1, 0):", data.qacc.tolist())
sys.exit(not (np.allclose(observed, np.diag(np.diag(expected))) and np.allclose(data.qacc, [1 / 2.004, 0])))
EOF
