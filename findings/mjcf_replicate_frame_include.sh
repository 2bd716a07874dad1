#!/bin/sh
# MJCF in three readers (MuJoCo 4.0.0, Drake 1.51.1, Pinocchio 4.1.0): fingers in `replicate`, `frame` or `include`.
#
# Expected. All three are elements of the format that only say where or how often bodies stand. Each reader either
#   builds the bodies or refuses the file.
# Observed. Drake skips `replicate` and everything in it without a word, and `frame` with a warning. Pinocchio skips
#   all three without a word, `include` too. What remains is a smaller robot that is valid by itself.
# Cost. `replicate` is how one writes several equal fingers: the hand arrives as a palm.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check \
    mujoco==4.0.0 drake==1.51.1 pin==4.1.0 libpinocchio==4.1.0 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys

import mujoco
import pinocchio
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
finger = f'<body name="finger"><joint name="flexion"/>{INERTIA}</body>'
with open("finger.xml", "w") as file:
    file.write(f"<mujocoinclude>{finger}</mujocoinclude>")
ways = {
    "plain": (finger, (2, 2, 2)),
    "replicate": (f'<replicate count="3" euler="0 0 30">{finger}</replicate>', (4, 1, 1)),
    "frame": (f'<frame pos="0 0 1">{finger}</frame>', (2, 1, 1)),
    "include": ('<include file="finger.xml"/>', (2, 2, 1)),
}
same = True
print("mujoco", mujoco.__version__, "drake 1.51.1 pinocchio", pinocchio.__version__)
for way, (text, known) in ways.items():
    with open("hand.xml", "w") as file:
        file.write(f"""<mujoco model="hand"><worldbody><body name="palm"><joint name="wrist"/>{INERTIA}{text}
                       </body></worldbody></mujoco>""")
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels("hand.xml")
    plant.Finalize()
    mj, pin = mujoco.MjModel.from_xml_path("hand.xml"), pinocchio.buildModelFromMJCF("hand.xml")
    observed = mj.nv, plant.num_velocities(), pin.nv
    print(f"{way:9} joints: expected {known[0]} everywhere; observed MuJoCo %d, Drake %d, Pinocchio %d" % observed)
    same &= observed == known
sys.exit(not same)
EOF
