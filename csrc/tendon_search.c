/* Tendon forces by search, for tendons that are not antagonistic pairs: a primal active-set Newton method.

   First the torque: forces within the limits with the least |tau + P' f|. Then the stiffness, in the moves that keep
   it. Tendons at a limit are held there until the slope of the cost lets them leave; all others share a Newton step, cut
   where the first of them reaches a limit. So every iterate keeps both. */
#include "numerics.h"
#include "tendon_cost.h"

static const awiwi_real DAMPING = (awiwi_real)1 / 4096;       /* of steps where the Hessian is not positive */
static const awiwi_real BENT = 4096 * AWIWI_REAL_EPSILON;     /* negative curvature, relative to the trace */
static const awiwi_real MARGIN = 4;                            /* over the greatest curvature met: slopes vary too */
static const awiwi_real LITTLE = (awiwi_real)1 / 16;          /* gain by a step, relative to the cost */
static const awiwi_real SAME = (awiwi_real)1 / 1048576;       /* costs of one minimum, found from two starts */
enum { BENDS = 8 };                                           /* trials along a direction of negative curvature */
/* Starts, as a minimum need not be the least: middle of the limits, answer with chords, lowest and highest forces. */
enum { FROM_MIDDLE, FROM_CHORDS, FROM_LOW, FROM_HIGH };

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

/* From f down to where no free move and no leaving tendon lowers the cost. `all` are the moves while none is held. */
static int descend(const task *s, const moves *all, int steps, vector f, model *here, rates *d)
{
    int held[AWIWI_MOST_TENDONS] = {0}, left = -1, stopped, straight = 0, changed = 0;
    awiwi_real last = AWIWI_REAL_MAX;
    const moves *m = all;
    moves own;
    if (cost(s, f, here))
        return AWIWI_OUT_OF_DOMAIN;
    while (steps-- > 0 && (s->keep_torque || here->cost > here->blur)) {
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
        if ((ended || (!straight && gain <= LITTLE * here->cost)) && here->cost > here->blur && steps > BENDS
            && awiwi_largest(bend, s->count) > 0) { /* off a saddle, or from the way to one */
            int trials = BENDS, blocked;
            const awiwi_real share = reach(s, f, bend, &blocked);
            const int status = share > 0 ? take(s, bend, share, here->cost - here->blur, 0, d, &trials, f, here, &blocked)
                                         : AWIWI_OK; /* hold what blocks it */
            if (status == AWIWI_OUT_OF_DOMAIN)
                return status;
            steps -= BENDS - trials;
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
            continue;
        }
        if (share > 0) {
            const int status = take(s, step, share, here->cost + here->blur, s->keep_torque ? m : 0, d, &steps, f, here, &stopped);
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

/* -- starts -------------------------------------------------------------------------------------------------------- */

/* The least change of forces after which they give the torque; all tendons are free. */
static void correct(const task *s, const moves *m, vector v)
{
    awiwi_real G[AWIWI_MOST_JOINTS][AWIWI_MOST_JOINTS], missing[AWIWI_MOST_JOINTS] = {0}, x[AWIWI_MOST_JOINTS];
    for (int r = 0; r < m->rank; r++) {
        missing[r] = m->share[r][s->count] - awiwi_dot(m->share[r], v, s->count);
        for (int l = 0; l <= r; l++)
            G[r][l] = awiwi_dot(m->share[r], m->share[l], s->count);
    }
    (void)awiwi_solve_positive(m->rank, AWIWI_MOST_JOINTS, G[0], 0, missing, x);
    for (int r = 0; r < m->rank; r++)
        for (int i = 0; i < s->count; i++)
            v[i] += m->share[r][i] * x[r];
}

/* Forces within the limits that give the torque, or the nearest one: those nearest to the middle of the limits, if
   these are within them. */
static int begin(task *s, const moves *m, vector f, rates *d)
{
    const awiwi_real middle = s->t->low + (s->t->high - s->t->low) / 2;
    const int held[AWIWI_MOST_TENDONS] = {0};
    int inside = 1, status = AWIWI_OK;
    moves each;
    model found;
    for (int i = 0; i < s->count; i++)
        f[i] = middle;
    correct(s, m, f);
    for (int i = 0; i < s->count; i++)
        inside = inside && f[i] >= s->t->low && f[i] <= s->t->high;
    (void)cost(s, f, &found);
    if (!inside || !(found.cost <= found.blur)) {
        for (int i = 0; i < s->count; i++)
            f[i] = middle;
        split(s, 0, held, &each);
        status = descend(s, &each, AWIWI_MOST_TORQUE_STEPS, f, &found, d);
    }
    s->within_reach = found.cost <= found.blur;
    return status;
}

/* Move f to where one limit after the other stops the sum of forces from growing by `sense`, at the same torque. Each
   limit takes one of the moves; `all` are those while no tendon is held. */
static void drive(const task *s, const moves *all, awiwi_real sense, vector f)
{
    int held[AWIWI_MOST_TENDONS] = {0}, stopped = 0;
    const awiwi_real range = s->t->high - s->t->low;
    const moves *m = all;
    moves own;
    vector one;
    for (int i = 0; i < s->count; i++)
        one[i] = 1;
    while (m->count > 0) {
        vector x, step;
        for (int j = 0; j < m->count; j++)
            x[j] = along(m, m->loose[j], one);
        if (!(awiwi_largest(x, m->count) > 0))
            return;
        combine(s, m, x, 2 * sense * range, step);
        const awiwi_real share = reach(s, f, step, &stopped);
        if (stopped < 0)
            return;
        for (int i = 0; i < s->count; i++)
            f[i] = awiwi_clamp(f[i] + share * step[i], s->t->low, s->t->high);
        if (m->count == 1)
            return;
        held[stopped] = AT_LOW;
        split(s, s->keep_torque, held, &own);
        m = &own;
    }
}

/* Move f to the minimum of the cost with chords in place of the curve. */
static int follow_chords(task *s, const moves *all, vector f, rates *d)
{
    model found;
    int status = take_chords(s);
    if (status == AWIWI_OK)
        status = descend(s, all, AWIWI_MOST_STIFFNESS_STEPS, f, &found, d);
    s->by_chords = 0;
    return status;
}

/* Whether forces differ by no more than the tolerance. */
static int is_near(const task *s, const vector f, const vector other)
{
    for (int i = 0; i < s->count; i++)
        if (!(awiwi_size(f[i] - other[i]) <= s->tolerance * s->t->high))
            return 0;
    return 1;
}

/* Whether no other forces come as near, as far as the slopes and curvatures at these tell. They tell little where there
   are as many moves as entries: other slopes than these can then undo a change. The cost of others exceeds
   that of these by half the square of what all entries change by, and by the prices of leaving limits, less what tendons
   gain that are asked to be stiffer. A price is paid for at least the share of the range that is left. */
static int is_nearest_of_all(const task *s, const model *c, const moves *m, rates *d)
{
    const awiwi_real range = s->t->high - s->t->low;
    vector extra, x;
    if (s->entries <= m->count)
        return 0;
    if (d->count < m->count)
        derive(s, c, m, d);
    for (int i = 0; i < s->count; i++)
        extra[i] = 2 * d->price[i] / range + (d->stiffer[i] < 0 ? MARGIN * d->bent * d->stiffer[i] : 0);
    add_diagonal(m, d, extra, 0);
    return awiwi_solve_positive(m->count, AWIWI_MOST_TENDONS, d->work[0], 0, d->downhill, x) > 0;
}

int awiwi_search_forces(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                        awiwi_real *f)
{
    const int held[AWIWI_MOST_TENDONS] = {0};
    awiwi_real least = 0;
    vector first = {0}, best;
    moves all;
    rates d;
    task s;
    d.bent = 0;
    start_task(&s, t, tau);
    want_torque(&s, 4 * AWIWI_REAL_EPSILON);
    split(&s, 1, held, &all);
    int status = begin(&s, &all, best, &d);
    for (int i = 0; i < s.count; i++)
        first[i] = best[i];
    want_stiffness(&s, K, tolerance);
    int done = status != AWIWI_OK;
    for (int start = FROM_MIDDLE; start <= FROM_HIGH && !done; start++) {
        vector trial;
        model found;
        for (int i = 0; i < s.count; i++)
            trial[i] = first[i];
        if (start == FROM_CHORDS && follow_chords(&s, &all, trial, &d) != AWIWI_OK)
            continue;
        if (start >= FROM_LOW)
            drive(&s, &all, start == FROM_LOW ? -1 : 1, trial);
        if (start != FROM_MIDDLE && status == AWIWI_OK && is_near(&s, trial, best))
            continue;
        const int ended = descend(&s, &all, AWIWI_MOST_STIFFNESS_STEPS, trial, &found, &d);
        if (ended != AWIWI_OK && ended != AWIWI_NOT_CONVERGED)
            return ended;
        const int again = start == FROM_CHORDS && status == AWIWI_OK && s.entries > all.count &&
                          awiwi_size(found.cost - least) <= SAME * least;
        if (start == FROM_MIDDLE || (ended == AWIWI_OK && (status != AWIWI_OK || found.cost < least - found.blur))) {
            status = ended;
            least = found.cost;
            for (int i = 0; i < s.count; i++)
                best[i] = trial[i];
        }
        done = status == AWIWI_OK &&
               (again || least <= found.blur || (start == FROM_MIDDLE && is_nearest_of_all(&s, &found, &all, &d)));
    }
    for (int i = 0; i < s.count; i++)
        f[t->searched_tendons[i]] = best[i];
    return status;
}
