#!/bin/sh
# urchin 0.0.30: a link without inertia weighs a kilogram after the robot is saved.
#
# Expected. `inertial` is optional in URDF; without it a link has no mass and no inertia. Frames of sensors and
#   fingertips are written so. Reading and saving a file keeps the physics.
# Observed. In memory and in the saved file each such link has mass 1 and the unit matrix as inertia, in kg and kg m^2.
# Cost. A phalanx weighs 10 g. One fingertip frame makes the finger a hundred times heavier, and its inertia about a
#   joint about a million times larger.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check urchin==0.0.30 numpy==2.4.6

venv/bin/python - <<'EOF'
import sys
import xml.etree.ElementTree as ET

import urchin

with open("finger.urdf", "w") as file:
    file.write("""<robot name="finger"><link name="palm"/>
  <link name="phalanx"><inertial><mass value="0.01"/>
    <inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fingertip_frame"/>
  <joint name="flexion" type="revolute"><parent link="palm"/><child link="phalanx"/><axis xyz="0 0 1"/>
    <limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
  <joint name="tip" type="fixed"><parent link="phalanx"/><child link="fingertip_frame"/></joint></robot>""")
urchin.URDF.load("finger.urdf").save("saved.urdf")
observed = {
    link.get("name"): [(m.get("value"), link.find("inertial/inertia").get("izz")) for m in link.iter("mass")]
    for link in ET.parse("saved.urdf").iter("link")
}
print("expected mass, izz of fingertip_frame: []")
print("observed mass, izz of fingertip_frame:", observed["fingertip_frame"])
print("total mass: expected 0.01, observed", sum(float(mass) for link in observed.values() for mass, _ in link))
sys.exit(observed["fingertip_frame"] != [("1.0", "1.0")])
EOF
