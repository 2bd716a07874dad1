/* Tendon forces by search, for tendons that are not antagonistic pairs.

   First the torque: forces within the limits with the least |tau + P' f|. Then the stiffness, in the moves that keep
   it. */
#include "numerics.h"
#include "tendon_descent.h"

static const awiwi_real SAME = (awiwi_real)1 / 1048576;       /* costs of one minimum, found from two starts */
static const awiwi_real MARGIN = 4;                            /* over the greatest curvature met: slopes vary too */
/* Starts, as a minimum need not be the least: middle of the limits, answer with chords, lowest and highest forces. */
enum { FROM_MIDDLE, FROM_CHORDS, FROM_LOW, FROM_HIGH };

/* -- starts -------------------------------------------------------------------------------------------------------- */

/* The least change of free forces after which all give the torque. */
static void correct(const task *s, const moves *m, const int *held, vector v)
{
    awiwi_real G[AWIWI_MOST_JOINTS][AWIWI_MOST_JOINTS], missing[AWIWI_MOST_JOINTS] = {0}, x[AWIWI_MOST_JOINTS];
    for (int r = 0; r < m->rank; r++) {
        missing[r] = m->share[r][s->count] - awiwi_dot(m->share[r], v, s->count);
        for (int l = 0; l <= r; l++) {
            G[r][l] = 0;
            for (int i = 0; i < s->count; i++)
                G[r][l] += held[i] == FREE ? m->share[r][i] * m->share[l][i] : 0;
        }
    }
    (void)awiwi_solve_positive(m->rank, AWIWI_MOST_JOINTS, G[0], 0, missing, x);
    for (int r = 0; r < m->rank; r++)
        for (int i = 0; i < s->count; i++)
            v[i] += held[i] == FREE ? m->share[r][i] * x[r] : 0;
}

/* Forces within the limits that give the torque, or the nearest one, in the steps left: those nearest to `from`, if these
   are within the limits with what is held. */
static int begin(task *s, const moves *m, const int *held, int *steps, const vector from, vector f, rates *d)
{
    int holding[AWIWI_MOST_TENDONS], inside = 1, status = AWIWI_OK;
    moves each;
    model found;
    for (int i = 0; i < s->count; i++)
        f[i] = from[i];
    correct(s, m, held, f);
    for (int i = 0; i < s->count; i++)
        inside = inside && f[i] >= s->t->low && f[i] <= s->t->high;
    (void)cost(s, f, &found);
    if (!inside || !(found.cost <= found.blur)) {
        for (int i = 0; i < s->count; i++) {
            f[i] = from[i];
            holding[i] = held[i];
        }
        split(s, 0, holding, &each);
        status = descend(s, &each, holding, steps, f, &found, d);
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
    int held[AWIWI_MOST_TENDONS] = {0}, steps = AWIWI_MOST_STIFFNESS_STEPS;
    model found;
    int status = take_chords(s);
    if (status == AWIWI_OK)
        status = descend(s, all, held, &steps, f, &found, d);
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
    const int none[AWIWI_MOST_TENDONS] = {0};
    int torque_steps = AWIWI_MOST_TORQUE_STEPS;
    awiwi_real least = 0;
    vector first, best;
    moves all;
    rates d;
    task s;
    d.bent = 0;
    start_task(&s, t, tau);
    want_torque(&s, 4 * AWIWI_REAL_EPSILON);
    split(&s, 1, none, &all);
    for (int i = 0; i < s.count; i++)
        best[i] = t->low + (t->high - t->low) / 2;
    int status = begin(&s, &all, none, &torque_steps, best, first, &d);
    for (int i = 0; i < s.count; i++)
        best[i] = first[i];
    want_stiffness(&s, K, tolerance);
    int done = status != AWIWI_OK;
    for (int start = FROM_MIDDLE; start <= FROM_HIGH && !done; start++) {
        int held[AWIWI_MOST_TENDONS] = {0}, steps = AWIWI_MOST_STIFFNESS_STEPS;
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
        const int ended = descend(&s, &all, held, &steps, trial, &found, &d);
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

/* Hold the tendons that are at a limit, and find the moves of the others. */
static void hold(const task *s, const vector f, int *held, moves *m)
{
    for (int i = 0; i < s->count; i++)
        held[i] = f[i] <= s->t->low ? AT_LOW : f[i] >= s->t->high ? AT_HIGH : FREE;
    split(s, 1, held, m);
}

int awiwi_update_forces(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                        const awiwi_real *last, awiwi_real *f)
{
    int held[AWIWI_MOST_TENDONS], steps = AWIWI_MOST_UPDATE_STEPS;
    vector from, next;
    moves own;
    model found;
    rates d;
    task s;
    d.bent = 0;
    start_task(&s, t, tau);
    want_torque(&s, 4 * AWIWI_REAL_EPSILON);
    for (int i = 0; i < s.count; i++)
        from[i] = awiwi_clamp(last[t->searched_tendons[i]], t->low, t->high);
    hold(&s, from, held, &own);
    int status = begin(&s, &own, held, &steps, from, next, &d);
    want_stiffness(&s, K, tolerance);
    if (status == AWIWI_OK) {
        hold(&s, next, held, &own);
        status = descend(&s, &own, held, &steps, next, &found, &d);
    }
    for (int i = 0; i < s.count; i++)
        f[t->searched_tendons[i]] = next[i];
    return status;
}
