#!/bin/sh
# CasADi 3.8.2: C code generated with casadi_real=float calls the double functions of the C library.
#
# Expected. `casadi_real` is the option for the scalar type of the generated code; "float" is for processors with a
#   single-precision unit. Then sin becomes sinf and constants are of type float.
# Observed. Only variables change their type. sin, sqrt, pow and atan2 are called in double, with a conversion before
#   and after; constants are double. On a Cortex-M4F the object calls the conversion routines and the double
#   functions, and the single-precision square root of the processor is not used. There is no warning.
# Cost. Firmware that was generated in float for speed runs its trigonometry in software double, and the numbers are not
#   those of a single-precision analysis.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check casadi==3.8.2 numpy==2.4.6

venv/bin/python - <<'EOF'
import casadi

q = casadi.SX.sym("q", 2)
casadi.Function("pose", [q], [casadi.sin(q[0]) + casadi.sqrt(q[1]) * 0.1]).generate("pose.c", {"casadi_real": "float"})
EOF
# From Debian 12: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi
arm-none-eabi-gcc -std=c99 -O2 -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -c pose.c
observed=$(arm-none-eabi-nm -u pose.o | awk '{ print $2 }' | sort | tr '\n' ' ')
echo "functions called, expected: sinf"
echo "functions called, observed: $observed"
case $observed in *__aeabi_f2d*sin\ sqrt*) ;; *) exit 1 ;; esac
