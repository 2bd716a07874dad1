/* What the search for tendon forces minimises, its derivatives, and the moves that keep the torque. Not part of the
   firmware interface. */
#ifndef AWIWI_TENDON_COST_H
#define AWIWI_TENDON_COST_H

#include "awiwi_distribution.h"
#include "dense.h"

enum { MOST_ENTRIES = AWIWI_MOST_JOINTS * (AWIWI_MOST_JOINTS + 1) / 2 };
enum { AT_LOW = -1, FREE = 0, AT_HIGH = 1 };

typedef awiwi_real vector[AWIWI_MOST_TENDONS];
typedef awiwi_real matrix[AWIWI_MOST_TENDONS][AWIWI_MOST_TENDONS];

/* The place of an entry: of joints a and b in the task's order; `offset` is that in the constants of every tendon. */
typedef struct place {
    int a, b, offset;
} place;

/* The least squares of some entries, each sum k_i p_ia p_ib + f_i constant_i - wanted over the searched tendons: first
   those of the torque, where k is zero, then those of the lower half of the stiffness, where the torque is kept. Joints
   are those that the searched tendons move: no other torque or stiffness is theirs. */
typedef struct task {
    const awiwi_tendons *t;
    int count, joints, entries;
    int joint[AWIWI_MOST_JOINTS];
    awiwi_real p[AWIWI_MOST_TENDONS][AWIWI_MOST_JOINTS]; /* couplings [count][joints] */
    awiwi_real torque[AWIWI_MOST_JOINTS];                /* wanted */
    int keep_torque, within_reach; /* by the limits */
    awiwi_real tolerance;
    awiwi_real times[MOST_ENTRIES], wanted[MOST_ENTRIES];
    place at[MOST_ENTRIES];
    const awiwi_real *constant[AWIWI_MOST_TENDONS];
    int by_chords;      /* whether chords take the place of the curve */
    vector start, rise; /* of the chords: stiffness at the lower limit, and slope */
} task;

/* The cost, half the sum of squares, and what its derivatives are made of. Costs that differ by less than the blur are
   equal. */
typedef struct model {
    awiwi_real cost, blur, excess[MOST_ENTRIES];
    vector slope, curvature; /* of the searched tendons' stiffness */
} model;

/* The moves of the free tendons that keep the torque: each of the loose tendons by itself, while the basic tendons make
   up for its torque, that of joint[r] first of all, basic[r] by -share[r][loose] of the move. Forces give the torque where each row of shares times
   forces is the last number of the row. Without a torque to keep all free tendons are loose. */
typedef struct moves {
    int rank, count;
    int joint[AWIWI_MOST_JOINTS], basic[AWIWI_MOST_JOINTS], loose[AWIWI_MOST_TENDONS];
    awiwi_real share[AWIWI_MOST_JOINTS][AWIWI_MOST_TENDONS + 1];
} moves;

/* By the moves: the downhill slope of the cost and its Hessian as of Gauss and Newton. By the tendons: by how much more
   stiffness raises the cost, and by how much leaving its limit. `bent` is the greatest curvature met so far. */
typedef struct rates {
    int count; /* of moves */
    awiwi_real bent;
    vector downhill, stiffer, price;
    matrix hessian, work; /* the second to solve with */
} rates;

/* -- entries ------------------------------------------------------------------------------------------------------- */

/* Set up for the searched tendons of a finger. */
static void start_task(task *s, const awiwi_tendons *t, const awiwi_real *torque)
{
    s->t = t;
    s->by_chords = 0;
    s->count = t->searched;
    s->joints = s->within_reach = 0;
    for (int j = 0; j < t->joints; j++) {
        int touched = 0;
        for (int i = 0; i < s->count; i++) {
            s->p[i][s->joints] = t->coupling[t->searched_tendons[i] * t->joints + j];
            touched = touched || awiwi_size(s->p[i][s->joints]) > 0;
        }
        s->joint[s->joints] = j;
        s->torque[s->joints] = -torque[j]; /* of P' f */
        s->joints += touched;
    }
}

/* Ask for the torque, up to a relative change of the forces. */
static void want_torque(task *s, awiwi_real tolerance)
{
    s->keep_torque = 0;
    s->tolerance = tolerance;
    s->entries = s->joints;
    for (int a = 0; a < s->joints; a++) {
        s->times[a] = 1;
        s->wanted[a] = s->torque[a];
        s->at[a].a = s->at[a].b = s->at[a].offset = a;
    }
    for (int i = 0; i < s->count; i++)
        s->constant[i] = s->p[i];
}

/* Ask for the stiffness, at the torque that there is. */
static void want_stiffness(task *s, const awiwi_real *K, awiwi_real tolerance)
{
    static const awiwi_real none[AWIWI_MOST_JOINTS * AWIWI_MOST_JOINTS] = {0};
    const int n = s->t->joints;
    s->keep_torque = 1;
    s->tolerance = tolerance;
    s->entries = 0;
    for (int a = 0; a < s->joints; a++) {
        for (int b = 0; b <= a; b++) {
            const int e = s->entries++, row = s->joint[a], column = s->joint[b];
            s->times[e] = a == b ? 1 : 2;
            s->wanted[e] = (K[row * n + column] + K[column * n + row]) / 2;
            s->at[e].a = a;
            s->at[e].b = b;
            s->at[e].offset = row * n + column;
        }
    }
    for (int i = 0; i < s->count; i++)
        s->constant[i] = s->t->slope ? s->t->slope + s->t->searched_tendons[i] * n * n : none;
}

/* -- cost ---------------------------------------------------------------------------------------------------------- */

/* Stiffness k of the searched tendons at forces f, and its derivatives; not 0 outside the curve. */
static int follow_curve(const task *s, const vector f, vector k, model *c)
{
    if (!s->by_chords)
        return s->t->searched_curve(s->t->context, f, k, c->slope, c->curvature);
    for (int i = 0; i < s->count; i++) {
        k[i] = s->start[i] + s->rise[i] * (f[i] - s->t->low);
        c->slope[i] = s->rise[i];
        c->curvature[i] = 0;
    }
    return 0;
}

/* Let chords between the limits take the place of the curve: with them the cost has no other minimum than the least.
   Not 0 where a limit is outside the curve. */
static int take_chords(task *s)
{
    vector low, high, top;
    model unused;
    for (int i = 0; i < s->count; i++) {
        low[i] = s->t->low;
        high[i] = s->t->high;
    }
    if (follow_curve(s, low, s->start, &unused) || follow_curve(s, high, top, &unused))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < s->count; i++)
        s->rise[i] = s->t->high > s->t->low ? (top[i] - s->start[i]) / (s->t->high - s->t->low) : 0;
    s->by_chords = 1;
    return AWIWI_OK;
}

/* The cost at forces f. What is within rounding of its terms counts as zero. */
static int cost(const task *s, const vector f, model *c)
{
    const int count = s->count;
    vector k;
    c->cost = c->blur = 0;
    if (s->keep_torque) {
        if (follow_curve(s, f, k, c))
            return AWIWI_OUT_OF_DOMAIN;
    } else {
        for (int i = 0; i < count; i++)
            k[i] = c->slope[i] = c->curvature[i] = 0;
    }
    for (int e = 0; e < s->entries; e++) {
        const place at = s->at[e];
        awiwi_real excess = -s->wanted[e], terms = awiwi_size(excess);
        for (int i = 0; i < count; i++) {
            const awiwi_real elastic = k[i] * s->p[i][at.a] * s->p[i][at.b];
            const awiwi_real other = f[i] * s->constant[i][at.offset];
            excess += elastic + other;
            terms += awiwi_size(elastic) + awiwi_size(other);
        }
        const awiwi_real rounding = 4 * AWIWI_REAL_EPSILON * terms, size = awiwi_size(excess);
        c->excess[e] = size <= rounding ? 0 : excess;
        c->cost += s->times[e] * c->excess[e] * c->excess[e] / 2;
        c->blur += s->times[e] * rounding * (size + rounding);
    }
    return 0;
}

/* -- moves --------------------------------------------------------------------------------------------------------- */

/* to -= factor from */
static void subtract(int n, awiwi_real factor, const awiwi_real *from, awiwi_real *to)
{
    for (int i = 0; i < n; i++)
        to[i] -= factor * from[i];
}

/* Find the moves by elimination: every joint gets the free tendon that is left with the largest coupling. */
static void split(const task *s, int keep_torque, const int *held, moves *m)
{
    const int count = s->count;
    int left[AWIWI_MOST_TENDONS] = {0}; /* free tendons that are not taken */
    int n = 0;
    for (int i = 0; i < count; i++)
        if (held[i] == FREE)
            left[n++] = i;
    m->rank = 0;
    for (int a = 0; keep_torque && a < s->joints && n > 0; a++) {
        awiwi_real *row = m->share[m->rank], before = 0, most = 0;
        int pivot = 0;
        row[count] = s->torque[a];
        for (int i = 0; i < count; i++) {
            row[i] = s->p[i][a];
            before = held[i] == FREE && awiwi_size(row[i]) > before ? awiwi_size(row[i]) : before;
        }
        for (int r = 0; r < m->rank; r++)
            subtract(count + 1, row[m->basic[r]], m->share[r], row);
        for (int k = 0; k < n; k++) {
            if (awiwi_size(row[left[k]]) > most) {
                most = awiwi_size(row[left[k]]);
                pivot = k;
            }
        }
        if (!(most * most > 64 * AWIWI_REAL_EPSILON * before * before))
            continue;
        const int basic = left[pivot];
        const awiwi_real scale = 1 / row[basic];
        for (int i = 0; i <= count; i++)
            row[i] *= scale;
        for (int r = 0; r < m->rank; r++)
            subtract(count + 1, m->share[r][basic], row, m->share[r]);
        for (n--; pivot < n; pivot++)
            left[pivot] = left[pivot + 1];
        m->joint[m->rank] = a;
        m->basic[m->rank++] = basic;
    }
    m->count = n;
    for (int k = 0; k < n; k++)
        m->loose[k] = left[k];
}

/* How something that grows with each force by v changes as tendon i moves. */
static awiwi_real along(const moves *m, int i, const vector v)
{
    awiwi_real sum = v[i];
    for (int r = 0; r < m->rank; r++)
        sum -= m->share[r][i] * v[m->basic[r]];
    return sum;
}

/* The change of all forces as the loose tendons move by x; its largest is `size` if that is not 0. */
static void combine(const task *s, const moves *m, const vector x, awiwi_real size, vector sum)
{
    for (int i = 0; i < s->count; i++)
        sum[i] = 0;
    for (int j = 0; j < m->count; j++) {
        sum[m->loose[j]] = x[j];
        for (int r = 0; r < m->rank; r++)
            sum[m->basic[r]] -= m->share[r][m->loose[j]] * x[j];
    }
    if (!(awiwi_size(size) > 0))
        return;
    const awiwi_real scale = size / awiwi_largest(sum, s->count);
    for (int i = 0; i < s->count; i++)
        sum[i] *= scale;
}

/* Give back by the basic tendons what rounding has taken from a torque within reach. One that is at a limit, but for
   rounding, is held there, and others are the basic ones. */
static void settle(const task *s, const moves *m, int *held, vector f)
{
    moves own;
    for (int again = s->within_reach && !s->by_chords; again;) {
        awiwi_real A[AWIWI_MOST_JOINTS * AWIWI_MOST_JOINTS], missing[AWIWI_MOST_JOINTS];
        again = 0;
        for (int r = 0; r < m->rank; r++) { /* by the couplings: shares have rounding of their own */
            const int a = m->joint[r];
            awiwi_real sizes = awiwi_size(s->torque[a]);
            missing[r] = s->torque[a];
            for (int i = 0; i < s->count; i++) {
                missing[r] -= s->p[i][a] * f[i];
                sizes += awiwi_size(s->p[i][a]) * s->t->high;
            }
            for (int l = 0; l < m->rank; l++)
                A[r * m->rank + l] = s->p[m->basic[l]][a];
            again = again || awiwi_size(missing[r]) > 2 * AWIWI_REAL_EPSILON * sizes;
        }
        if (!again || !awiwi_solve(m->rank, 1, A, missing))
            return;
        again = 0;
        for (int r = 0; r < m->rank; r++) {
            const int i = m->basic[r];
            const awiwi_real aim = f[i] + missing[r];
            f[i] = awiwi_clamp(aim, s->t->low, s->t->high);
            if (awiwi_size(aim - f[i]) > 0) {
                held[i] = aim < f[i] ? AT_LOW : AT_HIGH;
                again = 1;
            }
        }
        if (again) {
            split(s, 1, held, &own);
            m = &own;
        }
    }
}

/* -- derivatives --------------------------------------------------------------------------------------------------- */

/* Slopes of the cost by each force, with all others at rest. */
static void slopes(const task *s, const model *c, vector gradient)
{
    for (int i = 0; i < s->count; i++)
        gradient[i] = 0;
    for (int e = 0; e < s->entries; e++) {
        const place at = s->at[e];
        const awiwi_real excess = s->times[e] * c->excess[e];
        for (int i = 0; i < s->count; i++)
            gradient[i] += excess * (c->slope[i] * s->p[i][at.a] * s->p[i][at.b] + s->constant[i][at.offset]);
    }
}

static void derive(const task *s, const model *c, const moves *m, rates *d)
{
    const int count = s->count, n = m->count;
    vector growth, by;
    d->count = n;
    for (int j = 0; j < n; j++) {
        d->downhill[j] = 0;
        for (int l = 0; l <= j; l++)
            d->hessian[j][l] = 0;
    }
    for (int i = 0; i < count; i++) {
        d->stiffer[i] = 0;
        d->bent = c->curvature[i] > d->bent ? c->curvature[i] : d->bent;
    }
    for (int e = 0; e < s->entries; e++) {
        const place at = s->at[e];
        const awiwi_real times = s->times[e], excess = times * c->excess[e];
        for (int i = 0; i < count; i++) {
            const awiwi_real both = s->p[i][at.a] * s->p[i][at.b];
            growth[i] = c->slope[i] * both + s->constant[i][at.offset];
            d->stiffer[i] += excess * both;
        }
        for (int j = 0; j < n; j++) {
            by[j] = along(m, m->loose[j], growth);
            d->downhill[j] -= excess * by[j];
            for (int l = 0; l <= j; l++)
                d->hessian[j][l] += times * by[j] * by[l];
        }
    }
}

/* Work on the Hessian with a diagonal by the forces and a shift along the moves. */
static void add_diagonal(const moves *m, rates *d, const vector diagonal, awiwi_real shift)
{
    for (int j = 0; j < m->count; j++) {
        for (int l = 0; l <= j; l++)
            d->work[j][l] = d->hessian[j][l];
        d->work[j][j] += shift + diagonal[m->loose[j]];
        for (int r = 0; r < m->rank; r++) {
            const awiwi_real part = m->share[r][m->loose[j]] * diagonal[m->basic[r]];
            for (int l = 0; l <= j; l++)
                d->work[j][l] += part * m->share[r][m->loose[l]];
        }
    }
}

#endif
