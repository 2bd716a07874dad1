/* Small dense linear algebra shared by the solvers; matrices are row by row. Not part of the firmware interface. */
#ifndef AWIWI_DENSE_H
#define AWIWI_DENSE_H

#include <math.h>

#include "twofold.h"

/* The C library's functions in the scalar type of the build. */
#if AWIWI_REAL_BITS == 64
#define awiwi_sqrt sqrt
#define awiwi_size fabs
#define awiwi_fmax fmax
#define awiwi_frexp frexp
#define awiwi_ldexp ldexp
#else
#define awiwi_sqrt sqrtf
#define awiwi_size fabsf
#define awiwi_fmax fmaxf
#define awiwi_frexp frexpf
#define awiwi_ldexp ldexpf
#endif

/* Before a loop that is short or runs often: gcc unrolls it, wholly where it knows the number of rounds. */
#if defined(__GNUC__) && !defined(__clang__)
#define AWIWI_UNROLLED _Pragma("GCC unroll 8")
#else
#define AWIWI_UNROLLED
#endif

/* Whether x is finite. */
static inline int awiwi_is_number(awiwi_real x)
{
    return x * 0 >= 0;
}

static inline awiwi_real awiwi_clamp(awiwi_real x, awiwi_real low, awiwi_real high)
{
    return x < low ? low : x > high ? high : x;
}

/* Whether Newton's method, after steps of length last and this, is within `near` after this one: errors square, and
   the last two steps tell by how much, with a margin. A first step has no last one, AWIWI_REAL_MAX. Where lengths bend
   in one direction only, the last step may have told nothing: bends of 1/unit are always allowed for. */
static inline int awiwi_ends_with(awiwi_real length, awiwi_real last, awiwi_real near, awiwi_real unit)
{
    const awiwi_real share = length / last;
    return last < AWIWI_REAL_MAX && 64 * share * share * length <= near && length * length <= near * unit;
}

/* a'b of n numbers, summed from the first on. */
static inline awiwi_real awiwi_dot(const awiwi_real *a, const awiwi_real *b, int n)
{
    awiwi_real sum = 0;
    AWIWI_UNROLLED for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* The largest magnitude among x[n]; not finite if one of them is not. */
awiwi_real awiwi_largest(const awiwi_real *x, int n);

/* Whether x[n] are all numbers and none is infinite. */
int awiwi_all_finite(const awiwi_real *x, int n);

/* C = A B for n x n matrices. */
void awiwi_product(int n, const awiwi_real *A, const awiwi_real *B, awiwi_real *C);

enum { AWIWI_MOST_ROWS = AWIWI_MOST_JOINTS > 10 ? AWIWI_MOST_JOINTS : 10 }; /* of a matrix that is factored */

/* Factor A in its place, L below the diagonal and U from it on, by elimination that exchanges rows k and order[k] at
   step k. Returns 0 if A is singular. */
int awiwi_factor(int n, awiwi_real *A, int *order);

/* Solve A X = B for the n x m matrix X, in place of B, with the factors of A. */
void awiwi_substitute(int n, int m, const awiwi_real *A, const int *order, awiwi_real *B);

/* Both; A is used up. Returns 0 if A is singular. */
int awiwi_solve(int n, int m, awiwi_real *A, awiwi_real *B);

/* Solve H x = b by Cholesky's method without roots, for the lower half of H [n][n] in rows of `width`; H is used up.
   Returns the smallest pivot. If that is not above `least`, x is instead a vector with x'H x equal to the pivot. */
awiwi_real awiwi_solve_positive(int n, int width, awiwi_real *H, awiwi_real least, const awiwi_real *b, awiwi_real *x);

/* A number that the rank of a symmetric Q surely has, n up to 4, where x'Q x is nowhere negative but for rounding;
   else -1. */
int awiwi_semidefinite_rank(int n, const awiwi_real *Q);

/* Coefficients c[n] of det(s - A) = s^n + c[n-1] s^(n-1) + ... + c[0]. At most four states, here and below. */
void awiwi_characteristic(int n, const awiwi_real *A, awiwi_real *c);

/* The stable c(s) = s^4 + c[3] s^3 + ... + c[0] with c(s) c(-s) = s^8 - g[3] s^6 + g[2] s^4 - g[1] s^2 + g[0]. Returns
   0 if there is none, or if rounding is in its way. */
int awiwi_stable_factor(const awiwi_real *g, awiwi_real *c);

/* S of the Riccati equation S A + A'S - S b b'S/R + Q = 0 by at most `iterations` doublings, in a unit of time that makes
   `pole` 1; near the geometric mean of the optimal loop's poles they are few. Returns 0 where numbers overflow. */
int awiwi_double_up(int n, const awiwi_real *A, const awiwi_real *b, const awiwi_real *Q, awiwi_real R, awiwi_real pole,
                    int iterations, awiwi_real *S);

/* Whether all eigenvalues of A - b K' have negative real parts, its elements taken with twice the digits. */
int awiwi_is_stable(int n, const awiwi_real *A, const awiwi_real *b, const awiwi_real *K);

/* Whether all modes of A decay that the vectors start[starts][n], at most 4, have no part in: then some feedback
   through b makes dx/dt = A x + b u stable, if they are b; or no motion costs nothing, if A is transposed and they are
   the rows of the costs. */
int awiwi_rest_decays(int n, const awiwi_real *A, int starts, const awiwi_real *start);

#endif
