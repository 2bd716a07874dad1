#!/bin/sh
# CasADi 3.8.2: the macro that shall keep the symbols of two generated files apart gives both the same name.
#
# Expected. Each generated file says how to prefix its internal symbols: compile with -DCASADI_CODEGEN_PREFIX=left_, and
#   the helper functions are called left_fabs and so on. Two files with two prefixes link into one program.
# Observed. The file tests CASADI_CODEGEN_PREFIX, but then pastes CODEGEN_PREFIX, which nobody defined. Whatever the
#   prefix, the helper is called CODEGEN_PREFIXfabs, and the linker refuses the second file ("multiple definition").
#   Without the macro the name of the file is the prefix, and the two files link: the remedy is the illness.
# Cost. Two fingers generated into files of the same name, in two folders, can be linked neither with nor without it.
#   Defining both macros, -DCASADI_CODEGEN_PREFIX -DCODEGEN_PREFIX=left_, works.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check casadi==3.8.2 numpy==2.4.6

venv/bin/python - <<'EOF'
import casadi

q = casadi.SX.sym("q")
for name in ("left", "right"):
    casadi.Function(name, [q], [casadi.fabs(q)]).generate(name + ".c")
EOF
for name in left right; do
    cc -c "$name.c" -o "$name.o"
    cc -c -DCASADI_CODEGEN_PREFIX="${name}_" "$name.c" -o "$name.prefixed.o"
done
helpers() { nm "$@" | awk '$2 == "T" && /fabs/ { print $3 }' | tr '\n' ' '; }

cc -shared left.o right.o -o without.so && without=yes || without=no
cc -shared left.prefixed.o right.prefixed.o -o with.so 2>log && with=yes || with=no
echo "helpers, expected: left_fabs right_fabs"
echo "helpers, observed: $(helpers left.prefixed.o right.prefixed.o)"
echo "link with prefixes, expected: yes, observed: $with (without: $without)"
grep 'multiple definition' log | head -n 1 | sed 's/.*multiple/multiple/'
test "$without $with" = "yes no" && grep -q 'multiple definition of .CODEGEN_PREFIXfabs' log
