/* Small dense linear algebra shared by the solvers; matrices are row by row. Not part of the firmware interface. */
#ifndef AWIWI_DENSE_H
#define AWIWI_DENSE_H

#include <math.h>

#include "twofold.h"

/* The C library's functions in the scalar type of the build. */
#if AWIWI_REAL_BITS == 64
#define awiwi_sqrt sqrt
#define awiwi_fmax fmax
#define awiwi_frexp frexp
#define awiwi_ldexp ldexp
#else
#define awiwi_sqrt sqrtf
#define awiwi_fmax fmaxf
#define awiwi_frexp frexpf
#define awiwi_ldexp ldexpf
#endif

static inline awiwi_real awiwi_size(awiwi_real x)
{
    return x < 0 ? -x : x;
}

static inline awiwi_real awiwi_clamp(awiwi_real x, awiwi_real low, awiwi_real high)
{
    return x < low ? low : x > high ? high : x;
}

/* Whether Newton's method, after steps of length last and this, is within `near` after this one: errors square, and
   the last two steps tell by how much, with a margin. A first step has no last one, AWIWI_REAL_MAX. */
static inline int awiwi_ends_with(awiwi_real length, awiwi_real last, awiwi_real near)
{
    const awiwi_real share = length / last;
    return last < AWIWI_REAL_MAX && 64 * share * share * length <= near;
}

/* a'b of n numbers, summed from the first on. */
awiwi_real awiwi_dot(const awiwi_real *a, const awiwi_real *b, int n);

/* The largest magnitude among x[n]; not finite if one of them is not. */
awiwi_real awiwi_largest(const awiwi_real *x, int n);

/* Whether x[n] are all numbers and none is infinite. */
int awiwi_all_finite(const awiwi_real *x, int n);

/* C = A B for n x n matrices. */
void awiwi_product(int n, const awiwi_real *A, const awiwi_real *B, awiwi_real *C);

/* Solve A X = B for the n x m matrix X, in place of B; A is used up. Returns 0 if A is singular. */
int awiwi_solve(int n, int m, awiwi_real *A, awiwi_real *B);

/* Solve H x = b by Cholesky's method without roots, for the lower half of H [n][n] in rows of `width`; H is used up.
   Returns the smallest pivot. If that is not above `least`, x is instead a vector with x'H x equal to the pivot. */
awiwi_real awiwi_solve_positive(int n, int width, awiwi_real *H, awiwi_real least, const awiwi_real *b, awiwi_real *x);

/* Whether x'Q x is nowhere negative but for rounding, of a symmetric Q with n up to 4. */
int awiwi_is_semidefinite(int n, const awiwi_real *Q);

/* Coefficients c[n] of det(s - A) = s^n + c[n-1] s^(n-1) + ... + c[0]. At most four states, here and below. */
void awiwi_characteristic(int n, const awiwi_twofold *A, awiwi_twofold *c);

/* Whether all eigenvalues of A have negative real parts. */
int awiwi_is_stable(int n, const awiwi_twofold *A);

/* Whether all modes of A decay that the vectors start[starts][n], at most 4, have no part in: then some feedback
   through b makes dx/dt = A x + b u stable, if they are b; or no motion costs nothing, if A is transposed and they are
   the rows of the costs. */
int awiwi_rest_decays(int n, const awiwi_real *A, int starts, const awiwi_real *start);

#endif
