/* Optimal gains of a joint with a spring between motor and link, without a Riccati equation (chapters 13 and 14).

   The optimal loop's polynomial c(s) = s^4 + c3 s^3 + c2 s^2 + c1 s + c0 is the stable factor of

       c(s) c(-s) = a(s) a(-s) + (x's share of the cost)/R,

   so that c0 is known and, in units of time that make it 1, c3^2 = g3 + 2 c2, c1^2 = g1 + 2 c2 and
   F(c2) = c2^2 + 2 - g2 - 2 c1 c3 = 0. F is convex; its largest zero is the stable factor; and since c1 c3 is at most
   (t c3^2 + c1^2/t)/2, a zero of a parabola bounds it from above for any t > 0, closely if t is near c1/c3. From there
   Newton's method converges from above without fail. A last gain only says where to start. */
#include "numerics.h"
#include "awiwi_regulators.h"
#include "dense.h"

enum { POLISHES = 6 };

/* The joint in units of time that make c0 = 1: squared frequency and damping of link and motor against a held spring;
   costs over R b^2; what the first and third gain add up to. */
typedef struct scaled {
    awiwi_real time, link, motor, brake, drag, q2, q3, q4, sum;
} scaled;

/* Gains over the motor's inertia: of link angle (h), link speed (g), motor angle (e), motor speed (f). */
typedef struct gains {
    awiwi_real h, g, e, f;
} gains;

static awiwi_real root(awiwi_real x)
{
    return x > 0 ? awiwi_sqrt(x) : 0;
}

static scaled scale(const awiwi_joint *j, const awiwi_real *q, awiwi_real R)
{
    const awiwi_real cost = 1 / (R * j->motor * j->motor), sum = awiwi_sqrt((q[0] + q[2]) * cost);
    const awiwi_real rate2 = awiwi_sqrt(j->spring / j->link * sum), time2 = 1 / rate2, time = awiwi_sqrt(time2);
    return (scaled){.time = time,
                    .link = j->spring / j->link * time2,
                    .motor = j->spring / j->motor * time2,
                    .brake = j->link_friction / j->link * time,
                    .drag = j->motor_friction / j->motor * time,
                    .q2 = q[1] * cost * time2,
                    .q3 = q[2] * cost * time2 * time2,
                    .q4 = q[3] * cost * time2,
                    .sum = sum * time2};
}

/* The polynomial's coefficients under gains; returns whether it is stable. */
static int coefficients(const scaled *p, const gains *x, awiwi_real *c1, awiwi_real *c2, awiwi_real *c3)
{
    *c3 = p->brake + p->drag + x->f;
    *c2 = p->link + p->motor + p->brake * p->drag + x->e + p->brake * x->f;
    *c1 = p->link * (p->drag + x->f + x->g) + p->brake * (p->motor + x->e);
    return *c3 > 0 && *c1 > 0 && *c2 > *c1 / *c3 + *c3 / *c1;
}

/* The stable factor, by Newton's method from above; t guesses c1/c3. Unknown is what c2 exceeds the plant's by. */
static gains descend(const scaled *p, awiwi_real t, int iterations)
{
    const awiwi_real a3 = p->brake + p->drag, a2 = p->link + p->motor + p->brake * p->drag;
    const awiwi_real a1 = p->link * p->drag + p->brake * p->motor, curve = p->brake * p->brake - 2 * p->link;
    const awiwi_real w1 = p->link * p->link * (p->q2 + p->q4) + p->q3 * curve, w2 = p->q3 + p->q4 * curve;
    const awiwi_real g1 = a1 * a1 + w1, g2 = a2 * a2 - 2 * a1 * a3 + w2, g3 = a3 * a3 - 2 * a2 + p->q4;
    const awiwi_real half = t + 1 / t, square = half * half - 2 + g2 + t * g3 + g1 / t;
    awiwi_real rise = half + root(square) - a2, step = rise, c1, c3, f, k1;
    for (int i = 0;; i++) {
        c3 = root(g3 + 2 * (a2 + rise));
        c1 = root(g1 + 2 * (a2 + rise));
        f = (2 * rise + p->q4) / (c3 + a3);
        k1 = (2 * (a2 + rise) + w1) / (c1 + a1);
        const awiwi_real slope = 2 * (a2 + rise - c1 / c3 - c3 / c1);
        if (i == iterations || !(slope > 0) || !(step * step > AWIWI_REAL_EPSILON * (a2 + rise) * (a2 + rise)))
            break;
        step = (rise * (rise + 2 * a2) - w2 + 2 - 2 * (k1 * c3 + a1 * f)) / slope;
        rise -= step;
    }
    const awiwi_real e = rise - p->brake * f;
    const awiwi_real h = p->sum - e;
    const awiwi_real g = ((e * (e + 2 * p->motor) - p->q3) / (2 * p->link) + h) / c3;
    return (gains){.h = h, .g = g, .e = e, .f = f};
}

/* The gains of motor speed and link angle that belong to that of the motor angle; returns de/df. */
static awiwi_real follow(const scaled *p, gains *x)
{
    const awiwi_real slope = root(p->drag * p->drag + 2 * x->e + p->q4);
    x->f = (2 * x->e + p->q4) / (p->drag + slope);
    x->h = p->sum - x->e;
    return slope;
}

/* The same four equations in the gains themselves, where nothing large cancels: Newton's method in e and g. Returns
   whether it came to rest. */
static int polish(const scaled *p, gains *x)
{
    const awiwi_real wl = p->link, wm = p->motor, d = p->brake;
    awiwi_real rest = 1;
    for (int i = 0; i < POLISHES; i++) {
        const awiwi_real slope = follow(p, x);
        const awiwi_real e = x->e, f = x->f, g = x->g, h = x->h, df = 1 / slope, c3 = d + p->drag + f;
        const awiwi_real lead = h - d * g;
        const awiwi_real P = e * e + 2 * wm * e - p->q3 - 2 * wl * (c3 * g - h);
        const awiwi_real U = wl * (p->q2 - g * g + 2 * g * (c3 + d) - 2 * h) +
                             2 * d * (c3 * lead - e * g - wm * (f + g)) + 2 * (h * (e + wm) - wm * e);
        const awiwi_real Pe = 2 * (e + wm - wl * (df * g + 1)), Pg = -2 * wl * c3;
        const awiwi_real Ue = 2 * (wl * (g * df + 1) + d * (df * lead - c3 - g - wm * df) + h - e - 2 * wm);
        const awiwi_real Ug = 2 * (wl * (c3 + d - g) - d * (d * c3 + e + wm)), det = Pe * Ug - Pg * Ue;
        const awiwi_real de = (P * Ug - Pg * U) / det, dg = (Pe * U - P * Ue) / det;
        x->e -= de;
        x->g -= dg;
        rest = awiwi_fmax(awiwi_size(de) / (awiwi_size(e) + awiwi_size(h)),
                          awiwi_size(dg) / (awiwi_size(g) + awiwi_size(f)));
        if (!(rest > 4 * AWIWI_REAL_EPSILON))
            break;
    }
    follow(p, x);
    return rest * rest <= AWIWI_REAL_EPSILON;
}

static int in_domain(const awiwi_joint *j, const awiwi_real *q, awiwi_real R)
{
    const int plant = j->link > 0 && j->motor > 0 && j->spring > 0 && j->link_friction >= 0 && j->motor_friction >= 0;
    return plant && R > 0 && q[0] >= 0 && q[1] >= 0 && q[2] >= 0 && q[3] >= 0 && q[0] + q[2] > 0;
}

int awiwi_joint_gains(const awiwi_joint *joint, const awiwi_real *q, awiwi_real R, const awiwi_real *last,
                      int iterations, awiwi_real *K)
{
    const awiwi_real numbers[] = {
        joint->link, joint->motor, joint->spring, joint->link_friction, joint->motor_friction, R,
    };
    const int known = awiwi_all_finite(last, 4);
    int status = AWIWI_NOT_FINITE;
    for (int i = 0; i < 4; i++)
        K[i] = known ? last[i] : 0;
    if (!awiwi_all_finite(numbers, 6) || !awiwi_all_finite(q, 4))
        return status;
    if (!in_domain(joint, q, R))
        return AWIWI_OUT_OF_DOMAIN;
    const scaled p = scale(joint, q, R);
    const awiwi_real once = p.time / joint->motor, twice = p.time * once;
    const gains before = {.g = K[1] * once, .e = K[2] * twice, .f = K[3] * once};
    awiwi_real c1, c2, c3;
    const int usable = coefficients(&p, &before, &c1, &c2, &c3);
    gains x = descend(&p, usable ? c1 / c3 : 1, iterations);
    if (!polish(&p, &x) || !coefficients(&p, &x, &c1, &c2, &c3))
        return AWIWI_NOT_CONVERGED;
    K[0] = x.h / twice;
    K[1] = x.g / once;
    K[2] = x.e / twice;
    K[3] = x.f / once;
    return AWIWI_OK;
}

int awiwi_refuse(int status, awiwi_real *u, int n)
{
    if (awiwi_all_finite(u, n))
        return status;
    for (int i = 0; i < n; i++)
        u[i] = 0;
    return AWIWI_NOT_FINITE;
}
