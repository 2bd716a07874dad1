/* Arctangent and exponential function with the same bits on every target. Not part of the firmware interface.
 * The algorithms and their errors: awiwi_gen/ir/elementary.py, docs/trigonometry.md. */
#ifndef AWIWI_ELEMENTARY_H
#define AWIWI_ELEMENTARY_H

#include "bits.h"

/* x with the bits of a mask only: its upper half, whose products are exact, or zero, or its magnitude. */
static inline awiwi_real awiwi_masked(awiwi_real x, awiwi_bits mask)
{
    awiwi_bits b;
    memcpy(&b, &x, sizeof b);
    b &= mask;
    memcpy(&x, &b, sizeof b);
    return x;
}

/* x, negated if y has the sign bit. */
static inline awiwi_real awiwi_with_sign(awiwi_real x, awiwi_real y)
{
    awiwi_bits b, c;
    memcpy(&b, &x, sizeof b);
    memcpy(&c, &y, sizeof c);
    b ^= c >> AWIWI_SIGN_BIT << AWIWI_SIGN_BIT;
    memcpy(&x, &b, sizeof b);
    return x;
}

/* Angle of the point (x, y); NaN at infinity, and where both are smaller than every normal number. */
static inline awiwi_real awiwi_atan2(awiwi_real y, awiwi_real x)
{
    const awiwi_bits none = 0, upper = ~none << AWIWI_HALF_BITS, magnitude = ~none >> 1;
    const awiwi_real one = 1, two = 2;
    const awiwi_real u = awiwi_masked(y, magnitude), v = awiwi_masked(x, magnitude);
    const awiwi_real small = u > v ? v : u, big = u > v ? u : v;
    const awiwi_bits is_steep = none - (u > v), is_middle = none - (small > AWIWI_TAN_PI_8 * big);
    const awiwi_real less = awiwi_masked(big, is_middle), more = awiwi_masked(small, is_middle);
    const awiwi_real above = small - less, below = big + more;
    const awiwi_real inverse = one / below;
    const awiwi_real lost = small - (above + less), missed = more - (below - big);
    const awiwi_real r = above / below, z = r * r, zz = z * z; /* |r| <= tan(pi/8) */
    const awiwi_real rh = awiwi_masked(r, upper), rl = r - rh, bh = awiwi_masked(below, upper), bl = below - bh;
    const awiwi_real remainder = (((above - rh * bh) - rh * bl) - rl * bh) - rl * bl;
    const awiwi_real tail = (remainder + (lost - r * missed)) * inverse;
    const awiwi_real series = AWIWI_ATAN_TAIL(z, zz);
    const awiwi_real rest = r * (z * series) + (tail - z * tail);
    const awiwi_real side = awiwi_with_sign(one, x), flat = one - awiwi_masked(two, is_steep);
    const awiwi_real sign = side * flat, middle = awiwi_masked(one, is_middle);
    const awiwi_real quarters = (two - side * (one + flat)) + sign * middle; /* of pi */
    const awiwi_real whole = quarters * AWIWI_PI_4_HIGH, part = sign * r, total = whole + part;
    const awiwi_real lower = quarters * AWIWI_PI_4_LOW + sign * rest;
    return awiwi_with_sign(total + ((part - (total - whole)) + lower), y);
}

/* Arctangent of a finite number. */
static inline awiwi_real awiwi_atan(awiwi_real x)
{
    return awiwi_atan2(x, 1);
}

/* Exponential function; NaN for magnitudes from AWIWI_EXP_LIMIT on. */
static inline awiwi_real awiwi_exp(awiwi_real x)
{
    const awiwi_real one = 1;
    const awiwi_real shifted = (x * AWIWI_EXP_OVERFLOW) * AWIWI_EXP_SHRINK + AWIWI_EXP_INTEGER;
    const awiwi_real n = shifted - AWIWI_EXP_INTEGER;
    const awiwi_real a = x - n * AWIWI_LN2_HIGH, b = n * AWIWI_LN2_LOW, r = a - b;
    const awiwi_real tail = (a - r) - b, whole = one + r, z = r * r;
    const awiwi_real series = AWIWI_EXP_TAIL(r, z);
    const awiwi_real rest = (r - (whole - one)) + (z * series + tail);
    awiwi_bits scale, unit;
    awiwi_real power; /* 2^n */
    memcpy(&scale, &shifted, sizeof scale);
    memcpy(&unit, &one, sizeof unit);
    scale = (scale << AWIWI_FRACTION_BITS) + unit;
    memcpy(&power, &scale, sizeof power);
    return (whole + rest) * power;
}

#endif
