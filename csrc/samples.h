/* What the files in batches/ share: kernels over blocks of samples, for hosts. Not part of the firmware interface.
 * Rows hold one element of BLOCK samples each; compilers make vectors of them. */
#ifndef AWIWI_SAMPLES_H
#define AWIWI_SAMPLES_H

#include <stddef.h>

#include "sincos.h"

#if defined(__GNUC__)
#define INLINED static inline __attribute__((always_inline))
#define VECTORS static __attribute__((noinline, flatten))
#define PREFETCH_LINE(x) __builtin_prefetch(x, 1)
#else
#define INLINED static inline
#define VECTORS static
#define PREFETCH_LINE(x) (void)(x)
#endif

/* A vector lane is a sample here, so the angles of one sample are computed one by one. */
INLINED awiwi_sincos2_result awiwi_sincos2_apart(awiwi_real x0, awiwi_real x1)
{
    const awiwi_sincos_result r0 = awiwi_sincos(x0), r1 = awiwi_sincos(x1);
    awiwi_sincos2_result all;
    all.sin[0] = r0.sin;
    all.cos[0] = r0.cos;
    all.sin[1] = r1.sin;
    all.cos[1] = r1.cos;
    return all;
}
#define awiwi_sincos2 awiwi_sincos2_apart

INLINED awiwi_sincos3_result awiwi_sincos3_apart(awiwi_real x0, awiwi_real x1, awiwi_real x2)
{
    const awiwi_sincos_result r0 = awiwi_sincos(x0), r1 = awiwi_sincos(x1), r2 = awiwi_sincos(x2);
    awiwi_sincos3_result all;
    all.sin[0] = r0.sin;
    all.cos[0] = r0.cos;
    all.sin[1] = r1.sin;
    all.cos[1] = r1.cos;
    all.sin[2] = r2.sin;
    all.cos[2] = r2.cos;
    return all;
}
#define awiwi_sincos3 awiwi_sincos3_apart

INLINED awiwi_sincos4_result awiwi_sincos4_apart(awiwi_real x0, awiwi_real x1, awiwi_real x2, awiwi_real x3)
{
    const awiwi_sincos_result r0 = awiwi_sincos(x0), r1 = awiwi_sincos(x1);
    const awiwi_sincos_result r2 = awiwi_sincos(x2), r3 = awiwi_sincos(x3);
    awiwi_sincos4_result all;
    all.sin[0] = r0.sin;
    all.cos[0] = r0.cos;
    all.sin[1] = r1.sin;
    all.cos[1] = r1.cos;
    all.sin[2] = r2.sin;
    all.cos[2] = r2.cos;
    all.sin[3] = r3.sin;
    all.cos[3] = r3.cos;
    return all;
}
#define awiwi_sincos4 awiwi_sincos4_apart

#if defined(__clang__)
#define SAMPLES_ARE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#define LANES_ARE_INDEPENDENT /* it warns of loops that it unrolls instead */
#define UNROLLED _Pragma("clang loop unroll(full)")
#define SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#elif defined(__GNUC__)
#define SAMPLES_ARE_INDEPENDENT _Pragma("GCC ivdep")
#define LANES_ARE_INDEPENDENT SAMPLES_ARE_INDEPENDENT
#define UNROLLED _Pragma("GCC unroll 65534")
#define SHUFFLE(a, b, ...) __builtin_shuffle(a, b, (lanes){__VA_ARGS__})
#else
#define SAMPLES_ARE_INDEPENDENT
#define LANES_ARE_INDEPENDENT
#define UNROLLED
#endif

enum { BLOCK = 16 }; /* samples computed together: a multiple of vectors and of cache lines */

#if defined(__GNUC__)
typedef awiwi_real four __attribute__((vector_size(4 * sizeof(awiwi_real))));
#if AWIWI_REAL_BITS == 64
typedef long long lanes __attribute__((vector_size(4 * sizeof(awiwi_real))));
#else
typedef int lanes __attribute__((vector_size(4 * sizeof(awiwi_real))));
#endif

/* Transposes a 4 x 4 block; the steps are from row to row. */
static inline void transpose_four(const awiwi_real *from, ptrdiff_t from_step, awiwi_real *to, ptrdiff_t to_step)
{
    four a, b, c, d;
    memcpy(&a, from, sizeof a);
    memcpy(&b, from + from_step, sizeof b);
    memcpy(&c, from + 2*from_step, sizeof c);
    memcpy(&d, from + 3*from_step, sizeof d);
    const four even = SHUFFLE(a, b, 0, 4, 2, 6), odd = SHUFFLE(a, b, 1, 5, 3, 7);
    const four evens = SHUFFLE(c, d, 0, 4, 2, 6), odds = SHUFFLE(c, d, 1, 5, 3, 7);
    a = SHUFFLE(even, evens, 0, 1, 4, 5);
    b = SHUFFLE(odd, odds, 0, 1, 4, 5);
    c = SHUFFLE(even, evens, 2, 3, 6, 7);
    d = SHUFFLE(odd, odds, 2, 3, 6, 7);
    memcpy(to, &a, sizeof a);
    memcpy(to + to_step, &b, sizeof b);
    memcpy(to + 2*to_step, &c, sizeof c);
    memcpy(to + 3*to_step, &d, sizeof d);
}
#else
static inline void transpose_four(const awiwi_real *from, ptrdiff_t from_step, awiwi_real *to, ptrdiff_t to_step)
{
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++)
            to[column*to_step + row] = from[row*from_step + column];
}
#endif

/* Copies samples into rows of BLOCK, one row per element; the last of `count` samples fills up the rows. */
static inline void gather(const awiwi_real *x, ptrdiff_t sample, ptrdiff_t element, int size, int count, awiwi_real *rows)
{
    int e = 0;
    if (count == BLOCK && element == 1)
        for (; e + 4 <= size; e += 4)
            for (int i = 0; i < BLOCK; i += 4)
                transpose_four(x + i*sample + e, sample, rows + e*BLOCK + i, BLOCK);
    for (; e < size; e++)
        for (int i = 0; i < BLOCK; i++)
            rows[e*BLOCK + i] = x[(i < count ? i : count - 1)*sample + e*element];
}

/* Copies rows of BLOCK into samples. */
static inline void scatter(const awiwi_real *rows, int size, int count, awiwi_real *x, ptrdiff_t sample, ptrdiff_t element)
{
    int e = 0;
    if (count == BLOCK && element == 1)
        for (int i = 0; i < BLOCK; i += 4)
            for (e = 0; e + 4 <= size; e += 4)
                transpose_four(rows + e*BLOCK + i, BLOCK, x + i*sample + e, sample);
    for (; e < size; e++)
        for (int i = 0; i < count; i++)
            x[i*sample + e*element] = rows[e*BLOCK + i];
}

/* Fetches the cache lines of samples that later blocks write. */
static inline void prefetch(awiwi_real *x, ptrdiff_t sample, int size)
{
    for (int i = 0; i < BLOCK; i++)
        for (int e = 0; e < size; e += (int)(64 / sizeof *x))
            PREFETCH_LINE(x + i*sample + e);
}

/* The steps of a batch file, by parameter: the rows of q_in are at q_in_at, q_in_row apart. They lie in the caller's
 * array where samples are 1 apart, else in the buffer q_in_rows. */
#define EACH_SAMPLE SAMPLES_ARE_INDEPENDENT for (int i_ = 0; i_ < BLOCK; i_++)
#define TAKE(x, size) UNROLLED for (int e_ = 0; e_ < size; e_++) x##_one[e_] = x##_at[e_*x##_row + i_];
#define GIVE(x, size) UNROLLED for (int e_ = 0; e_ < size; e_++) x##_at[e_*x##_row + i_] = x##_one[e_];
#define EACH_BLOCK for (ptrdiff_t first_ = 0, left_ = samples; left_ > 0; first_ += BLOCK, left_ -= BLOCK)
#define COUNT (left_ < BLOCK ? (int)left_ : BLOCK)
#define PLACED(x) (left_ >= BLOCK && x##_sample == 1)
#define AT(x) (PLACED(x) ? x + first_ : x##_rows), (PLACED(x) ? x##_element : BLOCK)
#define GATHER(x, size) \
    if (!PLACED(x) && (x##_sample || !first_)) \
        gather(x + first_*x##_sample, x##_sample, x##_element, size, COUNT, x##_rows);
#define PREFETCH_ROWS(x, size) \
    if (!PLACED(x) && x##_element == 1 && left_ >= 5*BLOCK) \
        prefetch(x + (first_ + 4*BLOCK)*x##_sample, x##_sample, size);
#define SCATTER(x, size) \
    if (!PLACED(x)) \
        scatter(x##_rows, size, COUNT, x + first_*x##_sample, x##_sample, x##_element);

/* Likewise where each lane is a finger: element e of lane i of an array lies at e*LANES + i. */
#define EACH_LANE LANES_ARE_INDEPENDENT for (int i_ = 0; i_ < LANES; i_++)
#define TAKE_LANE(x, size) UNROLLED for (int e_ = 0; e_ < size; e_++) x##_one[e_] = x[e_*LANES + i_];
#define GIVE_LANE(x, size) UNROLLED for (int e_ = 0; e_ < size; e_++) x[e_*LANES + i_] = x##_one[e_];

#endif
