/* Bounded least squares: joint angles from measured tendon lengths, eq. 5.14 and 5.24. */
#include "numerics.h"
#include "awiwi_solvers.h"
#include "dense.h"

static const awiwi_real NEARBY = (awiwi_real)0.25; /* steps that tell of the curvature: longer ones cross valleys */

typedef awiwi_real vector[AWIWI_MOST_UNKNOWNS];
typedef awiwi_real matrix[AWIWI_MOST_UNKNOWNS][AWIWI_MOST_UNKNOWNS];

/* Values and Jacobian of all equations at a point. */
typedef struct values {
    awiwi_real h[AWIWI_MOST_EQUATIONS], P[AWIWI_MOST_EQUATIONS * AWIWI_MOST_UNKNOWNS];
} values;

/* What is minimised over a part, in its own order: half the squared residual, its gradient, and the lower half of J'J;
   also how far rounding may move the result. */
typedef struct sums {
    awiwi_real cost, blur;
    vector gradient;
    matrix normal;
} sums;

static void add_up(const awiwi_problem *p, const awiwi_part *b, const awiwi_real *measured, const values *v, sums *s)
{
    const int unknowns = b->unknowns;
    awiwi_real total = 0, terms = 0;
    vector slope;
    for (int j = 0; j < unknowns; j++) {
        s->gradient[j] = 0;
        for (int k = 0; k <= j; k++)
            s->normal[j][k] = 0;
    }
    for (int i = 0; i < b->equations; i++) {
        const int e = b->equation[i];
        const awiwi_real residual = v->h[e] - measured[e];
        const awiwi_real *row = v->P + e * p->unknowns;
        total += residual * residual;
        terms += awiwi_size(residual) * (awiwi_size(v->h[e]) + awiwi_size(measured[e]));
        for (int j = 0; j < unknowns; j++) {
            const awiwi_real here = row[b->unknown[j]];
            awiwi_real *normal = s->normal[j];
            slope[j] = here;
            s->gradient[j] += here * residual;
            for (int k = 0; k <= j; k++)
                normal[k] += here * slope[k];
        }
    }
    s->blur = 4 * AWIWI_REAL_EPSILON * terms;
    s->cost = total / 2;
}

/* One part, of all. */
static awiwi_part whole(const awiwi_problem *p, int *every)
{
    const awiwi_part all = {p->unknowns, every, p->equations, every, 0};
    for (int i = 0; i < p->equations || i < p->unknowns; i++)
        every[i] = i;
    return all;
}

/* Whether local arrays hold the problem: kernels of a larger hand must not run with these objects. */
static int fits(const awiwi_problem *p)
{
    return p->unknowns <= AWIWI_MOST_UNKNOWNS && p->equations <= AWIWI_MOST_EQUATIONS;
}

/* Solve (A + damping diag A) x = -b for the unknowns not held, by Cholesky without roots; A's lower half is read.
   Returns whether the matrix is positive definite. */
static int damped_step(int n, matrix A, const vector b, const int *held, awiwi_real damping, vector x)
{
    matrix L;
    vector d;
    int definite = 1;
    for (int j = 0; j < n; j++) {
        d[j] = held[j] ? 1 : A[j][j] + damping * A[j][j];
        x[j] = held[j] ? 0 : -b[j];
        for (int k = 0; k < j; k++) {
            awiwi_real sum = held[j] || held[k] ? 0 : A[j][k];
            for (int i = 0; i < k; i++)
                sum -= L[j][i] * d[i] * L[k][i];
            L[j][k] = d[k] > 0 ? sum / d[k] : 0;
            d[j] -= L[j][k] * L[j][k] * d[k];
            x[j] -= L[j][k] * x[k];
        }
        definite = definite && d[j] > 0;
    }
    for (int j = n - 1; j >= 0; j--) {
        x[j] = d[j] > 0 ? x[j] / d[j] : 0;
        for (int k = j + 1; k < n; k++)
            x[j] -= L[k][j] * x[k];
    }
    return definite;
}

/* What the curvature of the equations adds to J'J, per root of the cost: learnt from steps, and gone with the residuals. */
typedef struct bending {
    int known;
    matrix added;
} bending;

/* The step from a point: with the curvature, if it is known and leaves a minimum, else that of Gauss and Newton. */
static void step_from(int n, sums *s, const bending *c, const int *held, awiwi_real damping, vector step)
{
    if (c->known) {
        const awiwi_real size = awiwi_sqrt(s->cost);
        matrix A;
        for (int j = 0; j < n; j++)
            for (int k = 0; k <= j; k++)
                A[j][k] = s->normal[j][k] + size * c->added[j][k];
        if (damped_step(n, A, s->gradient, held, damping, step))
            return;
    }
    (void)damped_step(n, s->normal, s->gradient, held, damping, step);
}

/* Correct the curvature after a step to where the cost is not zero: the least change that explains the new gradient
   (Powell's symmetric form of Broyden's update). */
static void learn(int n, const sums *from, const sums *to, const vector step, bending *c)
{
    const awiwi_real size = awiwi_sqrt(to->cost);
    vector missing;
    awiwi_real square = 0, along = 0;
    if (!c->known)
        for (int j = 0; j < n; j++)
            for (int k = 0; k <= j; k++)
                c->added[j][k] = 0;
    c->known = 1;
    for (int j = 0; j < n; j++) {
        missing[j] = to->gradient[j] - from->gradient[j];
        for (int k = 0; k < n; k++) {
            const int row = k < j ? j : k, column = k < j ? k : j;
            const awiwi_real mean = (from->normal[row][column] + to->normal[row][column]) / 2;
            missing[j] -= (mean + size * c->added[row][column]) * step[k];
        }
        missing[j] /= size;
        square += step[j] * step[j];
        along += missing[j] * step[j];
    }
    for (int j = 0; j < n; j++)
        for (int k = 0; k <= j; k++)
            c->added[j][k] += (missing[j] * step[k] + step[j] * missing[k] - along / square * step[j] * step[k]) / square;
}

/* Clamp the start into the box; a start that is not a number becomes the middle of the box. */
static int begin(const awiwi_problem *p, const awiwi_real *measured, const awiwi_real *start, awiwi_real *q)
{
    const int finite = awiwi_all_finite(measured, p->equations) && awiwi_all_finite(start, p->unknowns);
    for (int j = 0; j < p->unknowns; j++)
        q[j] = awiwi_all_finite(start + j, 1) ? awiwi_clamp(start[j], p->low[j], p->high[j])
                                              : (p->low[j] + p->high[j]) / 2;
    return finite;
}

/* Values of a linear part after a move of its unknowns; the Jacobian stays. */
static void shift(const awiwi_problem *p, const awiwi_part *b, const vector move, const values *from, values *to)
{
    *to = *from;
    for (int i = 0; i < b->equations; i++)
        for (int j = 0; j < b->unknowns; j++)
            to->h[b->equation[i]] += from->P[b->equation[i] * p->unknowns + b->unknown[j]] * move[j];
}

/* From q, with its values, down to the minimum over one part. */
static int descend(const awiwi_problem *p, const awiwi_part *b, const awiwi_real *measured, const values *begun,
                   int iterations, awiwi_real tolerance, awiwi_real *q)
{
    sums two[2];
    int now = 0; /* which of the two belongs to q; the other is that of the trial */
    values last = *begun, there;
    vector step, trial;
    bending learnt;
    awiwi_real damping = 0, last_length = AWIWI_REAL_MAX, previous = tolerance;
    learnt.known = 0;
    add_up(p, b, measured, &last, &two[now]);
    if (!(two[now].cost <= AWIWI_REAL_MAX))
        return AWIWI_NOT_FINITE;
    for (int i = 1; i < iterations; i++) {
        sums *here = &two[now];
        int held[AWIWI_MOST_UNKNOWNS];
        awiwi_real longest = 0, left = here->cost; /* of the cost after the step, but for curvature */
        int free = !(damping > 0); /* whether the step is that of Gauss and Newton, within the box */
        for (int j = 0; j < b->unknowns; j++) { /* at a limit and pushed against it */
            const int u = b->unknown[j];
            held[j] = (q[u] <= p->low[u] && here->gradient[j] >= 0) || (q[u] >= p->high[u] && here->gradient[j] <= 0);
            free = free && !held[j];
        }
        step_from(b->unknowns, here, &learnt, held, damping, step);
        for (int j = 0; j < p->unknowns; j++)
            trial[j] = q[j];
        for (int j = 0; j < b->unknowns; j++) {
            const int u = b->unknown[j];
            const awiwi_real aim = q[u] + step[j];
            trial[u] = awiwi_clamp(aim, p->low[u], p->high[u]);
            free = free && aim >= p->low[u] && aim <= p->high[u];
            step[j] = trial[u] - q[u];
            left += here->gradient[j] * step[j] / 2;
            longest = awiwi_size(step[j]) > longest ? awiwi_size(step[j]) : longest;
        }
        if (!awiwi_all_finite(trial, p->unknowns))
            return AWIWI_NOT_FINITE;
        /* Steps shorten by a constant share where lengths are inconsistent: what is left follows from two of them.
           Short steps that do not shorten are rounding. */
        const int settled = longest <= tolerance &&
                            (longest * longest <= tolerance / 16 * previous || longest >= previous);
        /* where nothing is left, steps shorten as Newton's do */
        const int next_to_nothing = free && left <= here->blur &&
                                    awiwi_ends_with(longest, last_length, tolerance / 64, 1);
        /* the first step of a linear part ends at the minimum */
        const int ended = settled || next_to_nothing || (free && b->linear);
        last_length = free ? longest : AWIWI_REAL_MAX;
        previous = longest;
        if (!ended) {
            if (b->linear)
                shift(p, b, step, &last, &there);
            else
                p->model(p->context, trial, there.h, there.P);
            add_up(p, b, measured, &there, &two[!now]);
        }
        /* near the bottom rounding decides which cost is lower, and the step is still right */
        if (!ended && !(two[!now].cost <= here->cost + two[!now].blur)) {
            damping = damping > 0 ? damping * 10 : (awiwi_real)0.001;
            learnt.known = 0;
            continue;
        }
        for (int j = 0; j < b->unknowns; j++)
            q[b->unknown[j]] = trial[b->unknown[j]];
        if (ended)
            return AWIWI_OK;
        if (b->linear)
            last = there;
        else if (two[!now].cost > here->cost / 16 && longest < NEARBY && longest * longest > tolerance)
            /* else steps are Newton's, or so short that they tell rounding */
            learn(b->unknowns, here, &two[!now], step, &learnt);
        damping = damping / 10;
        now = !now;
    }
    return AWIWI_NOT_CONVERGED;
}

int awiwi_least_squares_in_parts(const awiwi_problem *p, int parts, const awiwi_part *part,
                                 const awiwi_real *measured, const awiwi_real *start, int iterations,
                                 awiwi_real tolerance, awiwi_real *q)
{
    int status = AWIWI_OK;
    values begun;
    if (!fits(p))
        return AWIWI_OUT_OF_DOMAIN;
    if (!begin(p, measured, start, q))
        return AWIWI_NOT_FINITE;
    p->model(p->context, q, begun.h, begun.P);
    for (int i = 0; i < parts; i++) {
        const int ended = descend(p, part + i, measured, &begun, iterations, tolerance, q);
        if (ended == AWIWI_NOT_FINITE)
            return ended;
        status = ended == AWIWI_OK ? status : ended;
    }
    return status;
}

int awiwi_least_squares(const awiwi_problem *p, const awiwi_real *measured, const awiwi_real *start, int iterations,
                        awiwi_real tolerance, awiwi_real *q)
{
    int every[AWIWI_MOST_UNKNOWNS + AWIWI_MOST_EQUATIONS];
    if (!fits(p))
        return AWIWI_OUT_OF_DOMAIN;
    const awiwi_part all = whole(p, every);
    return awiwi_least_squares_in_parts(p, 1, &all, measured, start, iterations, tolerance, q);
}

int awiwi_gradient_search(const awiwi_problem *p, const awiwi_real *measured, const awiwi_real *start, int iterations,
                          awiwi_real step, awiwi_real *q)
{
    int every[AWIWI_MOST_UNKNOWNS + AWIWI_MOST_EQUATIONS];
    values at;
    vector trial;
    sums here, there;
    awiwi_real curvature = 0;
    if (!fits(p))
        return AWIWI_OUT_OF_DOMAIN;
    const awiwi_part all = whole(p, every);
    if (!begin(p, measured, start, q))
        return AWIWI_NOT_FINITE;
    p->model(p->context, q, at.h, at.P);
    add_up(p, &all, measured, &at, &here);
    for (int j = 0; j < p->unknowns; j++)
        curvature += here.normal[j][j];
    if (!(step > 0))
        step = curvature > 0 ? 1 / curvature : 0;
    for (int i = 0; i < iterations; i++) {
        for (int j = 0; j < p->unknowns; j++) /* the gradient of the whole square is twice that of half of it */
            trial[j] = awiwi_clamp(q[j] - 2 * step * here.gradient[j], p->low[j], p->high[j]);
        p->model(p->context, trial, at.h, at.P);
        add_up(p, &all, measured, &at, &there);
        if (there.cost < here.cost) {
            here = there;
            for (int j = 0; j < p->unknowns; j++)
                q[j] = trial[j];
        } else {
            step = step / 2;
        }
    }
    return AWIWI_OK;
}
