/* Tendons and curves that no finger of the Awiwi hand has, and least squares of other sizes, random and degenerate. */
#include "problems.h"

#include <math.h>
#include <stdlib.h>

typedef struct springs {
    int tendons, kind, searched; /* the first of those in no pair */
    double unit; /* of stiffness */
    calls calls;
} springs;

/* Springs of 5 kinds: that stiffen, that stiffen a lot at the end, with a constant stiffness at first, that soften
   towards the end, or with a jump after 1 N. All are refused below 0 N and beyond 200 N. */
static int follow(springs *s, int first, const double *f, double *k, double *slope, double *curvature)
{
    record(&s->calls, f, s->tendons - first);
    for (int i = 0; i < s->tendons - first; i++) {
        const double x = f[i], bend = 0.1 * (first + i + 1), late = x > 30 ? x - 30 : 0;
        if (!(x >= 0 && x <= 200))
            return 1;
        k[i] = 100 + 20 * x + bend * x * x;
        slope[i] = 20 + 2 * bend * x;
        curvature[i] = 2 * bend;
        if (s->kind == 1) {
            k[i] = 100 * exp(x / 20);
            slope[i] = k[i] / 20;
            curvature[i] = slope[i] / 20;
        } else if (s->kind == 2) {
            k[i] = 100 + 40 * late * late;
            slope[i] = 80 * late;
            curvature[i] = late > 0 ? 80 : 0;
        } else if (s->kind == 3) {
            k[i] = 50 + 4000 * x / (x + 10);
            slope[i] = 40000 / ((x + 10) * (x + 10));
            curvature[i] = -2 * slope[i] / (x + 10);
        } else if (s->kind == 4) {
            k[i] = x > 1 ? 5000 : 100;
            slope[i] = curvature[i] = 0;
        }
        k[i] *= s->unit;
        slope[i] *= s->unit;
        curvature[i] *= s->unit;
    }
    return 0;
}

static int curve(const void *context, const double *f, double *k, double *slope, double *curvature)
{
    return follow((springs *)context, 0, f, k, slope, curvature);
}

static int searched_curve(const void *context, const double *f, double *k, double *slope, double *curvature)
{
    springs *s = (springs *)context;
    return follow(s, s->searched, f, k, slope, curvature);
}

/* Ask for the torque of some forces, and for their stiffness or about that; at the edge for the most torque that the
   limits permit at the first joint, and a little more. */
static void ask(const awiwi_tendons *t, double most, int edge, double *tau, double *K)
{
    const int n = t->joints, m = t->tendons;
    const double about = t->slope ? 1 : random_in(0.8, 1.2);
    double *f = random_array(m, 0, most), *k = output(m), *slope = output(m), *curvature = output(m);
    for (int i = 0; edge && i < m; i++)
        f[i] = t->coupling[i * n] > 0 ? t->high : t->low;
    (void)t->curve(t->context, f, k, slope, curvature);
    for (int e = 0; e < n * n; e++) {
        K[e] = 0;
        tau[e / n] = 0;
        for (int i = 0; i < m; i++) {
            const double *p = t->coupling + i * n;
            tau[e / n] -= p[e / n] * f[i];
            K[e] += about * k[i] * p[e / n] * p[e % n] + (t->slope ? f[i] * t->slope[i * n * n + e] : 0);
        }
    }
    tau[0] *= edge ? 1 + pow(10, random_in(-15, -12)) : 1;
}

static double limit(int number, double usual)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, -1, 0, 210, 1e308};
    return number % 23 ? usual : odd[number / 23 % 7];
}

static void try_large_fingers(const awiwi_tendons *fitting, const double *tau, const double *K, double *f)
{
    for (int more = 0; more < 2; more++) {
        awiwi_tendons t = *fitting;
        t.joints = more ? AWIWI_MOST_JOINTS + 1 : t.joints;
        t.tendons = more ? t.tendons : AWIWI_MOST_TENDONS + 1;
        print("large", awiwi_distribute(&t, tau, K, 1e-12, 0, f), f, 0);
        print("large", awiwi_gradient_forces(&t, tau, K, 1, 1, 1, f), f, 0);
    }
}

/* Fingers with tendons in pairs, in no pair, or both, in any number of each; some with couplings that change. */
void try_tendons(int number)
{
    const int n = 1 + number % AWIWI_MOST_JOINTS, pairs = number % 5 < 3 ? number % 5 : number / 5 % 9;
    const int rest = (int)random_in(0, AWIWI_MOST_TENDONS + 0.99 - 2 * pairs), m = 2 * pairs + rest + !(pairs + rest);
    const int sloped = number % 3 == 0, size = number % 4;
    springs s = {m, number / 2 % 9 % 5, 2 * pairs, number % 11 == 4 ? 1e-4 : 1, {0, 0}};
    double *P = random_array(m * n, -0.01, 0.01), *dP = random_array(m * n * n, -0.002, 0.002);
    double *K = random_array(n * n, 0, 4 * pow(10, -size)), *tau = random_array(n, -0.3 / (1 + size), 0.3);
    awiwi_pair *pair = malloc((size_t)pairs * sizeof *pair);
    for (int p = 0; p < pairs; p++) {
        const int partner = (p ^ 1) < pairs && number % 4 < 3 ? p ^ 1 : p;
        pair[p] = (awiwi_pair){2 * p, 2 * p + 1, partner};
        for (int j = 0; j < n; j++) {
            P[2 * p * n + j] *= number % 4 == 1 || (p - j) / 2 == 0;
            if (number % 20 == 7 && p % 2) /* almost the same as the partner's */
                P[2 * p * n + j] = P[2 * (p - 1) * n + j] + 0.3 * P[2 * p * n + j];
            P[(2 * p + 1) * n + j] = -P[2 * p * n + j];
        }
    }
    if (number % 6 == 1)
        coarsen(P, m * n, 0.005), coarsen(tau, n, 0.1), coarsen(K, n * n, 0.5);
    for (int j = 0; number % 11 == 0 && j < m; j++)
        P[j * n] = 0;
    for (int j = 0; number % 14 == 3 && m > 1 && j < n; j++)
        P[(m - 1) * n + j] = P[(m - 2) * n + j] * (number % 4 - 1);
    for (int i = 0; number % 8 > 4 && n > 1 && i < m; i++) { /* two joints that are coupled, but for rounding or more */
        P[i * n + n - 1] = 0.7 * P[i * n] + (number % 3 ? random_in(-1, 1) * pow(10, -6 - number % 5) * P[i * n] : 0);
        if (i < 2 * pairs && i % 2)
            P[i * n + n - 1] = -P[(i - 1) * n + n - 1];
    }
    for (int i = 0; number % 16 == 9 && i < m * n; i++)
        P[i] *= 1e-6;
    const double usual = number % 7 ? 20 * (1 + number % 5) : number % 2 ? 205 : number % 5 + 0.25 * (number % 4);
    const awiwi_tendons t = {n, m, P, sloped ? dP : 0, curve, searched_curve, &s, limit(number, number % 5), limit(number + 11, usual),
                             pairs, pair, m - 2 * pairs, indices(m - 2 * pairs, 2 * pairs, 1)};
    if (number % 37 == 0)
        try_large_fingers(&t, tau, K, output(m));
    if (number % 10 < 7)
        ask(&t, usual, number % 10 == 4, tau, K);
    for (int j = 0; number % 10 > 6 && number % 3 && j < n; j++) /* more than the limits permit */
        tau[j] *= 10;
    for (int e = 0; s.kind == 4 && pairs == 1 && e < n * n; e++) /* a stiffness that only the jump passes */
        K[e] = 7500 * P[e / n] * P[e % n];
    if (number % 140 == 0) /* at both limits, and asked for more */
        K[0] += 50;
    if (number % 13 == 0)
        tau[number % n] = number % 2 ? NAN : 1e3;
    if (number % 17 == 5)
        K[n * n - 1] = NAN;
    if (number % 19 == 6)
        P[m * n - 1] = INFINITY;
    const double tolerance = number % 9 && s.kind < 4 ? 1e-11 : number % 2 ? 0 : 1e-3;
    double *f = output(m);
    int status = awiwi_distribute(&t, tau, K, tolerance, 0, f);
    print("distribute", status, f, m);
    print_calls(&s.calls);
    if (number % 23 && (number + 11) % 23 && number % 19 != 6) {
        f = random_array(m, 0, 90);
        status = awiwi_search_forces(&t, tau, K, tolerance, f);
        print("search", status, f, m);
        print_calls(&s.calls);
    }
    double *last = random_array(m, -5, 100);
    for (int again = 0; again < 3; again++) {
        f = output(m);
        status = awiwi_distribute(&t, tau, K, tolerance, last, f);
        print("update", status, f, m);
        print_calls(&s.calls);
        last = f;
    }
    f = output(m);
    status = awiwi_gradient_forces(&t, tau, K, number % 40, pow(10, -number % 5), random_in(0, 1), f);
    print("gradient", status, f, m);
    print_calls(&s.calls);
    free(pair);
}

/* -- least squares ------------------------------------------------------------------------------------------------- */

/* Equations of two halves of the unknowns: even ones of the first, odd ones of the second, which may be linear. */
typedef struct halves {
    int unknowns, equations, linear;
    double scale; /* of the values */
    calls calls;
} halves;

static void model(const void *context, const double *x, double *h, double *P)
{
    halves *s = (halves *)context;
    const int n = s->unknowns, half = (n + 1) / 2;
    record(&s->calls, x, n);
    for (int i = 0; i < s->equations; i++) {
        const int first = i % 2 ? half : 0, count = i % 2 ? n - half : half, linear = i % 2 && s->linear;
        h[i] = 0;
        for (int j = 0; j < n; j++)
            P[i * n + j] = 0;
        for (int j = first; j < first + count; j++) {
            const int next = first + (j - first + 1) % count;
            h[i] += linear ? (i + j + 1) % 5 * x[j] : sin(x[j] * (i + 1)) + 0.3 * x[j] * x[next];
            P[i * n + j] += linear ? (i + j + 1) % 5 : (i + 1) * cos(x[j] * (i + 1)) + 0.3 * x[next];
            if (!linear)
                P[i * n + next] += 0.3 * x[j];
        }
        h[i] *= s->scale;
        for (int j = 0; j < n; j++)
            P[i * n + j] *= s->scale;
    }
}

/* Problems for which the arrays of csrc have no room. */
static void try_large_problems(const awiwi_problem *fitting, const double *measured, const double *start, double *x)
{
    for (int more = 0; more < 2; more++) {
        awiwi_problem p = *fitting;
        p.unknowns = more ? AWIWI_MOST_UNKNOWNS + 1 : p.unknowns;
        p.equations = more ? p.equations : AWIWI_MOST_EQUATIONS + 1;
        print("large", awiwi_least_squares(&p, measured, start, 3, 1e-9, x), x, 0);
        print("large", awiwi_least_squares_in_parts(&p, 0, 0, measured, start, 3, 1e-9, x), x, 0);
        print("large", awiwi_gradient_search(&p, measured, start, 3, 0, x), x, 0);
    }
}

void try_least_squares(int number)
{
    const int n = 1 + number % AWIWI_MOST_UNKNOWNS, half = (n + 1) / 2, m = 1 + number % AWIWI_MOST_EQUATIONS;
    halves s = {n, m, number % 3 != 0, number % 12 == 7 ? 1e-9 : 1, {0, 0}};
    double *low = random_array(n, -1, 0), *high = random_array(n, 0, 1), *start = random_array(n, -1.5, 1.5);
    double *measured = random_array(m, -2 * s.scale, 2 * s.scale), *x = output(n);
    const awiwi_problem p = {model, &s, n, m, low, high};
    const awiwi_part part[2] = {{half, indices(half, 0, 1), (m + 1) / 2, indices((m + 1) / 2, 0, 2), 0},
                                {n - half, indices(n - half, half, 1), m / 2, indices(m / 2, 1, 2), s.linear}};
    if (number % 6 == 1)
        coarsen(measured, m, 1), coarsen(start, n, 0.5), coarsen(low, n, 0.5), coarsen(high, n, 0.5);
    if (number % 5 == 1) { /* a solution there is, or almost */
        double *exact = copy_of(start, n), *P = output(m * n);
        for (int j = 0; j < n; j++)
            exact[j] = awiwi_clamp(start[j] + 0.1, low[j], high[j]);
        model(&s, exact, measured, P);
        for (int i = 0; number % 2 && i < m; i++)
            measured[i] += random_in(-1, 1) * pow(10, -3 - number % 7);
    }
    if (number % 37 == 0)
        try_large_problems(&p, measured, start, output(n));
    if (number % 10 == 0)
        start[number % n] = number % 4 ? NAN : -INFINITY;
    if (number % 17 == 0)
        measured[number % m] = number % 2 ? INFINITY : 1e200;
    if (number % 29 == 3)
        high[n - 1] = NAN;
    print("least squares", awiwi_least_squares(&p, measured, start, number % 30, number % 4 ? 1e-12 : 0, x), x, n);
    print_calls(&s.calls);
    x = output(n);
    print("parts", awiwi_least_squares_in_parts(&p, 2, part, measured, start, number % 20, 1e-9, x), x, n);
    print_calls(&s.calls);
    x = output(n);
    print("descent", awiwi_gradient_search(&p, measured, start, number % 20, number % 2 ? 0 : 0.05, x), x, n);
    print_calls(&s.calls);
}
