/* Tendon forces for a joint torque and a joint stiffness, within limits (chapter 7); bounded work, reentrant. */
#ifndef AWIWI_DISTRIBUTION_H
#define AWIWI_DISTRIBUTION_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    AWIWI_MOST_INVERSIONS = 64,      /* rounds that invert k(f) + k(f + d); smooth springs take 4 */
    AWIWI_MOST_TORQUE_STEPS = 64,    /* of the search for forces that give the torque */
    AWIWI_MOST_STIFFNESS_STEPS = 96, /* and of that for the stiffness, from each of 4 starts */
    AWIWI_MOST_UPDATE_STEPS = 4,     /* of an update, for the torque and what is left for the stiffness */
    AWIWI_MOST_CURVES = 4 + AWIWI_MOST_INVERSIONS + 4 * (1 + AWIWI_MOST_STIFFNESS_STEPS)
};

/* Stiffnesses [tendons] at forces [tendons], and their first two derivatives by the force. Returns 0 unless a force is
   outside the curve. */
typedef int (*awiwi_curve)(const void *context, const awiwi_real *forces, awiwi_real *stiffness, awiwi_real *slope,
                           awiwi_real *curvature);

/* Two tendons with opposite couplings. If two pairs share joints, each is the partner of the other; else a pair is its
   own partner. */
typedef struct awiwi_pair {
    int first, second;
    int partner;
} awiwi_pair;

/* A finger in a pose with coupling P. Joint stiffness K_q = sum k_i p_i p_i' + f_i dP_i with the rows p_i of P
   (eq. 5.12); joint torque -P' f. */
typedef struct awiwi_tendons {
    int joints;                 /* at most AWIWI_MOST_JOINTS */
    int tendons;                /* at most AWIWI_MOST_TENDONS */
    const awiwi_real *coupling; /* P [tendons][joints] */
    const awiwi_real *slope;    /* dP/dq [tendons][joints][joints]; null if the coupling is constant */
    awiwi_curve curve;
    awiwi_curve searched_curve; /* of the tendons in no pair alone, in their order */
    const void *context;
    awiwi_real low, high; /* limits of every force */
    int pairs;
    const awiwi_pair *pair;
    int searched; /* number of tendons in no pair */
    const int *searched_tendons;
} awiwi_tendons;

/* Forces [tendons] within the limits whose torque is nearest to torque[joints] and, among those, whose stiffness is
   nearest to stiffness[joints][joints] in the Frobenius norm. AWIWI_INFEASIBLE where the limits forbid the torque.
   Pairs: the optimum in closed form, up to one inversion of the curve for each. Other tendons: an active-set Newton
   method, from four starts where the first end may not be the nearest; what no small change of forces brings nearer is
   a minimum, but not surely the least. `tolerance` is that of forces, relative to the
   upper limit. The curve is evaluated at most AWIWI_MOST_CURVES times.
   Returns an awiwi_status. After AWIWI_OUT_OF_DOMAIN (a limit is outside the curve, or low > high) and AWIWI_NOT_FINITE
   all forces are equal: in the middle of the limits if both are on the curve, at the lower limit if only that is, else
   zero. Otherwise they are within the limits.
   With `last` forces, as those of the last tick, the search goes on from these, in at most AWIWI_MOST_UPDATE_STEPS steps,
   first for the torque, then for the stiffness: AWIWI_NOT_CONVERGED where more are left for the next update. A minimum
   that is not the least is kept. `last` may be null. */
int awiwi_distribute(const awiwi_tendons *tendons, const awiwi_real *torque, const awiwi_real *stiffness,
                     awiwi_real tolerance, const awiwi_real *last, awiwi_real *forces);

/* The search for the tendons in no pair alone; the forces of the others stay. */
int awiwi_search_forces(const awiwi_tendons *tendons, const awiwi_real *torque, const awiwi_real *stiffness,
                        awiwi_real tolerance, awiwi_real *forces);

/* The same, on from the last forces [tendons]. */
int awiwi_update_forces(const awiwi_tendons *tendons, const awiwi_real *torque, const awiwi_real *stiffness,
                        awiwi_real tolerance, const awiwi_real *last, awiwi_real *forces);

/* Algorithm 2, corrected, for all tendons and for comparison: exactly `rounds` trials in the null space of P', first
   of length `step` times the gradient of |K_q - K|^2 + weight (force outside the limits)^2. The torque is exact, the
   limits may be violated. Returns an awiwi_status. */
int awiwi_gradient_forces(const awiwi_tendons *tendons, const awiwi_real *torque, const awiwi_real *stiffness,
                          int rounds, awiwi_real step, awiwi_real weight, awiwi_real *forces);

#ifdef __cplusplus
}
#endif

#endif
