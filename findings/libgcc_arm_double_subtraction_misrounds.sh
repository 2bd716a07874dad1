#!/bin/sh
# libgcc of GCC 12.2 for ARM: subtraction of doubles in software rounds to the wrong neighbour where exponents differ by 33.
#
# Expected. __aeabi_dsub and __aeabi_dadd round to nearest, as IEEE 754 and the processor's own units do.
# Observed. 1 - x for x between 2^-33 and 2^-32 comes out up to 0.99 units of the last place off in half of all cases
#   (other exponents: always right). The last 32 bits of the smaller operand are folded into one sticky bit below the
#   guard bit, although the result, being below 1, is shifted left by one and the first of them is what rounding needs.
#   The Thumb-2 code of Cortex-M0 to M4 is made of the same source.
# Cost. cos(x) of small angles is 1 - x^2/2: for angles of 15 to 22 microradians and everything computed from them, a
#   Cortex-M without a unit for doubles gives other bits than a Cortex-M7, an x86-64 or an aarch64. Tests with random
#   operands hardly meet it: the larger operand has to be a power of two.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
cat >subtract.c <<'EOF'
#include <stdint.h>
#include <stdio.h>

int main(void)
{
    unsigned wrong[64] = {0};
    uint64_t state = 1;
    for (int exponent = 2; exponent < 55; exponent++)
        for (int i = 0; i < 1000; i++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            union { uint64_t bits; double value; } x = {(uint64_t)(1023 - exponent) << 52 | state >> 12};
            const uint64_t significand = (x.bits & (((uint64_t)1 << 52) - 1)) | (uint64_t)1 << 52;
            volatile double one = 1;
            union { double value; uint64_t bits; } found = {one - x.value};
            /* the same in integers: 1 - x in units of 2^-53 is 2^53 - significand / 2^(exponent - 1), to nearest */
            const uint64_t half = (uint64_t)1 << (exponent - 2);
            const uint64_t expected = ((uint64_t)1 << 53) - ((significand + half) >> (exponent - 1));
            if ((significand & (2 * half - 1)) == half) /* a tie */
                continue;
            const uint64_t got = (found.bits & (((uint64_t)1 << 52) - 1)) | (uint64_t)1 << 52;
            if (found.bits >> 52 == 1022 && got != expected)
                wrong[exponent]++;
        }
    for (int exponent = 2; exponent < 55; exponent++)
        if (wrong[exponent])
            printf("2^-%d: %u ", exponent, wrong[exponent]);
    printf("\n");
    return 0;
}
EOF
# From Debian 12: apt-get install gcc gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-user
gcc -O1 subtract.c -o here
arm-none-eabi-gcc -march=armv5te -marm -O1 --specs=rdimon.specs subtract.c -o there
version=$(arm-none-eabi-gcc -dumpfullversion)
expected=$(./here)
observed=$(qemu-arm -cpu arm926 ./there)
echo "arm-none-eabi-gcc $version: wrong of 1000 differences 1 - x, by the exponent of x"
echo "expected, and so on x86-64: none$expected"
echo "observed: $observed"
case $observed in "2^-33: "*) ;; *) exit 1 ;; esac
[ -z "$(echo $expected)" ]
