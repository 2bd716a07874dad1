/* Tendon forces of antagonistic pairs: a global optimum by formulas, up to the inversion of the stiffness curve.

   A pair of opposite couplings p, -p gives the torque -p (f1 - f2) and the stiffness (k1 + k2) p p'. So the torque
   tells all differences of forces; what is left is one number for each pair, on which k1 + k2 grows. The stiffness is
   linear in these sums and the limits are a box for them: a convex problem of two sums, for pairs that share joints. */
#include "numerics.h"
#include "awiwi_distribution.h"
#include "dense.h"

typedef awiwi_real vector[AWIWI_MOST_TENDONS];
typedef awiwi_real couple[2];

/* Of every pair: the smaller force goes from 0 to `most` above the limit, and the sum of stiffnesses from least to
   greatest, with these slopes there. */
typedef struct ends {
    vector most, least, greatest, slope_least, slope_greatest;
} ends;

/* The least of x' G x / 2 - c' x in a box, G = (a, b; b, d) positive definite. Where the least of all lies outside,
   one of the sides it lies beyond holds the answer; the other number is then the best for that side. */
static void nearest(awiwi_real a, awiwi_real b, awiwi_real d, const couple c, const couple low, const couple high,
                    couple x)
{
    const awiwi_real determinant = a * d - b * b;
    const couple G = {a, d}, free = {(d * c[0] - b * c[1]) / determinant, (a * c[1] - b * c[0]) / determinant};
    awiwi_real best = AWIWI_REAL_MAX;
    x[0] = free[0];
    x[1] = free[1];
    for (int i = 0; i < 2; i++) {
        const int o = 1 - i;
        couple edge;
        edge[i] = awiwi_clamp(free[i], low[i], high[i]);
        if (edge[i] < free[i] || edge[i] > free[i]) {
            edge[o] = awiwi_clamp((c[o] - b * edge[i]) / G[o], low[o], high[o]);
            const awiwi_real y0 = edge[0] - free[0], y1 = edge[1] - free[1];
            const awiwi_real worse = a * y0 * y0 + 2 * b * y0 * y1 + d * y1 * y1;
            if (worse < best) {
                best = worse;
                x[0] = edge[0];
                x[1] = edge[1];
            }
        }
    }
}

/* For all pairs, x_i in [low_i, high_i] with the least |sum x_i v_i - target|, where v_i is p_i or p_i p_i': the
   products of two such are those of their couplings, or the squares of these. `aim` holds the products with the
   target. */
static void nearest_of_all(const awiwi_tendons *t, int squared, const vector aim, const vector low, const vector high,
                           vector x)
{
    for (int i = 0; i < t->pairs; i++) {
        const int o = t->pair[i].partner;
        const awiwi_real *p = t->coupling + t->pair[i].first * t->joints;
        const awiwi_real *r = t->coupling + t->pair[o].first * t->joints;
        awiwi_real pp = 0, pr = 0, rr = 0;
        if (o < i)
            continue;
        for (int j = 0; j < t->joints; j++) {
            pp += p[j] * p[j];
            pr += p[j] * r[j];
            rr += r[j] * r[j];
        }
        if (squared) {
            pp *= pp;
            pr *= pr;
            rr *= rr;
        }
        if (o == i) {
            x[i] = awiwi_clamp(aim[i] / pp, low[i], high[i]);
        } else {
            const couple c = {aim[i], aim[o]}, least = {low[i], low[o]}, most = {high[i], high[o]};
            couple both;
            nearest(pp, pr, rr, c, least, most, both);
            x[i] = both[0];
            x[o] = both[1];
        }
    }
}

/* Forces whose differences are d and whose smaller ones are x above the lower limit. */
static void place(const awiwi_tendons *t, const vector d, const vector x, awiwi_real *f)
{
    for (int i = 0; i < t->pairs; i++) {
        f[t->pair[i].first] = awiwi_clamp(t->low + x[i] + (d[i] > 0 ? d[i] : 0), t->low, t->high);
        f[t->pair[i].second] = awiwi_clamp(t->low + x[i] - (d[i] < 0 ? d[i] : 0), t->low, t->high);
    }
}

/* The sums of stiffnesses of such forces, and how they grow with x; returns what the curve does. */
static int sums(const awiwi_tendons *t, const vector d, const vector x, awiwi_real *f, vector k, vector slope)
{
    vector each, each_slope, unused;
    place(t, d, x, f);
    const int off = t->curve(t->context, f, each, each_slope, unused);
    for (int i = 0; i < t->pairs; i++) {
        k[i] = each[t->pair[i].first] + each[t->pair[i].second];
        slope[i] = each_slope[t->pair[i].first] + each_slope[t->pair[i].second];
    }
    return off;
}

/* Where a pair's sum of stiffnesses, which the two ends of x in [0, most] tell with its slopes, is about the wanted
   one: a cubic in the sum. */
static awiwi_real guess(const ends *e, int i, awiwi_real wanted)
{
    const awiwi_real rise = e->greatest[i] - e->least[i], u = rise > 0 ? (wanted - e->least[i]) / rise : 1, v = 1 - u;
    const awiwi_real bow = rise * u * v * (v / e->slope_least[i] - u / e->slope_greatest[i]);
    const awiwi_real x = e->most[i] * u * u * (3 - 2 * u) + bow;
    return x >= 0 && x <= e->most[i] ? x : e->most[i];
}

/* x between 0 and most, of all pairs at once, where the sums of stiffnesses are what is wanted: Newton's method, with
   bisection where it leaves the bracket or does not halve what is missing. */
static int invert(const awiwi_tendons *t, const vector d, const ends *e, const vector wanted, awiwi_real tolerance,
                  awiwi_real *f)
{
    const awiwi_real near = tolerance * t->high;
    vector below, above, x, missing, k, slope;
    awiwi_real last = AWIWI_REAL_MAX;
    for (int i = 0; i < t->pairs; i++) {
        below[i] = wanted[i] < e->greatest[i] ? 0 : e->most[i];
        above[i] = wanted[i] > e->least[i] ? e->most[i] : below[i];
        x[i] = awiwi_clamp(guess(e, i, wanted[i]), below[i], above[i]);
        missing[i] = AWIWI_REAL_MAX;
    }
    for (int round = 0; round < AWIWI_MOST_INVERSIONS; round++) {
        awiwi_real longest = 0;
        int bisected = 0;
        if (sums(t, d, x, f, k, slope))
            return AWIWI_OUT_OF_DOMAIN;
        for (int i = 0; i < t->pairs; i++) {
            const awiwi_real here = x[i], excess = k[i] - wanted[i];
            if (excess < 0)
                below[i] = here;
            else
                above[i] = here;
            x[i] = slope[i] > 0 ? here - excess / slope[i] : above[i] + 2 * near;
            if (awiwi_size(x[i] - here) <= near
                || (x[i] >= below[i] && x[i] <= above[i] && awiwi_size(excess) <= missing[i] / 2)) {
                x[i] = awiwi_clamp(x[i], 0, e->most[i]);
            } else {
                x[i] = below[i] + (above[i] - below[i]) / 2;
                bisected = 1;
            }
            missing[i] = awiwi_size(excess);
            longest = awiwi_size(x[i] - here) > longest ? awiwi_size(x[i] - here) : longest;
        }
        if (longest <= near || (!bisected && awiwi_ends_with(longest, last, near))) {
            place(t, d, x, f);
            return AWIWI_OK;
        }
        last = bisected ? AWIWI_REAL_MAX : longest;
    }
    return AWIWI_NOT_CONVERGED;
}

static int distribute_pairs(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                            awiwi_real *f)
{
    const awiwi_real range = t->high - t->low;
    vector aim = {0}, low = {0}, high = {0}, none = {0}, d, wanted;
    ends e;
    for (int i = 0; i < t->pairs; i++) { /* the torque is -sum d_i p_i */
        const awiwi_real *p = t->coupling + t->pair[i].first * t->joints;
        aim[i] = 0;
        low[i] = -range;
        high[i] = range;
        for (int j = 0; j < t->joints; j++)
            aim[i] -= p[j] * tau[j];
    }
    nearest_of_all(t, 0, aim, low, high, d);
    for (int i = 0; i < t->pairs; i++)
        e.most[i] = range - awiwi_size(d[i]);
    if (sums(t, d, none, f, e.least, e.slope_least) || sums(t, d, e.most, f, e.greatest, e.slope_greatest))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < t->pairs; i++) { /* the stiffness is sum of (k_i1 + k_i2) p_i p_i' */
        const awiwi_real *p = t->coupling + t->pair[i].first * t->joints;
        aim[i] = 0;
        for (int j = 0; j < t->joints; j++)
            for (int l = 0; l < t->joints; l++)
                aim[i] += p[j] * K[j * t->joints + l] * p[l];
    }
    nearest_of_all(t, 1, aim, e.least, e.greatest, wanted);
    return invert(t, d, &e, wanted, tolerance, f);
}

/* Whether the forces give the torque, up to rounding. */
static int gives(const awiwi_tendons *t, const awiwi_real *f, const awiwi_real *tau)
{
    for (int j = 0; j < t->joints; j++) {
        awiwi_real missing = tau[j], terms = awiwi_size(tau[j]);
        for (int i = 0; i < t->tendons; i++) {
            missing += t->coupling[i * t->joints + j] * f[i];
            terms += awiwi_size(t->coupling[i * t->joints + j]) * t->high;
        }
        if (!(awiwi_size(missing) <= 16 * AWIWI_REAL_EPSILON * terms))
            return 0;
    }
    return 1;
}

static int all_at(const awiwi_tendons *t, awiwi_real force, awiwi_real *f)
{
    vector k, slope, curvature;
    for (int i = 0; i < t->tendons; i++)
        f[i] = force;
    return t->curve(t->context, f, k, slope, curvature) == 0;
}

/* The forces where no result can be found: all in the middle of the limits if both are on the curve, all at the lower
   limit if only that is, else zero. Returns the status. */
static int fall_back(const awiwi_tendons *t, int status, awiwi_real *f)
{
    const int ordered = t->low <= t->high && awiwi_all_finite(&t->low, 1) && awiwi_all_finite(&t->high, 1);
    if (ordered && all_at(t, t->high, f) && all_at(t, t->low, f))
        (void)all_at(t, t->low + (t->high - t->low) / 2, f);
    else if (!(t->low >= 0 && t->low <= AWIWI_REAL_MAX && all_at(t, t->low, f)))
        for (int i = 0; i < t->tendons; i++)
            f[i] = 0;
    return status;
}

int awiwi_distribute(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                     awiwi_real *f)
{
    int status = AWIWI_OK;
    if (!awiwi_all_finite(&t->low, 1) || !awiwi_all_finite(&t->high, 1) || !awiwi_all_finite(tau, t->joints) ||
        !awiwi_all_finite(K, t->joints * t->joints) || !awiwi_all_finite(t->coupling, t->tendons * t->joints))
        return fall_back(t, AWIWI_NOT_FINITE, f);
    if (!(t->low <= t->high))
        return fall_back(t, AWIWI_OUT_OF_DOMAIN, f);
    for (int i = 0; i < t->tendons; i++) /* each part of the tendons leaves those of the other alone */
        f[i] = t->low + (t->high - t->low) / 2;
    if (t->pairs > 0)
        status = distribute_pairs(t, tau, K, tolerance, f);
    if (t->searched > 0 && status == AWIWI_OK)
        status = awiwi_search_forces(t, tau, K, tolerance, f);
    if (!awiwi_all_finite(f, t->tendons))
        status = AWIWI_NOT_FINITE;
    if (status == AWIWI_OUT_OF_DOMAIN || status == AWIWI_NOT_FINITE)
        return fall_back(t, status, f);
    return status == AWIWI_OK && !gives(t, f, tau) ? AWIWI_INFEASIBLE : status;
}
