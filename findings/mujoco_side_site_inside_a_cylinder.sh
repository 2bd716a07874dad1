#!/bin/sh
# MuJoCo 4.0.0: whether a tendon wraps the inside of a cylinder depends on where the side site is along the axis.
#
# Expected. A side site inside the geom asks for an inside wrap: the tendon passes through the cylinder, as through a
#   sheath. A cylinder is the same all along its axis, and wraps take it as endless, so a site 5 mm from the axis of a
#   cylinder of radius 10 mm asks for the same wherever it is along the axis.
# Observed. The site's distance from the cylinder's centre is compared with the radius. A site 5 mm from the axis and
#   12 mm along it lies inside the solid cylinder (of half-length 20 mm), but 13 mm from the centre: the tendon goes
#   round the outside. Nothing is reported.
# Cost. A site moved by a few millimetres along the axis turns a pulley's sheath into its rim: other lengths, and arms
#   of another size and sign.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check mujoco==4.0.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import sys

import mujoco


def length(along):
    """Tendon length [mm] past a cylinder whose side site is 5 mm from the axis, and so far along it [mm]."""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <worldbody>
        <geom name="pulley" type="cylinder" size="0.010 0.020"/>
        <site name="side" pos="0 0.005 {along / 1000}"/>
        <site name="from" pos="-0.020 0.001 0"/>
        <site name="to" pos="0.020 0.001 0"/>
      </worldbody>
      <tendon><spatial name="string">
        <site site="from"/><geom geom="pulley" sidesite="side"/><site site="to"/>
      </spatial></tendon>
    </mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return 1000 * data.ten_length[0]


print("mujoco", mujoco.__version__)
print("length of a string past a cylinder of radius 10 mm; the side site is 5 mm from its axis")
for along in (0, 8, 12, 16):
    print(f"{along:3} mm along the axis: {length(along):.2f} mm")
inside, outside = length(0), length(12)
print(f"expected: {inside:.2f} mm everywhere; observed: {outside:.2f} mm, the outside wrap, beyond 8.7 mm")
sys.exit(not (inside < 40.1 and length(8) == inside and 44 < outside == length(16)))
PYTHON
