#!/bin/sh
# SymPy 1.14.0, physics.mechanics: a wrapped pathway pulls where a straight one pushes, for the same force.
#
# Expected. All pathways share one sign: the documentation of `to_loads` says for both classes that a positive force is
#   expansile. Its power is then force times the rate of the length, in a straight line and around a cylinder
#   alike (virtual work).
# Observed. For LinearPathway the power is +F dL/dt, for WrappingPathway -F dL/dt. The rate of the length itself is
#   right in both. A force actuator along a wrapped pathway has the opposite sense of the documented one.
# Cost. A tendon modelled in straight spans and arcs over pulleys pulls in its spans and pushes in its arcs. Torques
#   derived from it have the wrong sign; an energy balance finds it, a check of dimensions does not.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check sympy==1.14.0 mpmath==1.3.0

venv/bin/python - <<'EOF'
import sys

import sympy
from sympy import symbols
from sympy.physics.mechanics import (
    LinearPathway, Point, ReferenceFrame, WrappingCylinder, WrappingPathway, dynamicsymbols,
)

F, r, x, u = symbols("F r x u", positive=True)
q = dynamicsymbols("q")
N = ReferenceFrame("N")
A = N.orientnew("A", "Axis", [q, N.z])
centre, fixed_point = Point("centre"), Point("fixed_point")
fixed_point.set_pos(centre, r * N.x)
for point in (centre, fixed_point):
    point.set_vel(N, 0)


def power_and_length_rate(pathway, start, end):
    end.set_vel(N, end.pos_from(start).dt(N))
    power = sum(load.vector.dot(load.point.vel(N)) for load in pathway.to_loads(F))
    return [sympy.simplify(e.subs(q.diff(), u).subs(q, x)) for e in (power, pathway.extension_velocity)]


slider, on_rim = Point("slider"), Point("on_rim")
slider.set_pos(fixed_point, q * N.x)
on_rim.set_pos(centre, r * A.x)
straight = power_and_length_rate(LinearPathway(fixed_point, slider), fixed_point, slider)
wrapped = power_and_length_rate(WrappingPathway(fixed_point, on_rim, WrappingCylinder(r, centre, N.z)), centre, on_rim)
print("sympy", sympy.__version__)
for name, (power, rate) in (("straight", straight), ("wrapped", wrapped)):
    print(f"{name:8} length grows by {rate}; power expected {F * rate}, observed {power}")
sys.exit(not (straight == [F * u, u] and wrapped == [-F * r * u, r * u]))
EOF
