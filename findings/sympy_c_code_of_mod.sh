#!/bin/sh
# SymPy 1.14.0: the C code of Mod has another sign than Mod, for real arguments only.
#
# Expected. Mod(a, b) of SymPy has the sign of b, as in Python. A C printer keeps the value of the expression. For
#   integers it does, with the correction that C's % needs.
# Observed. For reals the printer writes fmod(a, b), which has the sign of a. Mod(-1, 3) is 2, the C gives -1. The
#   Python, NumPy and mpmath printers give 2, so that tests in Python pass.
# Cost. The usual wrap of an angle to [-pi, pi), Mod(q + pi, 2 pi) - pi, is right in Python and leaves the range in
#   firmware for every q below -pi.
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
from sympy import Mod, ccode, lambdify, pi, symbols

q = symbols("q", real=True)
wrapped = Mod(q + pi, 2 * pi) - pi
i, j = symbols("i j", integer=True)
with open("wrap.c", "w") as file:
    file.write(f"""#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
int main(void) {{ const double q = -4.0; printf("%.6f", {ccode(wrapped)}); return 0; }}
""")
subprocess.run(["cc", "wrap.c", "-o", "wrap", "-lm"], check=True)
observed = subprocess.run(["./wrap"], check=True, capture_output=True, text=True).stdout
in_python = f"{lambdify(q, wrapped)(-4.0):.6f}"
print("sympy", sympy.__version__)
print("real   :", ccode(wrapped))
print("integer:", ccode(Mod(i, j)))
print("angle -4 wrapped: expected", f"{float(wrapped.subs(q, -4)):.6f}", "in Python", in_python, "in C", observed)
sys.exit(not (in_python == "2.283185" and observed == "-4.000000" and ccode(Mod(i, j)) == "((i % j) + j) % j"))
EOF
