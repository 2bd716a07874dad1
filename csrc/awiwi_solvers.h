/* Bounded solvers: fixed worst-case work, no heap, no recursion; reentrant. */
#ifndef AWIWI_SOLVERS_H
#define AWIWI_SOLVERS_H

#include "real.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Returned by every function that can fail. Kernels without a solver return AWIWI_OK or AWIWI_OUT_OF_DOMAIN. */
enum awiwi_status {
    AWIWI_OK = 0,
    AWIWI_OUT_OF_DOMAIN = 1, /* no result exists there */
    AWIWI_NOT_CONVERGED = 2, /* outputs are the best found within the allowed work */
    AWIWI_NOT_FINITE = 3,    /* an input was not finite; outputs are the clamped start */
    AWIWI_INFEASIBLE = 4     /* limits forbid the demand; outputs are the nearest that they allow */
};

enum { AWIWI_MOST_UNKNOWNS = AWIWI_MOST_JOINTS, AWIWI_MOST_EQUATIONS = AWIWI_MOST_TENDONS }; /* of the hand: real.h */

/* Values [equations] at x [unknowns] and their Jacobian [equations][unknowns], row by row. */
typedef void (*awiwi_model)(const void *context, const awiwi_real *unknowns, awiwi_real *values, awiwi_real *jacobian);

/* A least-squares problem: find unknowns within their limits whose values are nearest to measured ones. */
typedef struct awiwi_problem {
    awiwi_model model;
    const void *context;
    int unknowns;  /* at most AWIWI_MOST_UNKNOWNS */
    int equations; /* at most AWIWI_MOST_EQUATIONS */
    const awiwi_real *low;
    const awiwi_real *high;
} awiwi_problem;

/* Levenberg-Marquardt within the box, from start: at most `iterations` evaluations of the model. Converged when
   no unknown moves by more than `tolerance`. Writes result[unknowns]; returns an awiwi_status. */
int awiwi_least_squares(const awiwi_problem *problem, const awiwi_real *measured, const awiwi_real *start,
                        int iterations, awiwi_real tolerance, awiwi_real *result);

/* Unknowns and the equations that depend on them alone. Its part of the Jacobian is constant if it is linear. */
typedef struct awiwi_part {
    int unknowns;
    const int *unknown;
    int equations;
    const int *equation;
    int linear;
} awiwi_part;

/* The same for a problem that falls into parts, one after the other: at most 1 + parts * (iterations - 1) evaluations
   of the model, none of them for linear parts but the first. Unknowns in no part stay at the start. */
int awiwi_least_squares_in_parts(const awiwi_problem *problem, int parts, const awiwi_part *part,
                                 const awiwi_real *measured, const awiwi_real *start, int iterations,
                                 awiwi_real tolerance, awiwi_real *result);

/* The gradient search of algorithm 1, corrected: exactly `iterations` trials, the first of length `step` times the
   gradient of the squared residual; a trial that does not improve is rejected and halves the step. Step 0 means 2 over
   the sum of the curvatures at the start: it cannot diverge, and is the best fixed step for the worse of two unknowns.
   Writes result[unknowns]; returns an awiwi_status, AWIWI_OK unless an input is not finite. */
int awiwi_gradient_search(const awiwi_problem *problem, const awiwi_real *measured, const awiwi_real *start,
                          int iterations, awiwi_real step, awiwi_real *result);

#ifdef __cplusplus
}
#endif

#endif
