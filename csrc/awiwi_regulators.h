/* Optimal gains in bounded time: fixed worst-case work, no heap, no recursion; reentrant. */
#ifndef AWIWI_REGULATORS_H
#define AWIWI_REGULATORS_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { AWIWI_MOST_STATES = 4 };

/* Gains K[n] of u = -K x that minimise the integral of x'Q x + R u^2, and S[n][n] with
   x'S x = the least cost from x: the stabilising solution of S A + A'S - S b b'S/R + Q = 0. Arrays are row by row, n
   is at most AWIWI_MOST_STATES, of Q the symmetric part counts. Doubles at most `iterations` times from each of at
   most 3 starts, and refines each at most 12 times with twice the digits.
   `residual` is the largest entry of the left side for the S that is returned, evaluated with twice the digits,
   relative to the largest sum of its terms' magnitudes, both in coordinates that the solver balances. Returns
   AWIWI_OK             the loop A - b K is stable and K is the optimum's but for its last digit;
   AWIWI_OUT_OF_DOMAIN  R is not positive, some motion is rewarded by Q, b cannot stabilise A, or a motion that does not
                        decay costs nothing: (A, Q) is not detectable;
   AWIWI_NOT_CONVERGED  no such loop was found: K, S and their residual are the best there are, perhaps zero; or they
                        are beyond the range of numbers, and zero;
   AWIWI_NOT_FINITE     an input is not a number.
   Where it is neither of the first nor of the third, K and S are zero, and the residual of that is 1. */
int awiwi_riccati(int n, const awiwi_real *A, const awiwi_real *b, const awiwi_real *Q, awiwi_real R, int iterations,
                  awiwi_real *K, awiwi_real *S, awiwi_real *residual);

/* A motor b that drives a link m through a spring k; dq and dtheta are their frictions. */
typedef struct awiwi_joint {
    awiwi_real m, b, k, dq, dtheta;
} awiwi_joint;

/* The same for that joint and Q = diag(q[4]), state (q, dq/dt, theta, dtheta/dt), at a fortieth of the work. `last` are
   gains to start near, any will do: at most `iterations` steps come down to the solution without fail. Where it returns
   anything but AWIWI_OK, K is `last`, or zero if that is not a number. AWIWI_OUT_OF_DOMAIN says that a parameter has
   the wrong sign, AWIWI_NOT_CONVERGED that the digits do not suffice. */
int awiwi_joint_gains(const awiwi_joint *joint, const awiwi_real *q, awiwi_real R, const awiwi_real *last,
                      int iterations, awiwi_real *K);

/* Zero in place of torques u[n] that are not all numbers, and AWIWI_NOT_FINITE; else the status given. */
int awiwi_refuse(int status, awiwi_real *u, int n);

#ifdef __cplusplus
}
#endif

#endif
