/* Tendon forces by search, for tendons that are not antagonistic pairs: a primal active-set Newton method.

   First the torque: forces within the limits with the least |tau + P' f|. Then the stiffness, in the moves that keep
   it. Tendons at a limit are held there until the slope of the cost lets them leave; all others share a Newton step, cut
   where the first of them reaches a limit. So every iterate keeps both. */
#include "numerics.h"
#include "awiwi_distribution.h"
#include "dense.h"

typedef awiwi_real vector[AWIWI_MOST_TENDONS];
typedef awiwi_real matrix[AWIWI_MOST_TENDONS][AWIWI_MOST_TENDONS];

/* What is to be minimised over the searched tendons, of which p[i] is the coupling. */
typedef struct task {
    const awiwi_tendons *t;
    const awiwi_real *tau, *K;
    const awiwi_real *p[AWIWI_MOST_TENDONS];
    int touched[AWIWI_MOST_JOINTS]; /* joints that the searched tendons move: no other torque or stiffness is theirs */
    int count;
    int keep_torque;
    awiwi_real tolerance;
    awiwi_real *f; /* of all tendons */
} task;

/* Cost, its gradient and its Hessian: that of Gauss and Newton plus a diagonal, at forces f[count]. Costs that differ
   by less than the blur are equal. */
typedef struct model {
    awiwi_real cost, blur;
    vector gradient, curvature;
    matrix hessian;
} model;

/* Orthogonal moves of the free tendons: the first `rank` change the torque, the others do not. The torque of joint
   joint[k] is changed by moves 0 to k, in proportion to lower[k]. */
typedef struct moves {
    int rank, count;
    int joint[AWIWI_MOST_JOINTS];
    awiwi_real lower[AWIWI_MOST_JOINTS][AWIWI_MOST_JOINTS];
    vector along[AWIWI_MOST_TENDONS];
    awiwi_real square[AWIWI_MOST_TENDONS];
} moves;

static const awiwi_real LEAST_SHARE = (awiwi_real)1 / 32;     /* of a unit move that is worth a direction: below 1 / 16 */
static const awiwi_real DAMPING = (awiwi_real)1 / 4096;       /* of steps where the Hessian is not positive */
static const awiwi_real BENT = 4096 * AWIWI_REAL_EPSILON;     /* negative curvature, relative to the trace */
static const awiwi_real LITTLE = (awiwi_real)1 / 16;          /* gain by a step, relative to the cost */
enum { BENDS = 8 };                                           /* trials along a direction of negative curvature */
enum { AT_LOW = -1, FREE = 0, AT_HIGH = 1 };

/* Half of |tau + P' f|^2. */
static int torque_cost(const task *s, const vector f, model *c)
{
    awiwi_real missing[AWIWI_MOST_JOINTS], trace = 0;
    c->cost = c->blur = 0;
    for (int j = 0; j < s->t->joints; j++) {
        awiwi_real terms = awiwi_size(s->tau[j]);
        missing[j] = s->touched[j] ? s->tau[j] : 0;
        for (int i = 0; i < s->count; i++) {
            missing[j] += s->p[i][j] * f[i];
            terms += awiwi_size(s->p[i][j] * f[i]);
        }
        if (awiwi_size(missing[j]) <= 4 * AWIWI_REAL_EPSILON * terms)
            missing[j] = 0;
        c->cost += missing[j] * missing[j] / 2;
        c->blur += 4 * AWIWI_REAL_EPSILON * awiwi_size(missing[j]) * terms;
    }
    for (int i = 0; i < s->count; i++) {
        c->gradient[i] = awiwi_dot(s->p[i], missing, s->t->joints);
        for (int l = 0; l <= i; l++)
            c->hessian[i][l] = c->hessian[l][i] = awiwi_dot(s->p[i], s->p[l], s->t->joints);
        trace += c->hessian[i][i];
    }
    for (int i = 0; i < s->count; i++)
        c->curvature[i] = 1024 * AWIWI_REAL_EPSILON * trace; /* of moves that do the same, the shortest */
    return 0;
}

/* Half of |K_q - K|^2, over the joints that are touched. */
static int stiffness_cost(const task *s, const vector f, model *c)
{
    const int n = s->t->joints;
    vector k, slope, curvature;
    for (int i = 0; i < s->count; i++)
        s->f[s->t->searched_tendons[i]] = f[i];
    if (s->t->curve(s->t->context, s->f, k, slope, curvature))
        return AWIWI_OUT_OF_DOMAIN;
    c->cost = c->blur = 0;
    for (int i = 0; i < s->count; i++) {
        c->gradient[i] = c->curvature[i] = 0;
        for (int l = 0; l <= i; l++)
            c->hessian[i][l] = 0;
    }
    for (int a = 0; a < n; a++) {
        for (int b = 0; b <= a; b++) {
            const awiwi_real both = a == b ? 1 : 2;
            awiwi_real excess = -(s->K[a * n + b] + s->K[b * n + a]) / 2, growth[AWIWI_MOST_TENDONS];
            if (!s->touched[a] || !s->touched[b])
                continue;
            awiwi_real terms = awiwi_size(excess);
            for (int i = 0; i < s->count; i++) {
                const int tendon = s->t->searched_tendons[i];
                const awiwi_real pp = s->p[i][a] * s->p[i][b];
                const awiwi_real change = s->t->slope ? s->t->slope[(tendon * n + a) * n + b] : 0;
                excess += k[tendon] * pp + f[i] * change;
                growth[i] = slope[tendon] * pp + change;
                terms += awiwi_size(k[tendon] * pp) + awiwi_size(f[i] * change);
            }
            const awiwi_real rounding = 4 * AWIWI_REAL_EPSILON * terms;
            c->cost += both * excess * excess / 2;
            c->blur += both * rounding * (awiwi_size(excess) + rounding);
            for (int i = 0; i < s->count; i++) {
                c->gradient[i] += both * excess * growth[i];
                c->curvature[i] += both * excess * curvature[s->t->searched_tendons[i]] * s->p[i][a] * s->p[i][b];
                for (int l = 0; l <= i; l++)
                    c->hessian[i][l] += both * growth[i] * growth[l];
            }
        }
    }
    for (int i = 0; i < s->count; i++)
        for (int l = 0; l < i; l++)
            c->hessian[l][i] = c->hessian[i][l];
    return 0;
}

static int cost(const task *s, const vector f, model *c)
{
    return s->keep_torque ? stiffness_cost(s, f, c) : torque_cost(s, f, c);
}

/* Take from v what lies along the moves found so far, twice for the sake of rounding; sum what was taken. */
static void project(const task *s, const moves *m, vector v, awiwi_real *taken)
{
    for (int again = 0; again < 2; again++) {
        for (int k = 0; k < m->count; k++) {
            const awiwi_real share = awiwi_dot(v, m->along[k], s->count) / m->square[k];
            for (int i = 0; i < s->count; i++)
                v[i] -= share * m->along[k][i];
            if (taken)
                taken[k] += share;
        }
    }
}

static void keep(const task *s, moves *m, const vector v, awiwi_real square)
{
    for (int i = 0; i < s->count; i++)
        m->along[m->count][i] = v[i];
    m->square[m->count++] = square;
}

/* Split what the free tendons can do. The unit moves' remainders always add up to what is missing, in squares. */
static void split(const task *s, const int *held, moves *m)
{
    int free = 0;
    m->count = 0;
    for (int j = 0; s->keep_torque && j < s->t->joints; j++) {
        awiwi_real taken[AWIWI_MOST_TENDONS] = {0}, before;
        vector row;
        for (int i = 0; i < s->count; i++)
            row[i] = held[i] == FREE ? s->p[i][j] : 0;
        before = awiwi_dot(row, row, s->count);
        project(s, m, row, taken);
        const awiwi_real after = awiwi_dot(row, row, s->count);
        if (after > 64 * AWIWI_REAL_EPSILON * before) {
            for (int k = 0; k < m->count; k++)
                m->lower[m->count][k] = taken[k];
            m->lower[m->count][m->count] = 1;
            m->joint[m->count] = j;
            keep(s, m, row, after);
        }
    }
    m->rank = m->count;
    for (int i = 0; i < s->count; i++)
        free += held[i] == FREE;
    for (int i = 0; i < s->count && m->count < free; i++) {
        vector unit = {0};
        unit[i] = 1;
        if (held[i] != FREE)
            continue;
        project(s, m, unit, 0);
        if (awiwi_dot(unit, unit, s->count) > LEAST_SHARE)
            keep(s, m, unit, awiwi_dot(unit, unit, s->count));
    }
}

/* The sum of the moves that keep the torque, x times each; its largest entry is `size` if that is not 0. */
static void combine(const task *s, const moves *m, const vector x, awiwi_real size, vector sum)
{
    for (int i = 0; i < s->count; i++) {
        sum[i] = 0;
        for (int j = m->rank; j < m->count; j++)
            sum[i] += x[j - m->rank] * m->along[j][i];
    }
    const awiwi_real largest = awiwi_largest(sum, s->count);
    for (int i = 0; awiwi_size(size) > 0 && i < s->count; i++)
        sum[i] *= size / largest;
}

/* Newton's step of the free tendons along the moves that are allowed; where the Hessian is not positive, a damped
   Gauss-Newton step. Returns the predicted decrease. `bend` becomes a downhill direction along which the cost curves
   down, as long as the range of forces. Both are zero before, and stay so where there is none. */
static awiwi_real newton(const task *s, const model *c, const moves *m, vector step, vector bend)
{
    const int n = m->count - m->rank;
    const awiwi_real range = s->t->high - s->t->low, near = c->cost / (range * range);
    matrix H, full;
    vector b, x, product;
    awiwi_real trace = 0, pivot, shift = 0;
    for (int j = 0; j < n; j++) {
        const awiwi_real *v = m->along[m->rank + j];
        b[j] = -awiwi_dot(v, c->gradient, s->count);
        for (int i = 0; i < s->count; i++)
            product[i] = awiwi_dot(c->hessian[i], v, s->count);
        for (int l = 0; l <= j; l++)
            H[j][l] = awiwi_dot(m->along[m->rank + l], product, s->count);
        trace += H[j][j];
    }
    const awiwi_real least = 64 * AWIWI_REAL_EPSILON * trace, flat = awiwi_sqrt(AWIWI_REAL_EPSILON) * trace;
    do { /* little damping near the demand: where tendons do the same, the cost is flat along exchanges between them */
        for (int j = 0; j < n; j++) {
            for (int l = 0; l <= j; l++) {
                full[j][l] = l == j ? H[j][l] + shift : H[j][l];
                for (int i = 0; i < s->count; i++)
                    full[j][l] += m->along[m->rank + j][i] * c->curvature[i] * m->along[m->rank + l][i];
            }
        }
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
    awiwi_real price[AWIWI_MOST_JOINTS] = {0};
    awiwi_real most = 256 * AWIWI_REAL_EPSILON * awiwi_largest(c->gradient, s->count);
    int found = -1;
    for (int k = m->rank - 1; k >= 0; k--) {
        awiwi_real sum = -awiwi_dot(m->along[k], c->gradient, s->count) / m->square[k];
        for (int l = k + 1; l < m->rank; l++)
            sum -= m->lower[l][k] * price[m->joint[l]];
        price[m->joint[k]] = sum;
    }
    for (int i = 0; i < s->count; i++) {
        const awiwi_real gain = (awiwi_real)held[i] * (c->gradient[i] + awiwi_dot(s->p[i], price, s->t->joints));
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

int awiwi_search_forces(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
                        awiwi_real *f)
{
    const awiwi_real starts[3] = {t->low + (t->high - t->low) / 2, t->low, t->high};
    task s = {t, tau, K, {0}, {0}, t->searched, 1, tolerance, f};
    awiwi_real least = 0;
    vector best, trial;
    model found;
    int status = AWIWI_NOT_CONVERGED;
    for (int i = 0; i < s.count; i++) {
        s.p[i] = t->coupling + t->searched_tendons[i] * t->joints;
        for (int j = 0; j < t->joints; j++)
            s.touched[j] = s.touched[j] || awiwi_size(s.p[i][j]) > 0;
    }
    for (int start = 0; start < 3; start++) {
        for (int i = 0; i < s.count; i++)
            trial[i] = starts[start];
        task torque = s;
        torque.keep_torque = 0;
        torque.tolerance = 4 * AWIWI_REAL_EPSILON;
        int ended = descend(&torque, AWIWI_MOST_TORQUE_STEPS, trial, &found);
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
        if (status == AWIWI_OK && least <= found.blur)
            break; /* exactly what was asked for */
    }
    for (int i = 0; i < s.count; i++)
        f[t->searched_tendons[i]] = best[i];
    return status;
}
