#!/bin/sh
# Pinocchio 4.1.0 reading MJCF: bodies disappear without a word, if they stand on the world or have no name.
#
# Expected. `worldbody` may have any number of bodies, and the name of a body is optional. A hand without a modelled
#   palm is one body for each finger; many hands name joints only. MuJoCo builds all of them.
# Observed. `buildModelFromMJCF` reads only the first body below the world. Below a palm it reads all bodies that
#   have a name, and drops those that have none, with their joints, masses and everything they carry. No error, no
#   warning. Only a file whose first body has no name is refused, as having no body.
# Cost. Four of five fingers are gone. Whoever compares "all joints of the model" compares one finger, and passes.
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
import pinocchio

INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
index = f'<body name="index"><joint name="index"/>{INERTIA}</body>'
middle = f'<body name="middle"><joint name="middle"/>{INERTIA}</body>'
unnamed = middle.replace('body name="middle"', "body")
files = {
    "two fingers on a palm": (f'<body name="palm">{index}{middle}</body>', ["index", "middle"]),
    "two fingers on the world": (index + middle, ["index"]),
    "second body unnamed": (f'<body name="palm">{index}{unnamed}</body>', ["index"]),
}
same = True
for case, (bodies, known) in files.items():
    with open("hand.xml", "w") as file:
        file.write(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    mj, pin = mujoco.MjModel.from_xml_path("hand.xml"), pinocchio.buildModelFromMJCF("hand.xml")
    expected, observed = [mj.joint(i).name for i in range(mj.njnt)], list(pin.names)[1:]
    print(f"{case}: expected {expected} (mujoco {mujoco.__version__})")
    print(f"{case}: observed {observed} (pinocchio {pinocchio.__version__})")
    same &= expected == ["index", "middle"] and observed == known
sys.exit(not same)
EOF
