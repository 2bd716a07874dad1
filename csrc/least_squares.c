/* Bounded least squares: joint angles from measured tendon lengths, eq. 5.14 and 5.24. */
#include "numerics.h"
#include "awiwi_solvers.h"
#include "dense.h"

typedef awiwi_real vector[AWIWI_MOST_UNKNOWNS];
typedef awiwi_real matrix[AWIWI_MOST_UNKNOWNS][AWIWI_MOST_UNKNOWNS];

/* The part of a row of the Jacobian outside which it is zero: most equations depend on few unknowns. */
static void find_nonzero(const awiwi_real *row, int *first, int *end)
{
    while (*end > *first && awiwi_size(row[*end - 1]) <= 0)
        --*end;
    while (*first < *end && awiwi_size(row[*first]) <= 0)
        ++*first;
}

/* Half the squared residual, its gradient, and the lower half of J'J, at q; also how far rounding may move the result. */
static awiwi_real cost(const awiwi_problem *p, const awiwi_real *measured, const awiwi_real *q, vector gradient,
                       matrix normal, awiwi_real *blur)
{
    awiwi_real h[AWIWI_MOST_EQUATIONS], P[AWIWI_MOST_EQUATIONS * AWIWI_MOST_UNKNOWNS];
    awiwi_real total = 0, terms = 0;
    p->model(p->context, q, h, P);
    for (int j = 0; j < p->unknowns; j++) {
        gradient[j] = 0;
        for (int k = 0; k <= j; k++)
            normal[j][k] = 0;
    }
    for (int i = 0; i < p->equations; i++) {
        const awiwi_real *row = P + i * p->unknowns;
        const awiwi_real residual = h[i] - measured[i];
        total += residual * residual;
        terms += awiwi_size(residual) * (awiwi_size(h[i]) + awiwi_size(measured[i]));
        int first = 0, end = p->unknowns;
        find_nonzero(row, &first, &end);
        for (int j = first; j < end; j++) {
            gradient[j] += row[j] * residual;
            for (int k = first; k <= j; k++)
                normal[j][k] += row[j] * row[k];
        }
    }
    *blur = 4 * AWIWI_REAL_EPSILON * terms;
    return total / 2;
}

/* Solve (A + damping diag A) x = -b for the unknowns not held, by Cholesky without roots; A's lower half is read. */
static void damped_step(int n, matrix A, const vector b, const int *held, awiwi_real damping, vector x)
{
    matrix L;
    vector d;
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
    }
    for (int j = n - 1; j >= 0; j--) {
        x[j] = d[j] > 0 ? x[j] / d[j] : 0;
        for (int k = j + 1; k < n; k++)
            x[j] -= L[k][j] * x[k];
    }
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

int awiwi_least_squares(const awiwi_problem *p, const awiwi_real *measured, const awiwi_real *start, int iterations,
                        awiwi_real tolerance, awiwi_real *q)
{
    vector gradient[2], step, trial;
    matrix normal[2];
    int here = 0; /* which of the two belongs to q; the other is that of the trial */
    awiwi_real damping = 0, blur;
    if (!begin(p, measured, start, q))
        return AWIWI_NOT_FINITE;
    awiwi_real best = cost(p, measured, q, gradient[here], normal[here], &blur);
    if (!(best <= AWIWI_REAL_MAX))
        return AWIWI_NOT_FINITE;
    for (int i = 1; i < iterations; i++) {
        int held[AWIWI_MOST_UNKNOWNS];
        awiwi_real longest = 0;
        for (int j = 0; j < p->unknowns; j++) /* at a limit and pushed against it */
            held[j] = (q[j] <= p->low[j] && gradient[here][j] >= 0) || (q[j] >= p->high[j] && gradient[here][j] <= 0);
        damped_step(p->unknowns, normal[here], gradient[here], held, damping, step);
        for (int j = 0; j < p->unknowns; j++) {
            trial[j] = awiwi_clamp(q[j] + step[j], p->low[j], p->high[j]);
            longest = awiwi_size(trial[j] - q[j]) > longest ? awiwi_size(trial[j] - q[j]) : longest;
        }
        if (!awiwi_all_finite(trial, p->unknowns))
            return AWIWI_NOT_FINITE;
        /* near the bottom rounding decides which cost is lower, and the step is still right */
        const int last = longest <= tolerance;
        const awiwi_real found = last ? best : cost(p, measured, trial, gradient[!here], normal[!here], &blur);
        if (!(found <= best + blur)) {
            damping = damping > 0 ? damping * 10 : (awiwi_real)0.001;
            continue;
        }
        for (int j = 0; j < p->unknowns; j++)
            q[j] = trial[j];
        if (last)
            return AWIWI_OK;
        best = found;
        damping = damping / 10;
        here = !here;
    }
    return AWIWI_NOT_CONVERGED;
}

int awiwi_gradient_search(const awiwi_problem *p, const awiwi_real *measured, const awiwi_real *start, int iterations,
                          awiwi_real step, awiwi_real *q)
{
    vector gradient, trial_gradient, trial;
    matrix normal;
    awiwi_real blur, curvature = 0;
    if (!begin(p, measured, start, q))
        return AWIWI_NOT_FINITE;
    awiwi_real best = cost(p, measured, q, gradient, normal, &blur);
    for (int j = 0; j < p->unknowns; j++)
        curvature += normal[j][j];
    if (!(step > 0))
        step = curvature > 0 ? 1 / curvature : 0;
    for (int i = 0; i < iterations; i++) {
        for (int j = 0; j < p->unknowns; j++) /* the gradient of the whole square is twice that of half of it */
            trial[j] = awiwi_clamp(q[j] - 2 * step * gradient[j], p->low[j], p->high[j]);
        const awiwi_real found = cost(p, measured, trial, trial_gradient, normal, &blur);
        if (found < best) {
            best = found;
            for (int j = 0; j < p->unknowns; j++) {
                q[j] = trial[j];
                gradient[j] = trial_gradient[j];
            }
        } else {
            step = step / 2;
        }
    }
    return AWIWI_OK;
}
