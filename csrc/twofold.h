/* Numbers of twice the digits, as unevaluated sums of two, by error-free transformations (Dekker, Knuth). They need
   arithmetic in the declared type, and hold with and without contraction to fused multiply-add. Not part of the firmware
   interface. */
#ifndef AWIWI_TWOFOLD_H
#define AWIWI_TWOFOLD_H

#include "bits.h"

/* high + low, of which high is the nearest number. */
typedef struct awiwi_twofold {
    awiwi_real high, low;
} awiwi_twofold;

/* a + b where |a| is not less than |b|, or a is 0. */
static inline awiwi_twofold awiwi_joined(awiwi_real a, awiwi_real b)
{
    const awiwi_real sum = a + b;
    const awiwi_twofold x = {sum, b - (sum - a)};
    return x;
}

static inline awiwi_twofold awiwi_twofold_add(awiwi_twofold x, awiwi_twofold y)
{
    const awiwi_real sum = x.high + y.high, part = sum - x.high;
    const awiwi_real lost = (x.high - (sum - part)) + (y.high - part);
    return awiwi_joined(sum, lost + (x.low + y.low));
}

/* The upper half of a's digits, rounded, so that what is left of a has as few; products of such halves are exact. */
static inline awiwi_real awiwi_half(awiwi_real a)
{
    const awiwi_bits one = 1;
    awiwi_bits b;
    memcpy(&b, &a, sizeof b);
    b += one << (AWIWI_HALF_BITS - 1);
    b = b >> AWIWI_HALF_BITS << AWIWI_HALF_BITS;
    memcpy(&a, &b, sizeof a);
    return a;
}

/* A number as a sum of two that have half the digits each. */
typedef struct awiwi_halves {
    awiwi_real upper, lower;
} awiwi_halves;

static inline awiwi_halves awiwi_split(awiwi_real a)
{
    const awiwi_real upper = awiwi_half(a);
    const awiwi_halves x = {upper, a - upper};
    return x;
}

/* The product without rounding. The four products of halves are exact, and so are the sum of the middle two, which are
   multiples of the same power of two and as short, and the sum of the last with what the first two leave. No other
   product is formed, for a compiler could fuse it with a sum; to fuse these changes nothing. */
static inline awiwi_twofold awiwi_product_of_halves(awiwi_halves a, awiwi_halves b)
{
    const awiwi_twofold x = awiwi_joined(a.upper * b.upper, a.upper * b.lower + a.lower * b.upper);
    return awiwi_joined(x.high, x.low + a.lower * b.lower);
}

static inline awiwi_twofold awiwi_exact_product(awiwi_real a, awiwi_real b)
{
    return awiwi_product_of_halves(awiwi_split(a), awiwi_split(b));
}

static inline awiwi_twofold awiwi_twofold_multiply(awiwi_twofold x, awiwi_twofold y)
{
    const awiwi_twofold p = awiwi_exact_product(x.high, y.high);
    return awiwi_joined(p.high, p.low + (x.high * y.low + x.low * y.high));
}

static inline awiwi_twofold awiwi_twofold_of(awiwi_real a)
{
    const awiwi_twofold x = {a, 0};
    return x;
}

static inline awiwi_twofold awiwi_twofold_minus(awiwi_twofold x)
{
    const awiwi_twofold y = {-x.high, -x.low};
    return y;
}

static inline awiwi_twofold awiwi_twofold_divide(awiwi_twofold x, awiwi_real d)
{
    const awiwi_real first = x.high / d;
    const awiwi_twofold left = awiwi_twofold_add(x, awiwi_twofold_minus(awiwi_exact_product(first, d)));
    return awiwi_joined(first, (left.high + left.low) / d);
}

#endif
