/* Tendon forces for a joint torque and a joint stiffness, within limits (chapter 7); bounded work, reentrant. */
#ifndef AWIWI_DISTRIBUTION_H
#define AWIWI_DISTRIBUTION_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    AWIWI_MOST_JOINTS = 8,
    AWIWI_MOST_TENDONS = 16,
    AWIWI_MOST_INVERSIONS = 64,      /* rounds that invert k(f) + k(f + d); springs that stiffen smoothly take 7 */
    AWIWI_MOST_TORQUE_STEPS = 64,    /* of the search for forces that give the torque, from each of its 3 starts */
    AWIWI_MOST_STIFFNESS_STEPS = 96, /* and of the search for those that also give the stiffness */
    AWIWI_MOST_CURVES = 2 + AWIWI_MOST_INVERSIONS + 3 * (1 + AWIWI_MOST_STIFFNESS_STEPS)
};

/* Stiffnesses k[m] of tendons that pull with f[m], and their first two derivatives by the force. Not 0 where a force
   lies off the curve. */
typedef int (*awiwi_curve)(const void *context, const awiwi_real *f, awiwi_real *k, awiwi_real *slope,
                           awiwi_real *curvature);

/* Two tendons whose couplings are opposite. Pairs that share joints come in twos: each is the other's partner; a
   pair that shares none is its own. */
typedef struct awiwi_pair {
    int first, second;
    int partner;
} awiwi_pair;

/* A finger in a pose. K_q = sum k_i p_i p_i' + f_i dP_i, p_i the rows of P (eq. 5.12); the torque is -P' f. */
typedef struct awiwi_tendons {
    int n;                /* joints, at most AWIWI_MOST_JOINTS */
    int m;                /* tendons, at most AWIWI_MOST_TENDONS */
    const awiwi_real *P;  /* coupling [m][n] */
    const awiwi_real *dP; /* its derivatives [m][n][n]; null where the pose does not change it */
    awiwi_curve curve;
    const void *context;
    awiwi_real low, high; /* limits of every force */
    int pairs;
    const awiwi_pair *pair;
    int searched;        /* how many of the tendons are in no pair */
    const int *searched_tendons;
} awiwi_tendons;

/* Forces f[m] within the limits whose torque is nearest to tau[n] and, of those, whose stiffness is nearest to
   K[n][n] in the Frobenius norm: exactly tau where the limits allow it, else AWIWI_INFEASIBLE. Pairs: the optimum in
   closed form, up to one inversion of the curve for each. Other tendons: an active-set Newton method from three
   starts. `tolerance` is that of forces, relative to the upper limit. The curve is evaluated at most
   AWIWI_MOST_CURVES times. Returns an awiwi_status; the forces are always within limits that are in order. */
int awiwi_distribute(const awiwi_tendons *tendons, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                     awiwi_real *f);

/* What the search finds for the tendons that are in no pair; the forces of the others stay. */
int awiwi_search_forces(const awiwi_tendons *tendons, const awiwi_real *tau, const awiwi_real *K,
                        awiwi_real tolerance, awiwi_real *f);

/* Algorithm 2, mended, for all tendons and for comparison: exactly `rounds` trials in the null space of P', the first
   of length `step` times the gradient of |K_q - K|^2 + weight (what lies outside the limits)^2. The torque is exact,
   the limits are not. Returns an awiwi_status. */
int awiwi_gradient_forces(const awiwi_tendons *tendons, const awiwi_real *tau, const awiwi_real *K, int rounds,
                          awiwi_real step, awiwi_real weight, awiwi_real *f);

#ifdef __cplusplus
}
#endif

#endif
