/* Bounded solvers: fixed worst-case work, no heap, no recursion; reentrant. */
#ifndef AWIWI_SOLVERS_H
#define AWIWI_SOLVERS_H

#include "real.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What every function that can fail returns. Kernels return AWIWI_OK or AWIWI_OUT_OF_DOMAIN. */
enum awiwi_status {
    AWIWI_OK = 0,
    AWIWI_OUT_OF_DOMAIN = 1, /* no result exists there */
    AWIWI_NOT_CONVERGED = 2, /* the best found within the allowed work is returned */
    AWIWI_NOT_FINITE = 3,    /* an input was not a number; outputs are the clamped start */
    AWIWI_INFEASIBLE = 4     /* limits forbid what was asked for; the nearest that they allow is returned */
};

enum { AWIWI_MOST_UNKNOWNS = 8, AWIWI_MOST_EQUATIONS = 16 };

/* Values h[m] of the equations at q[n] and their Jacobian P[m][n], row by row. */
typedef void (*awiwi_model)(const void *context, const awiwi_real *q, awiwi_real *h, awiwi_real *P);

/* A least-squares problem: find q within its limits with h(q) nearest to what was measured. */
typedef struct awiwi_problem {
    awiwi_model model;
    const void *context;
    int n; /* unknowns, at most AWIWI_MOST_UNKNOWNS */
    int m; /* equations, at most AWIWI_MOST_EQUATIONS */
    const awiwi_real *low;
    const awiwi_real *high;
} awiwi_problem;

/* Levenberg-Marquardt within the box, from start: at most `iterations` evaluations of the model. Converged when
   no unknown moves by more than `tolerance`. Writes q[n]; returns an awiwi_status. */
int awiwi_least_squares(const awiwi_problem *problem, const awiwi_real *measured, const awiwi_real *start,
                        int iterations, awiwi_real tolerance, awiwi_real *q);

/* The gradient search of algorithm 1, mended: exactly `iterations` trials, the first of length `step` times the
   gradient of the squared residual; a trial that does not improve is not taken, and halves the step. Step 0 stands
   for 2 over the sum of the curvatures at the start: it cannot diverge, and no other fixed step brings the worse of
   two unknowns nearer. Writes q[n]; returns an awiwi_status, AWIWI_OK unless something is not finite. */
int awiwi_gradient_search(const awiwi_problem *problem, const awiwi_real *measured, const awiwi_real *start,
                          int iterations, awiwi_real step, awiwi_real *q);

#ifdef __cplusplus
}
#endif

#endif
