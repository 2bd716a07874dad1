#!/bin/sh
# MuJoCo 4.0.0: the force limit of a tendon limits the motor's force before the gear, that of a joint after it.
#
# Expected. `actuatorfrcrange` of a tendon is documented as the range of the total actuator force on the tendon. The
#   attribute of the same name on a joint limits the generalized force, which contains the gear ratio.
# Observed. For a tendon the sum of the scalar actuator forces is clamped and multiplied by each gear afterwards.
#   With a limit of 10 N and a gear of 50 the tendon pulls 500 N; two motors with different gears may add up to
#   thousands of newtons while their sum of scalar forces, and the sensor `tendonactuatorfrc`, read 0. On a
#   joint the same numbers give 10 N m. Nothing is reported.
# Cost. The breaking force of a tendon (the natural reading) is exceeded by the gear ratio: a simulated hand holds
#   what the real one tears, and the sensor confirms the wrong number.
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


def run(limited, motors, controls, arm):
    """Return (force that acts, sensor) for motors with a gear on a tendon or a joint limited to 10."""
    joint_limit = 'actuatorfrcrange="-10 10"' if limited == "joint" else ""
    tendon_limit = 'actuatorfrcrange="-10 10"' if limited == "tendon" else ""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0"/>
      <worldbody><body><joint name="it" axis="0 0 1" {joint_limit}/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
      <tendon><fixed name="tendon" {tendon_limit}><joint joint="it" coef="{arm}"/></fixed></tendon>
      <actuator>{"".join(f'<motor {limited}="{"it" if limited == "joint" else "tendon"}" gear="{g}"/>' for g in motors)}
      </actuator>
      <sensor><{limited}actuatorfrc {limited}="{"it" if limited == "joint" else "tendon"}"/></sensor>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[:] = controls
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator[0] / (arm if limited == "tendon" else 1), data.sensordata[0]


print("mujoco", mujoco.__version__)
print("limit 10, one motor of gear 50 with control 100; and motors of gears 50 and 1 with controls 100 and -100")
joint = run("joint", [50], [100], 1.0)
one = run("tendon", [50], [100], 0.01)
two = run("tendon", [50, 1], [100, -100], 0.01)
print("on a joint     : torque  %6.0f, sensor %g" % joint)
print("expected tendon: tension %6.0f, sensor %g" % (10, 10))
print("observed tendon: tension %6.0f, sensor %g" % one)
print("observed, two  : tension %6.0f, sensor %g" % two)
sys.exit(not (np.allclose(joint, (10, 10)) and np.allclose(one, (500, 10)) and np.allclose(two, (4900, 0))))
EOF
