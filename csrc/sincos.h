/* Sine and cosine with the same bits on every target. Not part of the firmware interface.
 * The algorithm and its error bound: awiwi_gen/ir/trig.py, docs/trigonometry.md. */
#ifndef AWIWI_SINCOS_H
#define AWIWI_SINCOS_H

#include "bits.h"

/* Three angles are computed as four where the vector unit computes four at once. */
#if defined(__SSE2__) || defined(_M_X64) || defined(__aarch64__) || defined(__VSX__)
#define AWIWI_LANES_OF_THREE 4
#else
#define AWIWI_LANES_OF_THREE 3
#endif

extern const awiwi_sincos_constants awiwi_sincos_table;

typedef struct awiwi_sincos_result {
    awiwi_real sin, cos;
} awiwi_sincos_result;

typedef struct awiwi_sincos2_result {
    awiwi_real sin[2], cos[2];
} awiwi_sincos2_result;

typedef struct awiwi_sincos3_result {
    awiwi_real sin[4], cos[4];
} awiwi_sincos3_result;

typedef struct awiwi_sincos4_result {
    awiwi_real sin[4], cos[4];
} awiwi_sincos4_result;

/* Sine and cosine of x [rad] with the constants of lane i. Only + - * and bit operations. */
static inline awiwi_sincos_result awiwi_sincos_lane(awiwi_real x, const awiwi_sincos_constants *k, int i)
{
    const awiwi_real shifted = x * k->quarters[i] + k->integer[i]; /* the quadrant in the last bits */
    const awiwi_real n = shifted - k->integer[i];
    const awiwi_real a = x - n * k->half_pi[0][i], b = n * k->half_pi[1][i], r = a - b;
    const awiwi_real rest = ((a - r) - b) - n * k->half_pi[2][i];
    const awiwi_real split = k->split[i] + (x * k->overflow[i]) * 0; /* NaN outside the domain: infinity times 0 */
    const awiwi_real high = (r + split) - k->split[i];               /* its square and cube are exact */
    const awiwi_real low = (r - high) + rest;
    const awiwi_real z = r * r, square = high * high, gap = low * (high + k->half[i] * low); /* (r^2 - high^2)/2 */
    const awiwi_real zz = z * z, part = k->sixth[i] * square;
    const awiwi_real sine_tail = AWIWI_SINE_TAIL(k, i, z, zz);
    const awiwi_real small = (r * z) * sine_tail + ((rest - low * part) - r * (k->third[i] * gap));
    const awiwi_real sine = r + (small - high * part);
    const awiwi_real cosine_tail = AWIWI_COSINE_TAIL(k, i, z, zz);
    const awiwi_real cosine = (k->one[i] - k->half[i] * square) + (zz * cosine_tail - gap);
    awiwi_bits q, s, c;
    memcpy(&q, &shifted, sizeof q);
    memcpy(&s, &sine, sizeof s);
    memcpy(&c, &cosine, sizeof c);
    const awiwi_bits odd = q << AWIWI_SIGN_BIT, negative = (q >> 1) << AWIWI_SIGN_BIT;
    const awiwi_bits swap = (s ^ c) & (0 - (odd >> AWIWI_SIGN_BIT));
    s ^= swap ^ negative;
    c ^= swap ^ negative ^ odd;
    awiwi_sincos_result result;
    memcpy(&result.sin, &s, sizeof s);
    memcpy(&result.cos, &c, sizeof c);
    return result;
}

/* Sine and cosine of one angle; NaN from AWIWI_SINCOS_LIMIT rad on. */
static inline awiwi_sincos_result awiwi_sincos(awiwi_real x)
{
    static const awiwi_sincos_constants constants = AWIWI_SINCOS_CONSTANTS;
    return awiwi_sincos_lane(x, &constants, 0);
}

/* Sines and cosines of the first `count` angles of x, for which compilers use vector lanes. */
#define AWIWI_SINCOS_LANES(result, x, count) \
    for (int i = 0; i < (count); i++) { \
        const awiwi_sincos_result lane = awiwi_sincos_lane((x)[i], &awiwi_sincos_table, i); \
        (result).sin[i] = lane.sin; \
        (result).cos[i] = lane.cos; \
    }

static inline awiwi_sincos2_result awiwi_sincos2(awiwi_real x0, awiwi_real x1)
{
    const awiwi_real x[2] = {x0, x1};
    awiwi_sincos2_result result;
    AWIWI_SINCOS_LANES(result, x, 2)
    return result;
}

static inline awiwi_sincos3_result awiwi_sincos3(awiwi_real x0, awiwi_real x1, awiwi_real x2)
{
    const awiwi_real x[4] = {x0, x1, x2, x2};
    awiwi_sincos3_result result;
    AWIWI_SINCOS_LANES(result, x, AWIWI_LANES_OF_THREE)
    return result;
}

static inline awiwi_sincos4_result awiwi_sincos4(awiwi_real x0, awiwi_real x1, awiwi_real x2, awiwi_real x3)
{
    const awiwi_real x[4] = {x0, x1, x2, x3};
    awiwi_sincos4_result result;
    AWIWI_SINCOS_LANES(result, x, 4)
    return result;
}

#endif
