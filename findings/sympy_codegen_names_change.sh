#!/bin/sh
# SymPy 1.14.0: `codegen` names the output of a matrix after a hash that changes with every run.
#
# Expected. The same expression gives the same C, byte for byte: generated code is kept under version control, signed
#   and cached. SymPy sorts arguments and prints expressions in a canonical order for that reason.
# Observed. A Matrix returned by `codegen` becomes a parameter out_<number>, where the number is Python's hash of the
#   matrix, salted anew in each process. Prototype and body differ from run to run.
# Cost. Each build changes header and source, so that "is the generated code fresh" always says no. Name the result
#   (Eq(MatrixSymbol(...), matrix)), and the text is stable.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
unset PYTHONHASHSEED
venv/bin/pip install --quiet --no-compile --disable-pip-version-check sympy==1.14.0 mpmath==1.3.0

venv/bin/python - <<'EOF'
import subprocess
import sys

import sympy

PROGRAM = """
from sympy import Eq, Matrix, MatrixSymbol, symbols
from sympy.utilities.codegen import codegen
x, y = symbols("x y")
value = Matrix([x, y])
for result in (value, Eq(MatrixSymbol("r", 2, 1), value)):
    print([line for line in codegen(("f", result), "C99")[1][1].splitlines() if line.startswith("void")][0])
"""
runs = [subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True).stdout.splitlines()
        for _ in range(3)]
print("sympy", sympy.__version__)
print("expected: one prototype")
for run in runs:
    print("observed:", run[0])
print("named result:", {run[1] for run in runs})
sys.exit(not (len({run[0] for run in runs}) == 3 and len({run[1] for run in runs}) == 1))
EOF
