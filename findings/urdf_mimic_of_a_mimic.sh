#!/bin/sh
# URDF in five readers: a joint that mimics a joint that mimics a joint.
#
# Expected. `mimic` gives value = multiplier * (value of the other joint) + offset. Nothing in the format forbids that
#   the other joint mimics too: a coupled finger is written so (distal follows middle, middle follows proximal).
# Observed, for one valid file. urchin 0.0.30 leaves the last joint at 0 without a word. yourdfpy 0.0.60 takes the
#   value of the middle joint as 0 (and logs so), so that the last joint stands at its bare offset. Pinocchio 4.1.0
#   with mimic=True raises an error about argument sizes. MuJoCo 4.0.0 makes two soft equalities on three
#   independent joints. urdf_parser_py 0.0.4, of ROS, keeps what it reads, but gives None for a multiplier
#   that is not written, where the format says 1.
# Cost. The fingertip stands somewhere else in every tool. Here its direction differs by 2.3 rad.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check \
    yourdfpy==0.0.60 urchin==0.0.30 urdf-parser-py==0.0.4 pin==4.1.0 libpinocchio==4.1.0 mujoco==4.0.0 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys
from math import atan2

import mujoco
import numpy as np
import pinocchio
import urchin
import yourdfpy
from urdf_parser_py.urdf import URDF

INERTIAL = """<inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><axis xyz="0 0 1"/>
  <limit effort="1" velocity="1" lower="-3" upper="3"/>{3}</joint>"""
with open("finger.urdf", "w") as file:
    file.write(f"""<robot name="finger"><link name="palm"/>
  <link name="one">{INERTIAL}</link><link name="two">{INERTIAL}</link><link name="three">{INERTIAL}</link>
  {JOINT.format("proximal", "palm", "one", "")}
  {JOINT.format("middle", "one", "two", '<mimic joint="proximal" multiplier="2" offset="0.1"/>')}
  {JOINT.format("distal", "two", "three", '<mimic joint="middle" multiplier="3" offset="0.2"/>')}</robot>""")


def direction(transform):
    return round(float(atan2(transform[1, 0], transform[0, 0])), 6)


expected = direction(np.array([[np.cos(3.3), 0], [np.sin(3.3), 0]]))  # 0.3 + 0.7 + 2.3, the last as 3 * 0.7 + 0.2
robot = yourdfpy.URDF.load("finger.urdf")
robot.update_cfg({"proximal": 0.3})
in_yourdfpy = direction(robot.get_transform("three", "palm"))
in_urchin = direction(urchin.URDF.load("finger.urdf").link_fk({"proximal": 0.3}, link="three"))
try:
    in_pinocchio = pinocchio.buildModelFromUrdf("finger.urdf", mimic=True).nv
except ValueError as error:
    in_pinocchio = "ValueError: " + str(error).strip().splitlines()[-1]
mj = mujoco.MjModel.from_xml_path("finger.urdf")
with open("finger.urdf") as file:
    shortened = URDF.from_xml_string(file.read().replace(' multiplier="2"', ""))
in_urdf_parser_py = shortened.joint_map["middle"].mimic.multiplier
print("direction of the last link, expected:", expected, "(0.3 + 0.7 + 2.3 rad)")
print("direction of the last link, yourdfpy:", in_yourdfpy, "(0.3 + 0.7 + 0.2)")
print("direction of the last link, urchin  :", in_urchin, "(0.3 + 0.7)")
print("Pinocchio:", in_pinocchio)
print("MuJoCo: joints %d, soft equalities %d" % (mj.nv, mj.neq))
print("urdf_parser_py: multiplier that is not written, expected 1.0, observed", in_urdf_parser_py)
sys.exit(not ((in_yourdfpy, in_urchin, mj.nv, mj.neq, in_urdf_parser_py) == (1.2, 1.0, 3, 2, None)
              and "different sizes" in str(in_pinocchio)))
EOF
