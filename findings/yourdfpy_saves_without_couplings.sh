#!/bin/sh
# yourdfpy 0.0.60: writing a URDF leaves out the couplings and safety limits that were read.
#
# Expected. The library reads `mimic`, `safety_controller` and `calibration` into its objects, uses the first in its
#   kinematics, and can save the robot. Saving what was read keeps it.
# Observed. The written file has none of the three. It is valid, and says something else: joints that followed others
#   are free. Nothing is reported.
# Cost. Opening a hand to rename a link or to move a mesh unties every coupled finger joint in the saved file.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check yourdfpy==0.0.60 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys

import yourdfpy

with open("finger.urdf", "w") as file:
    file.write("""<robot name="finger"><link name="palm"/><link name="one"/><link name="two"/>
  <joint name="proximal" type="revolute"><parent link="palm"/><child link="one"/><axis xyz="0 0 1"/>
    <limit effort="1" velocity="1" lower="-1" upper="1"/>
    <safety_controller k_velocity="1" k_position="2" soft_lower_limit="-0.5" soft_upper_limit="0.5"/>
    <calibration rising="0.1"/></joint>
  <joint name="distal" type="revolute"><parent link="one"/><child link="two"/><axis xyz="0 0 1"/>
    <limit effort="1" velocity="1" lower="-1" upper="1"/>
    <mimic joint="proximal" multiplier="2" offset="0.1"/></joint></robot>""")
robot = yourdfpy.URDF.load("finger.urdf")
proximal, distal = robot.joint_map["proximal"], robot.joint_map["distal"]
read = [type(part).__name__ for part in (distal.mimic, proximal.safety_controller, proximal.calibration)]
robot.write_xml_file("saved.urdf")
again = yourdfpy.URDF.load("saved.urdf")
print("read:", *read)
print("joints that can be set: expected", robot.actuated_joint_names, "observed", again.actuated_joint_names)
with open("saved.urdf") as file:
    text = file.read()
lost = [tag for tag in ("mimic", "safety_controller", "calibration") if tag not in text]
print("lost: expected [] observed", lost)
sys.exit(not (read == ["Mimic", "SafetyController", "Calibration"]
              and lost == ["mimic", "safety_controller", "calibration"]
              and again.actuated_joint_names == ["proximal", "distal"]))
EOF
