#!/bin/sh
# Drake 1.51.1 reading MJCF: rotor inertia of a joint disappears unless a motor acts on that very joint.
#
# Expected. `armature` is an attribute of the joint: inertia on the diagonal of the mass matrix, whether something
#   drives the joint or not. The reader warns of the attributes it does not support (frictionloss, stiffness).
# Observed. `armature` is stored as rotor inertia of the joint's actuator. If the joint has none, it is dropped; of
#   its relatives it is the one dropped without a warning. Motors that pull tendons count as none.
# Cost. In a tendon-driven hand no motor acts on a joint. All reflected motor inertia is gone: in a finger that is
#   most of the inertia, so that the simulated hand accelerates several times too fast.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check drake==1.51.1 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys

import numpy as np
from pydrake.common import configure_logging
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

configure_logging()


def mass(actuator):
    with open("hand.xml", "w") as file:
        file.write(f"""
<mujoco model="hand">
  <worldbody><body><joint name="j" armature="2" frictionloss="0.1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
  <tendon><fixed name="t"><joint joint="j" coef="0.01"/></fixed></tendon>
  <actuator>{actuator}</actuator>
</mujoco>""")
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels("hand.xml")
    plant.Finalize()
    return plant.CalcMassMatrix(plant.CreateDefaultContext())[0, 0]


observed = {name: mass(f'<motor name="m" {name}="{name[0]}"/>') for name in ("joint", "tendon")}
print("drake 1.51.1; inertia of the link 1, armature 2")
print("expected inertia: motor on the joint 3.0, motor on the tendon 3.0")
print("observed inertia: motor on the joint %.1f, motor on the tendon %.1f" % (observed["joint"], observed["tendon"]))
sys.exit(not np.allclose([observed["joint"], observed["tendon"]], [3, 1]))
EOF
