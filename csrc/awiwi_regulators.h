/* Optimal gains in bounded time: fixed worst-case work, no heap, no recursion; reentrant. */
#ifndef AWIWI_REGULATORS_H
#define AWIWI_REGULATORS_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { AWIWI_MOST_STATES = 4 };

/* Gains K[n] of u = -K x for dx/dt = A x + b u that minimise the integral of x'Q x + R u^2, and the least cost x'S x:
   S is the stabilising solution of S A + A'S - S b b'S/R + Q = 0. Arrays are row by row, n is at most
   AWIWI_MOST_STATES, only the symmetric part of Q counts. Starts from poles that a polynomial tells, if there are four
   states, then from at most `iterations` doublings in each of at most 3 units of time; refines each start at most 12
   times in double the precision.
   `residual` is the largest entry of the left side for the returned S, evaluated in double the precision, relative to
   the largest sum of magnitudes of its terms, both in the solver's balanced coordinates. Returns
   AWIWI_OK             the loop A - b K is stable and K is the optimum's but for its last digit;
   AWIWI_OUT_OF_DOMAIN  R is not positive, Q is not positive semidefinite, (A, b) is not stabilisable or (A, Q) is not
                        detectable;
   AWIWI_NOT_CONVERGED  no such loop was found: K, S and their residual are the best found, perhaps zero; or they
                        overflow, and are zero;
   AWIWI_NOT_FINITE     an input is not finite.
   After AWIWI_OUT_OF_DOMAIN and AWIWI_NOT_FINITE, K and S are zero and the residual is 1. */
int awiwi_riccati(int states, const awiwi_real *plant, const awiwi_real *input, const awiwi_real *state_cost,
                  awiwi_real input_cost, int iterations, awiwi_real *gains, awiwi_real *cost, awiwi_real *residual);

/* A motor that drives a link through a spring: inertias, stiffness and viscous frictions. */
typedef struct awiwi_joint {
    awiwi_real link, motor, spring, link_friction, motor_friction;
} awiwi_joint;

/* The same for that joint and Q = diag(state_cost[4]), state (q, dq/dt, theta, dtheta/dt), at a fraction of the work.
   `last` are gains to start from; from any finite gains at most `iterations` steps converge. Unless AWIWI_OK is
   returned, the gains are `last`, or zero if those are not finite. AWIWI_OUT_OF_DOMAIN: a parameter has the wrong sign;
   AWIWI_NOT_CONVERGED: the precision does not suffice. */
int awiwi_joint_gains(const awiwi_joint *joint, const awiwi_real *state_cost, awiwi_real input_cost,
                      const awiwi_real *last, int iterations, awiwi_real *gains);

/* Gains (K_p, K_d, K_3, K_4) of the impedance law that amount to feedback[4] of a joint whose spring's torque is
   cancelled, all numbers positive: plant (m, b, k), weights (C_t, C_s). At most 10 steps of Newton's method in one unknown
   from start[4], whose order of roots is kept. Returns 0 unless it converged; gains may have any sign. */
int awiwi_law_gains(const awiwi_real *feedback, const awiwi_real *plant, const awiwi_real *weights,
                    const awiwi_real *start, awiwi_real *gains);

/* Returns the status, or AWIWI_NOT_FINITE after setting torques[count] to zero if one of them is not finite. */
int awiwi_refuse(int status, awiwi_real *torques, int count);

#ifdef __cplusplus
}
#endif

#endif
