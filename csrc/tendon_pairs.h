/* Antagonistic pairs of tendons: what the general solver shares with the straight lines that are generated for a finger.
   Not part of the firmware interface. */
#ifndef AWIWI_TENDON_PAIRS_H
#define AWIWI_TENDON_PAIRS_H

#include "awiwi_distribution.h"
#include "dense.h"

/* What has to be inlined for loops to become vectors, and what must not add its frame to that of a search. */
#if defined(__GNUC__)
#define AWIWI_INLINED static inline __attribute__((always_inline))
#define AWIWI_APART static __attribute__((noinline))
#else
#define AWIWI_INLINED static inline
#define AWIWI_APART static
#endif

typedef awiwi_real awiwi_couple[2];

/* The sum of a pair's stiffnesses, and its derivatives. */
typedef struct awiwi_sum {
    awiwi_real k, slope, curvature;
} awiwi_sum;

/* As awiwi_nearest, with x the least of all, which is outside the box. */
void awiwi_nearest_edge(awiwi_real a, awiwi_real b, awiwi_real d, const awiwi_couple c, const awiwi_couple low,
                        const awiwi_couple high, awiwi_couple x);

/* The x in a box with the least x' G x / 2 - c' x, G = (a, b; b, d) positive definite. */
AWIWI_INLINED void awiwi_nearest(awiwi_real a, awiwi_real b, awiwi_real d, const awiwi_couple c, const awiwi_couple low,
                                 const awiwi_couple high, awiwi_couple x)
{
    const awiwi_real determinant = a * d - b * b;
    x[0] = (d * c[0] - b * c[1]) / determinant;
    x[1] = (a * c[1] - b * c[0]) / determinant;
    if (x[0] < low[0] || x[0] > high[0] || x[1] < low[1] || x[1] > high[1])
        awiwi_nearest_edge(a, b, d, c, low, high, x);
}

/* Halley's step to where the sum of stiffnesses is the wanted one, and by how much curvature changes it. */
AWIWI_INLINED awiwi_real awiwi_halley(awiwi_sum at, awiwi_real wanted, awiwi_real *bend)
{
    const awiwi_real newton = (at.k - wanted) / at.slope;
    *bend = newton * at.curvature / (2 * at.slope);
    return newton / (1 - *bend);
}

/* What is surely more than the next of Halley's steps: they shrink by the third power, down to rounding. */
AWIWI_INLINED awiwi_real awiwi_left(awiwi_real last, awiwi_real step, awiwi_real bend)
{
    const awiwi_real share = step / last, cube = awiwi_size(share * share * share), square = bend * bend;
    const awiwi_real rate = 64 * (cube > square ? cube : square);
    return (rate < 1 ? rate : 1) * awiwi_size(step);
}

/* Whether a torque is missing by rounding only; `sizes` is that of what it is the sum of. */
AWIWI_INLINED int awiwi_is_rounding(awiwi_real missing, awiwi_real wanted, awiwi_real sizes)
{
    return awiwi_size(missing) <= 16 * AWIWI_REAL_EPSILON * (awiwi_size(wanted) + sizes);
}

/* What awiwi_distribute does after the pairs, whose forces are there. */
int awiwi_distribute_others(const awiwi_tendons *tendons, const awiwi_real *torque, const awiwi_real *stiffness,
                            awiwi_real tolerance, const awiwi_real *last, awiwi_real *forces);

#endif
