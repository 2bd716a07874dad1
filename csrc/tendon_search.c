/* Tendon forces by search, for tendons that are not antagonistic pairs: a primal active-set Newton method.

   First the torque: forces within the limits with the least |tau + P' f|. Then the stiffness, in the moves that keep
   it. Tendons at a limit are held there until the slope of the cost lets them leave; all others share a Newton step, cut
   where the first of them reaches a limit. So every iterate keeps both. */
#include "numerics.h"
#include "awiwi_distribution.h"
#include "dense.h"

enum { MOST_ENTRIES = AWIWI_MOST_JOINTS * (AWIWI_MOST_JOINTS + 1) / 2 };

typedef awiwi_real vector[AWIWI_MOST_TENDONS];
typedef awiwi_real matrix[AWIWI_MOST_TENDONS][AWIWI_MOST_TENDONS];

/* What is to be minimised over the searched tendons: half the squared miss of the torque or, keeping that, of the
   stiffness. Joints are those that the searched tendons move: no other torque or stiffness is theirs. */
typedef struct task {
    const awiwi_tendons *t;
    const awiwi_real *tau, *K;
    int count, joints;
    int joint[AWIWI_MOST_JOINTS];
    awiwi_real p[AWIWI_MOST_TENDONS][AWIWI_MOST_JOINTS]; /* couplings [count][joints] */
    int keep_torque;
    awiwi_real tolerance;
    awiwi_real *f; /* of all tendons */
} task;

/* The cost and what its derivatives are made of: by how much each entry of the torque, or of the lower half of the
   stiffness, exceeds the wanted one. Costs that differ by less than the blur are equal. */
typedef struct model {
    awiwi_real cost, blur, excess[MOST_ENTRIES];
    vector k, slope, curvature; /* of all tendons */
} model;

/* The moves of the free tendons that keep the torque: each of the loose tendons by itself, while the basic tendons make
   up for its torque, basic[r] by -share[r][loose] of the move. Forces give the torque where each row of shares times
   forces is the last number of the row. Without a torque to keep all free tendons are loose. */
typedef struct moves {
    int rank, count;
    int basic[AWIWI_MOST_JOINTS], loose[AWIWI_MOST_TENDONS];
    awiwi_real share[AWIWI_MOST_JOINTS][AWIWI_MOST_TENDONS + 1];
} moves;

static const awiwi_real DAMPING = (awiwi_real)1 / 4096;       /* of steps where the Hessian is not positive */
static const awiwi_real BENT = 4096 * AWIWI_REAL_EPSILON;     /* negative curvature, relative to the trace */
static const awiwi_real MARGIN = 4;                            /* over the curvatures of springs where a search ends */
static const awiwi_real LITTLE = (awiwi_real)1 / 16;          /* gain by a step, relative to the cost */
enum { BENDS = 8 };                                           /* trials along a direction of negative curvature */
enum { AT_LOW = -1, FREE = 0, AT_HIGH = 1 };

/* -- cost ---------------------------------------------------------------------------------------------------------- */

/* Add one entry that misses by `excess`, a sum of terms of that total size, and counts `times`. */
static void add_entry(model *c, int entry, int times, awiwi_real excess, awiwi_real terms)
{
    const awiwi_real rounding = 4 * AWIWI_REAL_EPSILON * terms;
    c->excess[entry] = excess;
    c->cost += (awiwi_real)times * excess * excess / 2;
    c->blur += (awiwi_real)times * rounding * (awiwi_size(excess) + rounding);
}

/* tau + P' f; what is within rounding counts as zero. */
static void torque_cost(const task *s, const vector f, model *c)
{
    for (int a = 0; a < s->joints; a++) {
        awiwi_real missing = s->tau[s->joint[a]], terms = awiwi_size(missing);
        for (int i = 0; i < s->count; i++) {
            const awiwi_real part = s->p[i][a] * f[i];
            missing += part;
            terms += awiwi_size(part);
        }
        add_entry(c, a, 1, awiwi_size(missing) <= 4 * AWIWI_REAL_EPSILON * terms ? 0 : missing, terms);
    }
}

/* dP of a searched tendon in entry (a, b). */
static awiwi_real change(const task *s, int i, int a, int b)
{
    const int n = s->t->joints;
    return s->t->slope ? s->t->slope[(s->t->searched_tendons[i] * n + s->joint[a]) * n + s->joint[b]] : 0;
}

/* The lower half of K_q - K. */
static void stiffness_cost(const task *s, const vector f, model *c)
{
    const int n = s->t->joints;
    for (int a = 0, entry = 0; a < s->joints; a++) {
        for (int b = 0; b <= a; b++) {
            const int row = s->joint[a], column = s->joint[b];
            awiwi_real excess = -(s->K[row * n + column] + s->K[column * n + row]) / 2, terms = awiwi_size(excess);
            for (int i = 0; i < s->count; i++) {
                const awiwi_real elastic = c->k[s->t->searched_tendons[i]] * s->p[i][a] * s->p[i][b];
                const awiwi_real bent = f[i] * change(s, i, a, b);
                excess += elastic + bent;
                terms += awiwi_size(elastic) + awiwi_size(bent);
            }
            add_entry(c, entry++, a == b ? 1 : 2, excess, terms);
        }
    }
}

static int cost(const task *s, const vector f, model *c)
{
    c->cost = c->blur = 0;
    if (!s->keep_torque) {
        torque_cost(s, f, c);
        return 0;
    }
    for (int i = 0; i < s->count; i++)
        s->f[s->t->searched_tendons[i]] = f[i];
    if (s->t->curve(s->t->context, s->f, c->k, c->slope, c->curvature))
        return AWIWI_OUT_OF_DOMAIN;
    stiffness_cost(s, f, c);
    return 0;
}

/* How entry (a, b) of the stiffness, or a of the torque, grows with each force. */
static void grow(const task *s, const model *c, int a, int b, vector growth)
{
    for (int i = 0; i < s->count; i++)
        growth[i] = s->keep_torque ? c->slope[s->t->searched_tendons[i]] * s->p[i][a] * s->p[i][b] + change(s, i, a, b)
                                   : s->p[i][a];
}

/* Slopes of the cost by each force, with all others at rest. */
static void slopes(const task *s, const model *c, vector gradient)
{
    vector growth;
    for (int i = 0; i < s->count; i++)
        gradient[i] = 0;
    for (int a = 0, entry = 0; a < s->joints; a++) {
        for (int b = s->keep_torque ? 0 : a; b <= a; b++) {
            const awiwi_real excess = a == b ? c->excess[entry++] : 2 * c->excess[entry++];
            grow(s, c, a, b, growth);
            for (int i = 0; i < s->count; i++)
                gradient[i] += excess * growth[i];
        }
    }
}

/* -- moves --------------------------------------------------------------------------------------------------------- */

/* Find the moves by elimination: every joint gets the free tendon that is left with the largest coupling. */
static void split(const task *s, const int *held, moves *m)
{
    int taken[AWIWI_MOST_TENDONS] = {0};
    m->rank = m->count = 0;
    for (int a = 0; s->keep_torque && a < s->joints; a++) {
        awiwi_real *row = m->share[m->rank], before = 0, most = 0;
        int pivot = 0;
        row[s->count] = -s->tau[s->joint[a]];
        for (int i = 0; i < s->count; i++) {
            row[i] = s->p[i][a];
            before = held[i] == FREE && awiwi_size(row[i]) > before ? awiwi_size(row[i]) : before;
        }
        for (int r = 0; r < m->rank; r++) {
            const awiwi_real part = row[m->basic[r]];
            for (int i = 0; i <= s->count; i++)
                row[i] -= part * m->share[r][i];
        }
        for (int i = 0; i < s->count; i++) {
            if (held[i] == FREE && !taken[i] && awiwi_size(row[i]) > most) {
                most = awiwi_size(row[i]);
                pivot = i;
            }
        }
        if (!(most * most > 64 * AWIWI_REAL_EPSILON * before * before))
            continue;
        const awiwi_real scale = 1 / row[pivot];
        for (int i = 0; i <= s->count; i++)
            row[i] *= scale;
        for (int r = 0; r < m->rank; r++) {
            const awiwi_real part = m->share[r][pivot];
            for (int i = 0; i <= s->count; i++)
                m->share[r][i] -= part * row[i];
        }
        taken[pivot] = 1;
        m->basic[m->rank++] = pivot;
    }
    for (int i = 0; i < s->count; i++)
        if (held[i] == FREE && !taken[i])
            m->loose[m->count++] = i;
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

/* Gradient of the cost by the moves and Hessian as of Gauss and Newton; by how much more stiffness of each tendon raises
   the cost. */
static void derive(const task *s, const model *c, const moves *m, vector gradient, matrix H, vector stiffer)
{
    vector growth, by;
    for (int j = 0; j < m->count; j++) {
        gradient[j] = 0;
        for (int l = 0; l <= j; l++)
            H[j][l] = 0;
    }
    for (int i = 0; i < s->count; i++)
        stiffer[i] = 0;
    for (int a = 0, entry = 0; a < s->joints; a++) {
        for (int b = s->keep_torque ? 0 : a; b <= a; b++) {
            const awiwi_real times = a == b ? 1 : 2, excess = times * c->excess[entry++];
            grow(s, c, a, b, growth);
            for (int j = 0; j < m->count; j++) {
                by[j] = along(m, m->loose[j], growth);
                gradient[j] += excess * by[j];
                for (int l = 0; l <= j; l++)
                    H[j][l] += times * by[j] * by[l];
            }
            for (int i = 0; i < s->count; i++)
                stiffer[i] += excess * s->p[i][a] * s->p[i][b];
        }
    }
}

/* H, with a diagonal by the forces and a shift along the moves. */
static void add_diagonal(const moves *m, matrix H, const vector diagonal, awiwi_real shift, matrix sum)
{
    for (int j = 0; j < m->count; j++) {
        for (int l = 0; l <= j; l++) {
            sum[j][l] = l == j ? H[j][l] + shift + diagonal[m->loose[j]] : H[j][l];
            for (int r = 0; r < m->rank; r++)
                sum[j][l] += m->share[r][m->loose[j]] * diagonal[m->basic[r]] * m->share[r][m->loose[l]];
        }
    }
}

/* -- search -------------------------------------------------------------------------------------------------------- */

/* Newton's step of the free tendons along the moves that are allowed; where the Hessian is not positive, a damped
   Gauss-Newton step. Returns the predicted decrease. `bend` becomes a downhill direction along which the cost curves
   down, as long as the range of forces. Both are zero before, and stay so where there is none. */
static awiwi_real newton(const task *s, const model *c, const moves *m, vector step, vector bend)
{
    const int n = m->count;
    const awiwi_real range = s->t->high - s->t->low, near = c->cost / (range * range);
    matrix H, full;
    vector b, x, diagonal;
    awiwi_real trace = 0, pivot, shift = 0;
    derive(s, c, m, b, H, diagonal);
    for (int j = 0; j < n; j++) {
        b[j] = -b[j];
        trace += H[j][j];
    }
    for (int i = 0; i < s->count; i++) /* of moves that give the same torque, the shortest */
        diagonal[i] = s->keep_torque ? diagonal[i] * c->curvature[s->t->searched_tendons[i]]
                                     : 1024 * AWIWI_REAL_EPSILON * trace;
    const awiwi_real least = 64 * AWIWI_REAL_EPSILON * trace, flat = awiwi_sqrt(AWIWI_REAL_EPSILON) * trace;
    do { /* little damping near the demand: where tendons do the same, the cost is flat along exchanges between them */
        add_diagonal(m, H, diagonal, shift, full);
        pivot = awiwi_solve_positive(n, AWIWI_MOST_TENDONS, full[0], least, b, x);
        if (!(shift > 0) && pivot < -BENT * trace)
            combine(s, m, x, awiwi_dot(b, x, n) < 0 ? -range : range, bend);
        shift = shift > 0 ? 16 * shift : (near < flat ? near : flat) + least;
    } while (!(pivot > least) && shift < DAMPING * trace);
    if (!(pivot > least)) {
        for (int j = 0; j < n; j++)
            H[j][j] += near < DAMPING * trace ? near + least : DAMPING * trace;
        if (!(awiwi_solve_positive(n, AWIWI_MOST_TENDONS, H[0], 0, b, x) > 0))
            return 0;
    }
    combine(s, m, x, 0, step);
    return awiwi_dot(b, x, n) / 2;
}

/* The held tendon that most lowers the cost by leaving its limit, with the free ones making up for its torque; -1 if
   there is none. Slopes within rounding of their terms count as level. */
static int leaving(const task *s, const model *c, const moves *m, const int *held)
{
    vector gradient;
    int found = -1;
    slopes(s, c, gradient);
    awiwi_real most = 256 * AWIWI_REAL_EPSILON * awiwi_largest(gradient, s->count);
    for (int i = 0; i < s->count; i++) {
        const awiwi_real gain = held[i] == FREE ? 0 : (awiwi_real)held[i] * along(m, i, gradient);
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
        const awiwi_real room = step[i] < 0 ? s->t->low - f[i] : s->t->high - f[i];
        if (awiwi_size(step[i]) > 0 && room / step[i] < share) {
            share = room / step[i];
            *stopped = i;
        }
    }
    return share > 0 ? share : 0;
}

/* Take as much of a step as the limits allow and the cost permits: at most `most` afterwards. Each trial is one of the
   steps left. */
static int take(const task *s, const vector step, awiwi_real most, int *steps, vector f, model *here, int *stopped)
{
    awiwi_real share = reach(s, f, step, stopped);
    while (share > 0) {
        vector trial;
        model there;
        for (int i = 0; i < s->count; i++)
            trial[i] = awiwi_clamp(f[i] + share * step[i], s->t->low, s->t->high);
        if (cost(s, trial, &there))
            return AWIWI_OUT_OF_DOMAIN;
        if (there.cost <= most) {
            for (int i = 0; i < s->count; i++)
                f[i] = trial[i];
            *here = there;
            return AWIWI_OK;
        }
        if (--*steps <= 0)
            break;
        share /= 2;
        *stopped = -1;
    }
    return AWIWI_NOT_CONVERGED;
}

/* From f down to where no free move and no leaving tendon lowers the cost. */
static int descend(const task *s, int steps, vector f, model *here)
{
    int held[AWIWI_MOST_TENDONS] = {0}, left = -1, stopped, straight = 0, changed = 1;
    awiwi_real last = 0;
    moves m;
    if (cost(s, f, here))
        return AWIWI_OUT_OF_DOMAIN;
    while (steps-- > 0) {
        vector step = {0}, bend = {0};
        if (changed) {
            split(s, held, &m);
            last = AWIWI_REAL_MAX;
            straight = changed = 0;
        }
        const awiwi_real gain = newton(s, here, &m, step, bend), longest = awiwi_largest(step, s->count);
        if (!(longest <= AWIWI_REAL_MAX))
            return AWIWI_NOT_FINITE;
        const int rounding = gain <= here->blur && 2 * longest >= last; /* nothing to gain, and no nearer */
        const int ended = longest <= s->tolerance * s->t->high || rounding;
        const awiwi_real *way = step;
        last = longest;
        if ((ended || (!straight && gain <= LITTLE * here->cost)) && here->cost > here->blur && steps > BENDS
            && awiwi_largest(bend, s->count) > 0) { /* off a saddle, or from the way to one */
            int trials = BENDS;
            const int status = take(s, bend, here->cost - here->blur, &trials, f, here, &stopped);
            if (status == AWIWI_OUT_OF_DOMAIN)
                return status;
            steps -= BENDS - trials;
            straight = status != AWIWI_OK;
            way = straight ? step : bend;
        }
        if (way == step && ended) {
            const awiwi_real share = reach(s, f, step, &stopped);
            for (int i = 0; i < s->count; i++)
                f[i] = awiwi_clamp(f[i] + share * step[i], s->t->low, s->t->high);
            left = leaving(s, here, &m, held);
            if (left < 0)
                return AWIWI_OK;
            held[left] = FREE;
            changed = 1;
            continue;
        }
        if (way == step && reach(s, f, step, &stopped) > 0) {
            const int status = take(s, step, here->cost + here->blur, &steps, f, here, &stopped);
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
    return AWIWI_NOT_CONVERGED;
}

/* -- starts -------------------------------------------------------------------------------------------------------- */

/* The least change of forces after which they give the torque; all tendons are free. */
static void correct(const task *s, const moves *m, vector v)
{
    awiwi_real G[AWIWI_MOST_JOINTS][AWIWI_MOST_JOINTS], missing[AWIWI_MOST_JOINTS], x[AWIWI_MOST_JOINTS];
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

/* Forces within the limits that give the torque, or the nearest one: those nearest to the middle of the limits, if these
   are within them. */
static int begin(task *s, const moves *m, vector f)
{
    const awiwi_real middle = s->t->low + (s->t->high - s->t->low) / 2, tolerance = s->tolerance;
    int inside = 1, status = AWIWI_OK;
    model found;
    for (int i = 0; i < s->count; i++)
        f[i] = middle;
    correct(s, m, f);
    for (int i = 0; i < s->count; i++)
        inside = inside && f[i] >= s->t->low && f[i] <= s->t->high;
    s->keep_torque = 0;
    (void)cost(s, f, &found);
    if (!inside || !(found.cost <= found.blur)) {
        for (int i = 0; i < s->count; i++)
            f[i] = middle;
        s->tolerance = 4 * AWIWI_REAL_EPSILON;
        status = descend(s, AWIWI_MOST_TORQUE_STEPS, f, &found);
        s->tolerance = tolerance;
    }
    s->keep_torque = 1;
    return status;
}

/* Move f to where one limit after the other stops the sum of forces from growing by `sense`, at the same torque. */
static void drive(const task *s, awiwi_real sense, vector f)
{
    int held[AWIWI_MOST_TENDONS] = {0}, stopped = 0;
    const awiwi_real range = s->t->high - s->t->low;
    while (stopped >= 0) {
        vector one, x, step;
        moves m;
        split(s, held, &m);
        for (int i = 0; i < s->count; i++)
            one[i] = 1;
        for (int j = 0; j < m.count; j++)
            x[j] = along(&m, m.loose[j], one);
        combine(s, &m, x, 2 * sense * range, step);
        const awiwi_real share = awiwi_largest(x, m.count) > 0 ? reach(s, f, step, &stopped) : 0;
        if (!(awiwi_largest(x, m.count) > 0) || stopped < 0)
            return;
        for (int i = 0; i < s->count; i++)
            f[i] = awiwi_clamp(f[i] + share * step[i], s->t->low, s->t->high);
        held[stopped] = AT_LOW;
    }
}

/* Whether no other forces come as near, as far as the slopes and curvatures at these tell. The cost of others exceeds
   that of these by half the square of what all entries change by, less what tendons gain that are asked to be stiffer. */
static int is_nearest_of_all(const task *s, const model *c, const moves *m)
{
    vector gradient, wanted, x;
    matrix H, sum;
    awiwi_real most = 0;
    derive(s, c, m, gradient, H, wanted);
    for (int i = 0; i < s->count; i++)
        most = awiwi_fmax(most, c->curvature[s->t->searched_tendons[i]]);
    for (int i = 0; i < s->count; i++)
        wanted[i] = wanted[i] < 0 ? MARGIN * most * wanted[i] : 0;
    add_diagonal(m, H, wanted, 0, sum);
    return awiwi_solve_positive(m->count, AWIWI_MOST_TENDONS, sum[0], 0, gradient, x) > 0;
}

int awiwi_search_forces(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                        awiwi_real *f)
{
    const int held[AWIWI_MOST_TENDONS] = {0};
    task s = {t, tau, K, t->searched, 0, {0}, {{0}}, 1, tolerance, f};
    awiwi_real least = 0;
    vector first, best;
    moves all;
    for (int j = 0; j < t->joints; j++) {
        int touched = 0;
        for (int i = 0; i < s.count; i++) {
            s.p[i][s.joints] = t->coupling[t->searched_tendons[i] * t->joints + j];
            touched = touched || awiwi_size(s.p[i][s.joints]) > 0;
        }
        s.joint[s.joints] = j;
        s.joints += touched;
    }
    split(&s, held, &all);
    const int begun = begin(&s, &all, first);
    int status = AWIWI_NOT_CONVERGED;
    for (int start = 0; start < 3; start++) { /* from there, then from as low and as high as the torque permits */
        vector trial;
        model found;
        int ended = begun;
        for (int i = 0; i < s.count; i++)
            trial[i] = first[i];
        if (start > 0)
            drive(&s, start == 1 ? -1 : 1, trial);
        if (ended == AWIWI_OK)
            ended = descend(&s, AWIWI_MOST_STIFFNESS_STEPS, trial, &found);
        if (ended != AWIWI_OK && ended != AWIWI_NOT_CONVERGED)
            return ended;
        if (start == 0 || (ended == AWIWI_OK && (status != AWIWI_OK || found.cost < least - found.blur))) {
            status = ended;
            least = found.cost;
            for (int i = 0; i < s.count; i++)
                best[i] = trial[i];
        }
        if (status == AWIWI_OK && (least <= found.blur || (start == 0 && is_nearest_of_all(&s, &found, &all))))
            break;
        if (begun != AWIWI_OK)
            break;
    }
    for (int i = 0; i < s.count; i++)
        f[t->searched_tendons[i]] = best[i];
    return status;
}
