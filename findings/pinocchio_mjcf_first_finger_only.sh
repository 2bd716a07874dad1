#!/bin/sh
# Pinocchio 4.1.0 reading MJCF: only the first body below the world is read.
#
# Expected. `worldbody` may have any number of bodies. A hand without a modelled palm is written as one body for each
#   finger. MuJoCo and Drake build all of them. A reader that cannot must say so.
# Observed. `buildModelFromMJCF` returns a model of the first finger. No error, no warning, nothing in the log; with one
#   more body around them (a palm) both fingers are there.
# Cost. Four of five fingers are gone; whoever compares "all joints of the model" compares one finger and passes.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check pin==4.1.0 libpinocchio==4.1.0 mujoco==4.0.0 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys

import mujoco
import pinocchio

finger = '<body name="{0}"><joint name="{0}_flexion"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
fingers = finger.format("index") + finger.format("middle")
joints = {}
for case, bodies in (("fingers on the world", fingers), ("fingers on a palm", f"<body>{fingers}</body>")):
    with open("hand.xml", "w") as file:
        file.write(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    mj, pin = mujoco.MjModel.from_xml_path("hand.xml"), pinocchio.buildModelFromMJCF("hand.xml")
    joints[case] = [mj.joint(i).name for i in range(mj.njnt)], list(pin.names)[1:]
    print(f"{case}: expected (mujoco {mujoco.__version__}) {joints[case][0]}")
    print(f"{case}: observed (pinocchio {pinocchio.__version__}) {joints[case][1]}")
both = ["index_flexion", "middle_flexion"]
sys.exit(joints != {"fingers on the world": (both, both[:1]), "fingers on a palm": (both, both)})
EOF
