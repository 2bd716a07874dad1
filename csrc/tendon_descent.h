/* The descent of the search for tendon forces: a primal active-set Newton method.

   Tendons at a limit are held there until the slope of the cost lets them leave; all others share a Newton step, cut where
   the first of them reaches a limit. So every iterate keeps the limits, and the torque. Not part of the firmware
   interface. */
#ifndef AWIWI_TENDON_DESCENT_H
#define AWIWI_TENDON_DESCENT_H

#include "tendon_cost.h"

static const awiwi_real DAMPING = (awiwi_real)1 / 4096;       /* of steps where the Hessian is not positive */
static const awiwi_real BENT = 4096 * AWIWI_REAL_EPSILON;     /* negative curvature, relative to the trace */
static const awiwi_real LITTLE = (awiwi_real)1 / 16;          /* gain by a step, relative to the cost */
enum { BENDS = 8 };                                           /* trials along a direction of negative curvature */

/* Newton's step of the free tendons along the moves that are allowed; where the Hessian is not positive, a damped
   Gauss-Newton step. Returns the predicted decrease. `bend` becomes a downhill direction along which the cost curves
   down, as long as the range of forces. Both are zero before, and stay so where there is none. */
static awiwi_real newton(const task *s, const model *c, const moves *m, rates *d, vector step, vector bend)
{
    const int n = m->count;
    const awiwi_real range = s->t->high - s->t->low, near = c->cost / (range * range);
    vector x, diagonal;
    awiwi_real trace = 0, pivot, shift = 0;
    derive(s, c, m, d);
    for (int j = 0; j < n; j++)
        trace += d->hessian[j][j];
    for (int i = 0; i < s->count; i++) /* of moves that give the same torque, the shortest */
        diagonal[i] = s->keep_torque ? d->stiffer[i] * c->curvature[i] : 1024 * AWIWI_REAL_EPSILON * trace;
    const awiwi_real least = 64 * AWIWI_REAL_EPSILON * trace, flat = awiwi_sqrt(AWIWI_REAL_EPSILON) * trace;
    do { /* little damping near the demand: where tendons do the same, the cost is flat along exchanges between them */
        add_diagonal(m, d, diagonal, shift);
        pivot = awiwi_solve_positive(n, AWIWI_MOST_TENDONS, d->work[0], least, d->downhill, x);
        if (!(shift > 0) && pivot < -BENT * trace)
            combine(s, m, x, awiwi_dot(d->downhill, x, n) < 0 ? -range : range, bend);
        const awiwi_real missing = pivot < 0 ? -pivot / awiwi_dot(x, x, n) : 0; /* less shift will not do */
        do
            shift = shift > 0 ? 16 * shift : (near < flat ? near : flat) + least;
        while (shift <= missing && shift < DAMPING * trace);
    } while (!(pivot > least) && shift < DAMPING * trace);
    if (!(pivot > least)) {
        for (int i = 0; i < s->count; i++)
            diagonal[i] = 0;
        add_diagonal(m, d, diagonal, near < DAMPING * trace ? near + least : DAMPING * trace);
        if (!(awiwi_solve_positive(n, AWIWI_MOST_TENDONS, d->work[0], 0, d->downhill, x) > 0))
            return 0;
    }
    combine(s, m, x, 0, step);
    return awiwi_dot(d->downhill, x, n) / 2;
}

/* The held tendon that most lowers the cost by leaving its limit, with the free ones making up for its torque; -1 if
   there is none. Slopes within rounding of their terms count as level. */
static int leaving(const task *s, const model *c, const moves *m, const int *held, rates *d)
{
    vector gradient;
    int found = -1;
    if (m->rank + m->count == s->count) { /* none is held */
        for (int i = 0; i < s->count; i++)
            d->price[i] = 0;
        return found;
    }
    slopes(s, c, gradient);
    awiwi_real most = 256 * AWIWI_REAL_EPSILON * awiwi_largest(gradient, s->count);
    for (int i = 0; i < s->count; i++) {
        const awiwi_real gain = held[i] == FREE ? 0 : (awiwi_real)held[i] * along(m, i, gradient);
        d->price[i] = gain < 0 ? -gain : 0;
        if (gain > most) {
            most = gain;
            found = i;
        }
    }
    return found;
}

/* How much of the step is possible, at most all of it; which tendon stops it, or -1. */
static awiwi_real reach(const task *s, const vector f, const vector step, int *stopped)
{
    awiwi_real share = 1;
    *stopped = -1;
    for (int i = 0; i < s->count; i++) {
        const awiwi_real room = step[i] < 0 ? f[i] - s->t->low : s->t->high - f[i], size = awiwi_size(step[i]);
        if (size * share > room) {
            share = room > 0 ? room / size : 0;
            *stopped = i;
        }
    }
    return share;
}

/* Copy what the task uses. */
static void keep(const task *s, const model *from, model *to)
{
    to->cost = from->cost;
    to->blur = from->blur;
    for (int e = 0; e < s->entries; e++)
        to->excess[e] = from->excess[e];
    for (int i = 0; i < s->count; i++) {
        to->slope[i] = from->slope[i];
        to->curvature[i] = from->curvature[i];
    }
}

/* Geodesic acceleration of a step: the second order of what the entries change by along it, undone by the moves of Gauss
   and Newton, a little damped. So a path bends as the valley of the cost does. */
static void accelerate(const task *s, const model *c, const moves *m, rates *d, const vector step, vector bend)
{
    const vector none = {0};
    model second;
    vector gradient, x;
    awiwi_real trace = 0;
    keep(s, c, &second);
    for (int e = 0; e < s->entries; e++) {
        second.excess[e] = 0;
        for (int i = 0; i < s->count; i++)
            second.excess[e] -= c->curvature[i] * step[i] * step[i] / 2 * s->p[i][s->at[e].a] * s->p[i][s->at[e].b];
    }
    slopes(s, &second, gradient);
    for (int j = 0; j < m->count; j++) {
        d->downhill[j] = along(m, m->loose[j], gradient);
        trace += d->hessian[j][j];
    }
    add_diagonal(m, d, none, awiwi_sqrt(AWIWI_REAL_EPSILON) * trace);
    (void)awiwi_solve_positive(m->count, AWIWI_MOST_TENDONS, d->work[0], 0, d->downhill, x);
    combine(s, m, x, 0, bend);
}

/* Take a share of a step, or as much of that as the cost permits: at most `most` afterwards. With the moves that the step
   is made of, trials begin again after the second, and bend. Each trial is one of the steps left. */
static int take(const task *s, const vector step, awiwi_real share, awiwi_real most, const moves *m, rates *d, int *steps,
                vector f, model *here, int *stopped)
{
    vector bend;
    int refused = 0;
    while (share > 0) {
        vector trial;
        model there;
        int inside = 1;
        for (int i = 0; i < s->count; i++)
            trial[i] = awiwi_clamp(f[i] + share * step[i], s->t->low, s->t->high);
        for (int i = 0; i < s->count && refused > 1; i++) {
            trial[i] = f[i] + share * (step[i] + share * bend[i]);
            inside = inside && trial[i] >= s->t->low && trial[i] <= s->t->high;
        }
        if (inside && cost(s, trial, &there))
            return AWIWI_OUT_OF_DOMAIN;
        if (inside && there.cost <= most) {
            for (int i = 0; i < s->count; i++)
                f[i] = trial[i];
            keep(s, &there, here);
            return AWIWI_OK;
        }
        if (inside && --*steps <= 0)
            break;
        if (m && ++refused == 2) {
            accelerate(s, here, m, d, step, bend);
            share *= 2;
        } else {
            share /= 2;
        }
        *stopped = -1;
    }
    return AWIWI_NOT_CONVERGED;
}

/* From f down to where no free move and no leaving tendon lowers the cost. `m` are the moves
   while those are held that are first of all. */
static int descend(const task *s, const moves *m, int *held, int *steps, vector f, model *here, rates *d)
{
    int left = -1, stopped, straight = 0, changed = 0;
    awiwi_real last = AWIWI_REAL_MAX;
    moves own;
    if (cost(s, f, here))
        return AWIWI_OUT_OF_DOMAIN;
    while ((*steps)-- > 0 && (s->keep_torque || here->cost > here->blur)) {
        vector step = {0}, bend = {0};
        stopped = -1;
        if (changed) {
            split(s, s->keep_torque, held, &own);
            m = &own;
            last = AWIWI_REAL_MAX;
            straight = changed = 0;
        }
        const awiwi_real gain = newton(s, here, m, d, step, bend), longest = awiwi_largest(step, s->count);
        if (!(longest <= AWIWI_REAL_MAX))
            return AWIWI_NOT_FINITE;
        const awiwi_real near = s->tolerance * s->t->high;
        const int none_held = m->rank + m->count == s->count; /* slopes that let one leave need the last step */
        const int rounding = gain <= here->blur && 2 * longest >= last; /* nothing to gain, and no nearer */
        const awiwi_real whole = rounding && longest > last ? 0 : reach(s, f, step, &stopped);
        const int ended = longest <= near || rounding ||
                          (none_held && stopped < 0 && awiwi_ends_with(longest, last, near, s->t->high / 64));
        const awiwi_real *way = step;
        last = longest;
        if ((ended || (!straight && gain <= LITTLE * here->cost)) && here->cost > here->blur && *steps > BENDS
            && awiwi_largest(bend, s->count) > 0) { /* off a saddle, or from the way to one */
            int trials = BENDS, blocked;
            const awiwi_real share = reach(s, f, bend, &blocked);
            const int status = share > 0 ? take(s, bend, share, here->cost - here->blur, 0, d, &trials, f, here, &blocked)
                                         : AWIWI_OK; /* hold what blocks it */
            if (status == AWIWI_OUT_OF_DOMAIN)
                return status;
            *steps -= BENDS - trials;
            straight = status != AWIWI_OK;
            way = straight ? step : bend;
            stopped = straight ? stopped : blocked;
        }
        const awiwi_real share = way == step ? whole : 0;
        if (way == step && ended) {
            for (int i = 0; i < s->count; i++)
                f[i] = awiwi_clamp(f[i] + share * step[i], s->t->low, s->t->high);
            left = leaving(s, here, m, held, d);
            if (left < 0) {
                here->cost = gain < here->cost - here->blur ? here->cost - gain : 0;
                settle(s, m, held, f);
                return AWIWI_OK;
            }
            held[left] = FREE;
            changed = 1;
            *steps += m->count == 0; /* nothing moved: tendons that are all held leave one by one */
            continue;
        }
        if (share > 0) {
            const int status = take(s, step, share, here->cost + here->blur, s->keep_torque ? m : 0, d, steps, f, here, &stopped);
            if (status != AWIWI_OK)
                return status;
        } else if (way == step && stopped == left) {
            return AWIWI_OK; /* leaving the limit gained nothing but rounding */
        }
        left = -1;
        if (stopped >= 0) {
            held[stopped] = way[stopped] < 0 ? AT_LOW : AT_HIGH;
            f[stopped] = way[stopped] < 0 ? s->t->low : s->t->high;
            changed = 1;
        }
    }
    return s->keep_torque || here->cost > here->blur ? AWIWI_NOT_CONVERGED : AWIWI_OK;
}

#endif
