#!/bin/sh
# gcc 12.2 on x86-64: -ffp-contract=off still fuses a multiplication with an addition when it vectorizes.
#
# Expected. The manual says that -ffp-contract=off disables contraction: a*b + c*d is rounded three times, with or
#   without an FMA unit. Results do not depend on the processor. The compiler obeys for scalars and for loops.
# Observed. Two statements that subtract and add products (a rotation in the plane, a complex product) become one
#   vfmaddsub instruction, which rounds less often. At -O2, where gcc 12 began to vectorize, a function of two
#   lines is enough. -fno-tree-slp-vectorize avoids it; clang 14 does not do it.
# Cost. A rotation by sine and cosine is the commonest statement of kinematics code. Its bits differ between -O1 and
#   -O2, and between machines with and without FMA, in a build whose flags promise that they do not.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
apt-get download gcc-12=12.2.0-14+deb12u1 cpp-12=12.2.0-14+deb12u1 >log 2>&1 || { cat log; exit 2; }
for package in *.deb; do dpkg-deb -x "$package" root; done
gcc=root/usr/bin/x86_64-linux-gnu-gcc-12

cat > rotate.c <<'EOF'
void rotate(const double *restrict p, double c, double s, double *restrict r)
{
    r[0] = c * p[0] - s * p[1];
    r[1] = s * p[0] + c * p[1];
}
EOF
fused() { "$gcc" -std=c99 -mfma -ffp-contract=off -S -o - "$@" rotate.c | grep -c 'vfn\?m\(add\|sub\)' || true; }

"$gcc" --version | head -n 1
first=$(fused -O1) second=$(fused -O2) third=$(fused -O3) without=$(fused -O3 -fno-tree-slp-vectorize)
echo "fused instructions, expected: 0 at -O1, 0 at -O2, 0 at -O3"
echo "fused instructions, observed: $first at -O1, $second at -O2, $third at -O3; $without with -fno-tree-slp-vectorize"
"$gcc" -std=c99 -mfma -ffp-contract=off -O2 -S -o - rotate.c | grep vfm
test "$first $second $third $without" = "0 1 1 0"
