/* Algorithm 2 of chapter 7, corrected: a gradient search among the forces that give the torque, limits as a penalty.

   Printed, the gradient is that of the last trial, taken or not, while the search stands elsewhere. Here both move
   together. A step along the projected gradient is one of alpha in an orthonormal null space of P'. */
#include "numerics.h"
#include "awiwi_distribution.h"
#include "dense.h"

typedef awiwi_real vector[AWIWI_MOST_TENDONS];

/* Orthogonal directions that span the columns of P. */
typedef struct columns {
    int count;
    vector along[AWIWI_MOST_JOINTS];
    awiwi_real square[AWIWI_MOST_JOINTS];
} columns;

/* Take from v what changes the torque. */
static void project(const awiwi_tendons *t, const columns *c, awiwi_real *v)
{
    for (int again = 0; again < 2; again++) {
        for (int k = 0; k < c->count; k++) {
            const awiwi_real share = awiwi_dot(v, c->along[k], t->tendons) / c->square[k];
            for (int i = 0; i < t->tendons; i++)
                v[i] -= share * c->along[k][i];
        }
    }
}

/* Orthogonalise the columns of P one by one, and move f along each to the nearest forces that give the torque. */
static void span(const awiwi_tendons *t, const awiwi_real *tau, columns *c, awiwi_real *f)
{
    c->count = 0;
    for (int j = 0; j < t->joints; j++) {
        awiwi_real *v = c->along[c->count];
        awiwi_real missing = tau[j], before = 0;
        for (int i = 0; i < t->tendons; i++) {
            v[i] = t->coupling[i * t->joints + j];
            missing += v[i] * f[i];
            before += v[i] * v[i];
        }
        project(t, c, v);
        c->square[c->count] = awiwi_dot(v, v, t->tendons);
        if (c->square[c->count] > 64 * AWIWI_REAL_EPSILON * before) {
            for (int i = 0; i < t->tendons; i++)
                f[i] -= missing / c->square[c->count] * v[i];
            c->count++;
        }
    }
}

/* Half of |K_q - K|^2 + weight (what lies outside the limits)^2 and its gradient, which leaves the torque; beyond the
   limits the stiffness of a tendon is that at the limit. Not 0 where the curve is left. */
static int cost(const awiwi_tendons *t, const columns *c, const awiwi_real *K, awiwi_real weight, const vector f,
                awiwi_real *total, vector gradient)
{
    const int n = t->joints;
    vector inside, k, slope, unused;
    *total = 0;
    for (int i = 0; i < t->tendons; i++) {
        inside[i] = f[i] < t->low ? t->low : f[i] > t->high ? t->high : f[i];
        *total += weight * (f[i] - inside[i]) * (f[i] - inside[i]) / 2;
        gradient[i] = weight * (f[i] - inside[i]);
    }
    if (t->curve(t->context, inside, k, slope, unused))
        return 1;
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) {
            awiwi_real excess = -(K[a * n + b] + K[b * n + a]) / 2;
            for (int i = 0; i < t->tendons; i++)
                excess += k[i] * t->coupling[i * n + a] * t->coupling[i * n + b]
                          + (t->slope ? f[i] * t->slope[(i * n + a) * n + b] : 0);
            *total += excess * excess / 2;
            for (int i = 0; i < t->tendons; i++) {
                const int permitted = f[i] >= t->low && f[i] <= t->high;
                gradient[i] += excess * ((permitted ? slope[i] : 0) * t->coupling[i * n + a] * t->coupling[i * n + b]
                                         + (t->slope ? t->slope[(i * n + a) * n + b] : 0));
            }
        }
    }
    project(t, c, gradient);
    return 0;
}

int awiwi_gradient_forces(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, int rounds,
                          awiwi_real step, awiwi_real weight, awiwi_real *f)
{
    columns c;
    vector gradient, trial, trial_gradient;
    awiwi_real best, found;
    const int usable = t->low <= t->high && awiwi_all_finite(&t->low, 1) && awiwi_all_finite(&t->high, 1);
    if (t->joints > AWIWI_MOST_JOINTS || t->tendons > AWIWI_MOST_TENDONS) /* objects of a smaller hand */
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < t->tendons; i++)
        f[i] = usable ? t->low + (t->high - t->low) / 2 : 0;
    if (!usable)
        return AWIWI_OUT_OF_DOMAIN;
    if (!awiwi_all_finite(tau, t->joints) || !awiwi_all_finite(K, t->joints * t->joints)
        || !awiwi_all_finite(t->coupling, t->tendons * t->joints))
        return AWIWI_NOT_FINITE;
    span(t, tau, &c, f);
    if (cost(t, &c, K, weight, f, &best, gradient))
        return AWIWI_OUT_OF_DOMAIN;
    for (int round = 0; round < rounds; round++) {
        for (int i = 0; i < t->tendons; i++)
            trial[i] = f[i] - step * gradient[i];
        if (cost(t, &c, K, weight, trial, &found, trial_gradient))
            return AWIWI_OUT_OF_DOMAIN;
        if (found < best) {
            best = found;
            for (int i = 0; i < t->tendons; i++) {
                f[i] = trial[i];
                gradient[i] = trial_gradient[i];
            }
        } else {
            step = step / 2;
        }
    }
    return AWIWI_OK;
}
