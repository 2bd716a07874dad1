/* Small dense linear algebra shared by the solvers; matrices are row by row. Not part of the firmware interface. */
#ifndef AWIWI_DENSE_H
#define AWIWI_DENSE_H

#include "real.h"

static inline awiwi_real awiwi_size(awiwi_real x)
{
    return x < 0 ? -x : x;
}

static inline awiwi_real awiwi_clamp(awiwi_real x, awiwi_real low, awiwi_real high)
{
    return x < low ? low : x > high ? high : x;
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

/* Coefficients c[n] of det(s - A) = s^n + c[n-1] s^(n-1) + ... + c[0]. At most four states, here and below. */
void awiwi_characteristic(int n, const awiwi_real *A, awiwi_real *c);

/* Whether all eigenvalues of A have negative real parts. */
int awiwi_is_stable(int n, const awiwi_real *A);

/* Whether some feedback u = -K x makes dx/dt = A x + b u stable. */
int awiwi_is_stabilisable(int n, const awiwi_real *A, const awiwi_real *b);

#endif
