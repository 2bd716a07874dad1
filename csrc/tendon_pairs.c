/* Tendon forces of antagonistic pairs: a global optimum by formulas, up to the inversion of the stiffness curve.

   A pair of opposite couplings p, -p gives the torque -p (f1 - f2) and the stiffness (k1 + k2) p p'. So the torque
   tells all differences of forces; what is left is one number for each pair, on which k1 + k2 grows. The stiffness is
   linear in these sums and the limits are a box for them: a convex problem of two sums, for pairs that share joints. */
#include "numerics.h"
#include "tendon_pairs.h"

enum { MOST_PAIRS = (AWIWI_MOST_TENDONS + 1) / 2 };

typedef awiwi_real vector[AWIWI_MOST_TENDONS]; /* of all tendons */
typedef awiwi_real numbers[MOST_PAIRS];         /* of all pairs */
typedef awiwi_couple couple;

/* Stiffnesses of all tendons, and their derivatives by the force. */
typedef struct curves {
    vector k, slope, curvature;
} curves;

/* Of every pair: the tendons with more and with less force, by how much they differ, and up to where the smaller force
   may be above the limit; the sum of stiffnesses at both ends, and its slope. */
typedef struct ends {
    int more[MOST_PAIRS], less[MOST_PAIRS];
    numbers apart, most, least, greatest, slope_least, slope_greatest;
} ends;

/* The products p'p of the couplings of a pair, p'r with its partner's, and r'r of its partner. */
typedef struct products {
    awiwi_real own, mixed, other;
} products;

/* Where the least of all lies outside, one of the sides it lies beyond holds the answer; the other number is then the
   best for that side. */
void awiwi_nearest_edge(awiwi_real a, awiwi_real b, awiwi_real d, const couple c, const couple low, const couple high,
                        couple x)
{
    const couple G = {a, d}, free = {x[0], x[1]};
    awiwi_real best = AWIWI_REAL_MAX;
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

static products multiply(const awiwi_tendons *t, int i)
{
    const awiwi_real *p = t->coupling + t->pair[i].first * t->joints;
    const awiwi_real *r = t->coupling + t->pair[t->pair[i].partner].first * t->joints;
    products x = {0, 0, 0};
    for (int j = 0; j < t->joints; j++) {
        x.own += p[j] * p[j];
        x.mixed += p[j] * r[j];
        x.other += r[j] * r[j];
    }
    return x;
}

/* Of pair i and its partner, x in [low, high] with the least |sum x_i v_i - target|, where v_i is p_i or p_i p_i': the
   products of two such are those of their couplings, or the squares of these. `aim` holds the products with the
   target. */
static void nearest_of_both(const awiwi_pair *pair, int i, products G, const numbers aim, const numbers low,
                            const numbers high, numbers x)
{
    const int o = pair[i].partner;
    if (o == i) {
        x[i] = awiwi_clamp(aim[i] / G.own, low[i], high[i]);
    } else {
        const couple c = {aim[i], aim[o]}, least = {low[i], low[o]}, most = {high[i], high[o]};
        couple found;
        awiwi_nearest(G.own, G.mixed, G.other, c, least, most, found);
        x[i] = found[0];
        x[o] = found[1];
    }
}

/* The curves at forces of which the smaller ones are x above the lower limit; returns what the curve does. */
static int place(const awiwi_tendons *t, const ends *e, const numbers x, awiwi_real *f, curves *c)
{
    for (int i = 0; i < t->pairs; i++) {
        const awiwi_real less = t->low + x[i], more = less + e->apart[i];
        f[e->less[i]] = less > t->high ? t->high : less;
        f[e->more[i]] = more > t->high ? t->high : more;
    }
    return c ? t->curve(t->context, f, c->k, c->slope, c->curvature) : 0;
}

/* The sum of a pair. */
static awiwi_real both(const ends *e, int i, const vector each)
{
    return each[e->more[i]] + each[e->less[i]];
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

/* A step to where the sum of stiffnesses, which exceeds the wanted one, is that: Halley's, or Newton's where curvature
   makes that twice as long or half as short. `bend` becomes by how much curvature changes the step, at least. */
static awiwi_real step(awiwi_real excess, awiwi_real slope, awiwi_real curvature, awiwi_real *bend)
{
    const awiwi_real newton = excess / slope, change = newton * curvature / (2 * slope);
    *bend = awiwi_size(change) > *bend ? awiwi_size(change) : *bend;
    return change < (awiwi_real)0.5 && change > -1 ? newton / (1 - change) : newton;
}

/* x between 0 and most, of all pairs at once, where the sums of stiffnesses are what is wanted, by steps that triple the
   digits; with bisection where they leave the bracket or do not halve what is missing. */
static int invert(const awiwi_tendons *t, const ends *e, const numbers wanted, awiwi_real tolerance, awiwi_real *f)
{
    const awiwi_real near = tolerance * t->high;
    numbers below, above, x, missing;
    awiwi_real last = AWIWI_REAL_MAX;
    for (int i = 0; i < t->pairs; i++) {
        below[i] = wanted[i] < e->greatest[i] ? 0 : e->most[i];
        above[i] = wanted[i] > e->least[i] ? e->most[i] : below[i];
        x[i] = awiwi_clamp(guess(e, i, wanted[i]), below[i], above[i]);
        missing[i] = AWIWI_REAL_MAX;
    }
    for (int round = 0; round < AWIWI_MOST_INVERSIONS; round++) {
        awiwi_real longest = 0, bend = 0;
        int bisected = 0;
        curves here;
        if (place(t, e, x, f, &here))
            return AWIWI_OUT_OF_DOMAIN;
        for (int i = 0; i < t->pairs; i++) {
            const awiwi_real from = x[i], excess = both(e, i, here.k) - wanted[i], size = awiwi_size(excess);
            const awiwi_real slope = both(e, i, here.slope), curvature = both(e, i, here.curvature);
            if (excess < 0)
                below[i] = from;
            else
                above[i] = from;
            awiwi_real to = slope > 0 ? from - step(excess, slope, curvature, &bend) : above[i] + 2 * near;
            if (awiwi_size(to - from) <= near || (to >= below[i] && to <= above[i] && size <= missing[i] / 2)) {
                to = awiwi_clamp(to, 0, e->most[i]);
            } else {
                to = below[i] + (above[i] - below[i]) / 2;
                bisected = 1;
            }
            x[i] = to;
            missing[i] = size;
            longest = awiwi_size(to - from) > longest ? awiwi_size(to - from) : longest;
        }
        const awiwi_real share = longest / last, rate = awiwi_fmax(bend * bend, share * share * share);
        if (longest <= near || (!bisected && last < AWIWI_REAL_MAX && 64 * rate * longest <= near)) {
            (void)place(t, e, x, f, 0);
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
    numbers torque, stiffness, low, high, none, d, wanted;
    products G[MOST_PAIRS];
    curves at;
    ends e;
    for (int i = 0; i < t->pairs; i++) { /* the torque is -sum d_i p_i, the stiffness sum (k_i1 + k_i2) p_i p_i' */
        const awiwi_real *p = t->coupling + t->pair[i].first * t->joints;
        torque[i] = stiffness[i] = none[i] = 0;
        low[i] = -range;
        high[i] = range;
        for (int j = 0; j < t->joints; j++) {
            if (!(awiwi_size(p[j]) > 0))
                continue;
            awiwi_real row = 0;
            torque[i] -= p[j] * tau[j];
            for (int l = 0; l < t->joints; l++)
                row += K[j * t->joints + l] * p[l];
            stiffness[i] += p[j] * row;
        }
    }
    for (int i = 0; i < t->pairs; i++) {
        if (t->pair[i].partner < i)
            continue;
        G[i] = multiply(t, i);
        nearest_of_both(t->pair, i, G[i], torque, low, high, d);
    }
    for (int i = 0; i < t->pairs; i++) {
        const int first = d[i] > 0;
        e.more[i] = first ? t->pair[i].first : t->pair[i].second;
        e.less[i] = first ? t->pair[i].second : t->pair[i].first;
        e.apart[i] = awiwi_size(d[i]);
        e.most[i] = range - e.apart[i];
    }
    if (place(t, &e, none, f, &at))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < t->pairs; i++) {
        e.least[i] = both(&e, i, at.k);
        e.slope_least[i] = both(&e, i, at.slope);
    }
    if (place(t, &e, e.most, f, &at))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < t->pairs; i++) {
        e.greatest[i] = both(&e, i, at.k);
        e.slope_greatest[i] = both(&e, i, at.slope);
    }
    for (int i = 0; i < t->pairs; i++) {
        products squares;
        if (t->pair[i].partner < i)
            continue;
        squares.own = G[i].own * G[i].own;
        squares.mixed = G[i].mixed * G[i].mixed;
        squares.other = G[i].other * G[i].other;
        nearest_of_both(t->pair, i, squares, stiffness, e.least, e.greatest, wanted);
    }
    return invert(t, &e, wanted, tolerance, f);
}

/* Whether the forces give the torque, up to rounding. */
static int gives(const awiwi_tendons *t, const awiwi_real *f, const awiwi_real *tau)
{
    for (int j = 0; j < t->joints; j++) {
        awiwi_real missing = tau[j], sizes = 0;
        const awiwi_real *p = t->coupling + j;
        for (int i = 0; i < t->tendons; i++, p += t->joints) {
            missing += *p * f[i];
            sizes += awiwi_size(*p);
        }
        if (!awiwi_is_rounding(missing, tau[j], sizes * t->high))
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

/* The status, and the forces that go with it. */
static int end(const awiwi_tendons *t, int status, const awiwi_real *tau, awiwi_real *f)
{
    if (!awiwi_all_finite(f, t->tendons))
        status = AWIWI_NOT_FINITE;
    if (status == AWIWI_OUT_OF_DOMAIN || status == AWIWI_NOT_FINITE)
        return fall_back(t, status, f);
    return status == AWIWI_OK && !gives(t, f, tau) ? AWIWI_INFEASIBLE : status;
}

/* The tendons in no pair, with the last forces or without any. */
static int search(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                  const awiwi_real *last, awiwi_real *f)
{
    if (!last)
        return awiwi_search_forces(t, tau, K, tolerance, f);
    return awiwi_all_finite(last, t->tendons) ? awiwi_update_forces(t, tau, K, tolerance, last, f) : AWIWI_NOT_FINITE;
}

int awiwi_distribute_others(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                            const awiwi_real *last, awiwi_real *f)
{
    for (int i = 0; i < t->searched; i++)
        f[t->searched_tendons[i]] = t->low + (t->high - t->low) / 2;
    return end(t, search(t, tau, K, tolerance, last, f), tau, f);
}

int awiwi_distribute(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                     const awiwi_real *last, awiwi_real *f)
{
    int status = AWIWI_OK;
    if (t->joints > AWIWI_MOST_JOINTS || t->tendons > AWIWI_MOST_TENDONS) /* objects of a smaller hand */
        return AWIWI_OUT_OF_DOMAIN;
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
        status = search(t, tau, K, tolerance, last, f);
    return end(t, status, tau, f);
}
