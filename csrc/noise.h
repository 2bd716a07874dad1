/* Noise and steps of simulated sensors. Not part of the firmware interface. */
#ifndef AWIWI_NOISE_H
#define AWIWI_NOISE_H

#include <stdint.h>

#include "real.h"

/* Random bits that depend on the counter only (a mixer with full avalanche). */
static inline uint32_t awiwi_mixed(uint32_t x)
{
    x = (x ^ (x >> 16)) * UINT32_C(0x7feb352d);
    x = (x ^ (x >> 15)) * UINT32_C(0x846ca68b);
    return x ^ (x >> 16);
}

/* Nearly normal, of variance 1: four uniform numbers of 16 bits each. */
static inline awiwi_real awiwi_normal(uint32_t seed, uint32_t tick, uint32_t sensor)
{
    const uint32_t a = awiwi_mixed(awiwi_mixed(awiwi_mixed(seed + 1) ^ tick) ^ sensor);
    const uint32_t b = awiwi_mixed(a + UINT32_C(0x9e3779b9));
    const uint32_t total = (a >> 16) + (a & 0xffff) + (b >> 16) + (b & 0xffff);
    const awiwi_real root_of_three = (awiwi_real)1.7320508075688772935;
    return root_of_three * ((awiwi_real)total / 65535 - 2);
}

static inline awiwi_real awiwi_rounded(awiwi_real x, awiwi_real step)
{
    const awiwi_real steps = x / step, half = (awiwi_real)0.5;
    if (!(steps > -(awiwi_real)1e9 && steps < (awiwi_real)1e9))
        return x;
    return step * (awiwi_real)(int32_t)(steps < 0 ? steps - half : steps + half);
}

#endif
