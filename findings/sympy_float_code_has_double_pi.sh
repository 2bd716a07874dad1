#!/bin/sh
# SymPy 1.14.0: single-precision C code keeps pi and its relatives in double.
#
# Expected. With type_aliases={real: float32} the C99 printer writes single precision: 0.1F, sinf, sqrtf. In C, one
#   operand of type double makes the whole operation double.
# Observed. pi, e, sqrt(2), log(2), 1/pi are printed as the macros M_PI, M_E, M_SQRT2, M_LN2, M_1_PI, which are of type
#   double. The compiler adds conversions and double operations; the result is right, the cost is not.
# Cost. A Cortex-M4F has no double arithmetic: each of these operations is a library call instead of one instruction,
#   on the control path of firmware that was meant to have none.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check sympy==1.14.0 mpmath==1.3.0

venv/bin/python - <<'EOF'
import subprocess
import sys

import sympy
from sympy import E, Rational, ccode, log, pi, sin, sqrt, symbols
from sympy.codegen.ast import float32, real

x = symbols("x", real=True)
single = ccode(sin(x) * Rational(1, 3) + x / pi + E * x + sqrt(2) + log(2), type_aliases={real: float32})
with open("single.c", "w") as file:
    file.write(f"""#define _GNU_SOURCE
#include <math.h>
float f(float x) {{ return {single}; }}
""")
run = subprocess.run(["cc", "-Wdouble-promotion", "-c", "single.c"], check=True, capture_output=True, text=True)
observed = run.stderr.count("[-Wdouble-promotion]")
print("sympy", sympy.__version__)
print("code:", single)
print("double operations: expected 0, observed", observed, "warnings of implicit promotion")
sys.exit(not (observed > 0 and "sinf" in single and "M_E" in single and "M_SQRT2" in single))
EOF
