/* Problems that no kernel of the Awiwi hand poses: random tendons and curves, least squares of other sizes, plants of
   any scale, with every kind of degeneracy. `make mutants` runs this program; it prints all results. */
#include "problems.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PROBLEMS = 900, ARRAYS = 64 };

static uint32_t seed;
static void *arrays[ARRAYS];
static int array_count;

/* Random numbers that depend on no other problem. */
static void begin(int number, int kind)
{
    seed = 6 * (uint32_t)number + (uint32_t)kind;
    for (int i = 0; i < 4; i++)
        (void)random_in(0, 1);
}

double random_in(double low, double high)
{
    seed = seed * 1664525u + 1013904223u;
    return low + (high - low) * (seed >> 8) / 16777216.0;
}

double scaled(void)
{
    return pow(10, random_in(-6, 6));
}

static void *array(int count, size_t size)
{
    if (array_count == ARRAYS)
        abort();
    return arrays[array_count++] = malloc((size_t)count * size);
}

double *random_array(int count, double low, double high)
{
    double *x = array(count, sizeof *x);
    for (int i = 0; i < count; i++)
        x[i] = random_in(low, high);
    return x;
}

double *copy_of(const double *x, int count)
{
    return memcpy(array(count, sizeof *x), x, (size_t)count * sizeof *x);
}

double *output(int count)
{
    return random_array(count, -77, -77);
}

int *indices(int count, int first, int step)
{
    int *x = array(count, sizeof *x);
    for (int i = 0; i < count; i++)
        x[i] = first + step * i;
    return x;
}

void release(void)
{
    while (array_count > 0)
        free(arrays[--array_count]);
}

void coarsen(double *x, int count, double grid)
{
    for (int i = 0; i < count; i++)
        x[i] = grid * round(x[i] / grid);
}

void print(const char *name, int status, const double *x, int count)
{
    printf("%s %d", name, status);
    for (int i = 0; i < count; i++)
        if (isnan(x[i]))
            printf(" nan");
        else
            printf(" %a", x[i]);
    printf("\n");
}

void record(calls *c, const double *x, int count)
{
    c->count++;
    for (int i = 0; i < count; i++) {
        uint64_t bits = 1;
        if (!isnan(x[i]))
            memcpy(&bits, &x[i], sizeof bits);
        c->digest = (c->digest ^ bits) * 0x100000001B3u;
        c->digest ^= c->digest >> 32;
    }
}

void print_calls(const calls *c)
{
    printf("calls %d %llx\n", c->count, (unsigned long long)c->digest);
}

/* -- tendons ------------------------------------------------------------------------------------------------------- */

typedef struct springs {
    int tendons, kind;
    calls calls;
} springs;

/* Springs of 4 kinds: that stiffen, that stiffen a lot at the end, with a constant stiffness at first, or that soften
   towards the end. All are refused below 0 N and beyond 200 N. */
static int curve(const void *context, const double *f, double *k, double *slope, double *curvature)
{
    springs *s = (springs *)context;
    record(&s->calls, f, s->tendons);
    for (int i = 0; i < s->tendons; i++) {
        const double x = f[i], bend = 0.1 * (i + 1), late = x > 30 ? x - 30 : 0;
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
        }
    }
    return 0;
}

/* Ask for the torque of some forces, and for their stiffness or about that. */
static void ask(const awiwi_tendons *t, double most, double *tau, double *K)
{
    const int n = t->joints, m = t->tendons;
    const double about = t->slope ? 1 : random_in(0.8, 1.2);
    double *f = random_array(m, 0, most), *k = output(m), *slope = output(m), *curvature = output(m);
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
}

static double limit(int number, double usual)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, -1, 0, 210, 1e308};
    return number % 23 ? usual : odd[number / 23 % 7];
}

/* Fingers with tendons in pairs, in no pair, or both, in any number of each; some with couplings that change. */
static void tendons(int number)
{
    const int n = 1 + number % AWIWI_MOST_JOINTS, pairs = number % 5 < 3 ? number % 5 : number / 5 % 9;
    const int rest = (int)random_in(0, AWIWI_MOST_TENDONS + 0.99 - 2 * pairs), m = 2 * pairs + rest + !(pairs + rest);
    const int sloped = number % 3 == 0, size = number % 4;
    springs s = {m, number / 2 % 4, {0, 0}};
    double *P = random_array(m * n, -0.01, 0.01), *dP = random_array(m * n * n, -0.002, 0.002);
    double *K = random_array(n * n, 0, 4 * pow(10, -size)), *tau = random_array(n, -0.3 / (1 + size), 0.3);
    awiwi_pair *pair = malloc((size_t)pairs * sizeof *pair);
    for (int p = 0; p < pairs; p++) {
        const int partner = (p ^ 1) < pairs && number % 4 < 3 ? p ^ 1 : p;
        pair[p] = (awiwi_pair){2 * p, 2 * p + 1, partner};
        for (int j = 0; j < n; j++) {
            P[2 * p * n + j] *= number % 4 == 1 || (p - j) / 2 == 0;
            P[(2 * p + 1) * n + j] = -P[2 * p * n + j];
        }
    }
    if (number % 6 == 1)
        coarsen(P, m * n, 0.005), coarsen(tau, n, 0.1), coarsen(K, n * n, 0.5);
    for (int j = 0; number % 11 == 0 && j < m; j++)
        P[j * n] = 0;
    for (int j = 0; number % 14 == 3 && m > 1 && j < n; j++)
        P[(m - 1) * n + j] = P[(m - 2) * n + j] * (number % 4 - 1);
    const double usual = number % 7 ? 20 * (1 + number % 5) : number % 2 ? 205 : number % 5;
    const awiwi_tendons t = {n, m, P, sloped ? dP : 0, curve, &s, limit(number, number % 5), limit(number + 11, usual),
                             pairs, pair, m - 2 * pairs, indices(m - 2 * pairs, 2 * pairs, 1)};
    if (number % 10 < 7)
        ask(&t, usual, tau, K);
    if (number % 13 == 0)
        tau[number % n] = number % 2 ? NAN : 1e3;
    if (number % 17 == 5)
        K[n * n - 1] = NAN;
    if (number % 19 == 6)
        P[m * n - 1] = INFINITY;
    const double tolerance = number % 9 ? 1e-11 : number % 2 ? 0 : 1e-3;
    double *f = output(m);
    int status = awiwi_distribute(&t, tau, K, tolerance, f);
    print("distribute", status, f, m);
    print_calls(&s.calls);
    if (number % 23 && (number + 11) % 23 && number % 19 != 6) {
        f = random_array(m, 0, 90);
        status = awiwi_search_forces(&t, tau, K, tolerance, f);
        print("search", status, f, m);
        print_calls(&s.calls);
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
    }
}

static void least_squares(int number)
{
    const int n = 1 + number % AWIWI_MOST_UNKNOWNS, half = (n + 1) / 2, m = 1 + number % AWIWI_MOST_EQUATIONS;
    halves s = {n, m, number % 3 != 0, {0, 0}};
    double *low = random_array(n, -1, 0), *high = random_array(n, 0, 1), *start = random_array(n, -1.5, 1.5);
    double *measured = random_array(m, -2, 2), *x = output(n);
    const awiwi_problem p = {model, &s, n, m, low, high};
    const awiwi_part part[2] = {{half, indices(half, 0, 1), (m + 1) / 2, indices((m + 1) / 2, 0, 2), 0},
                                {n - half, indices(n - half, half, 1), m / 2, indices(m / 2, 1, 2), s.linear}};
    if (number % 6 == 1)
        coarsen(measured, m, 1), coarsen(start, n, 0.5), coarsen(low, n, 0.5), coarsen(high, n, 0.5);
    if (number % 5 == 1) { /* a solution there is */
        double *exact = copy_of(start, n), *P = output(m * n);
        for (int j = 0; j < n; j++)
            exact[j] = awiwi_clamp(start[j] + 0.1, low[j], high[j]);
        model(&s, exact, measured, P);
    }
    if (number % 10 == 0)
        start[number % n] = number % 4 ? NAN : -INFINITY;
    if (number % 17 == 0)
        measured[number % m] = number % 2 ? INFINITY : 1e200;
    if (number % 29 == 3)
        high[n - 1] = NAN;
    print("least squares", awiwi_least_squares(&p, measured, start, number % 30, 1e-12, x), x, n);
    print_calls(&s.calls);
    x = output(n);
    print("parts", awiwi_least_squares_in_parts(&p, 2, part, measured, start, number % 20, 1e-9, x), x, n);
    print_calls(&s.calls);
    x = output(n);
    print("descent", awiwi_gradient_search(&p, measured, start, number % 20, number % 2 ? 0 : 0.05, x), x, n);
    print_calls(&s.calls);
}

/* -- regulators ---------------------------------------------------------------------------------------------------- */

/* Another basis for the first and the last state: what the input does not reach is then zero up to rounding only. */
static void turn(int n, double *A, double *b, double angle)
{
    const double c = cos(angle), s = sin(angle);
    const int last = n - 1;
    for (int k = 0; k < 2 * n + 1 && n > 1; k++) { /* rows of [A b], then columns of A */
        double *x = k < n ? A + k : k == n ? b : A + (k - n - 1) * n;
        double *y = k < n ? x + last * n : x + last;
        const double first = *x;
        *x = c * first - s * *y;
        *y = s * first + c * *y;
    }
}

/* Plants with modes that the input does not reach; costs of any rank and size, or negative by a little. */
static void regulator(int number)
{
    const int n = 1 + number / 3 % 4, rank = number % (n + 1), cut = number % 5 < 2 ? number % n : n;
    double *A = random_array(n * n, -2, 2), *b = random_array(n, -1, 1), *B = random_array(n * n, -1, 1), size[4];
    double *Q = random_array(n * n, 0, 0), *K = output(n), *S = output(n * n), *residual = output(1);
    for (int i = 0; i < n; i++)
        size[i] = number % 6 ? 1 : scaled();
    if (number % 8 == 1)
        coarsen(A, n * n, 1), coarsen(b, n, 1), coarsen(B, n * n, 1);
    for (int i = 0; i < n * n; i++)
        for (int k = 0; k < rank; k++)
            Q[i] += size[i / n] * size[i % n] * B[i / n * n + k] * B[i % n * n + k];
    for (int i = cut; i < n; i++) { /* a part of its own, without input or reached by little */
        b[i] = number % 4 ? 0 : 1e-13 * b[i];
        for (int j = 0; j < cut; j++)
            A[i * n + j] = 0;
        A[i * n + i] -= 3 * (number % 3);
    }
    if (number % 2)
        turn(n, A, b, random_in(0, 3));
    for (int i = 0; number % 7 == 6 && i < n * n; i++) /* units that differ */
        A[i] *= pow(10, 3 * (i % n - i / n));
    for (int i = 0; number % 37 == 1 && i < n; i++)
        b[i] *= 1e-200; /* costs overflow */
    if (number % 9 == 0)
        Q[n * n - 1] -= pow(10, random_in(-18, 0));
    if (number % 29 == 0)
        A[number % (n * n)] = NAN;
    const double R = number % 31 ? scaled() : number % 3 ? -(number % 2) : INFINITY;
    const int status = awiwi_riccati(n, A, b, Q, R, number % 50, K, S, residual);
    print("riccati", status, K, n);
    print("cost", status, S, n * n);
    print("residual", status, residual, 1);
}

static void joint(int number)
{
    const awiwi_joint plant = {1e-3 * scaled(), 1e-3 * scaled(), scaled(), number % 2 ? 0 : 1e-3 * scaled(),
                               number % 3 ? 0 : 1e-3 * scaled()};
    double *Q = random_array(4, -1e-3, -1e-3), *last = random_array(4, 0, 0), *K = output(4);
    Q[0] = number % 11 ? scaled() : 0;
    Q[1] = number % 4 ? scaled() : 0;
    Q[2] = number % 5 ? scaled() : 0;
    Q[3] = number % 7 ? 1 : number % 2 ? -1e-3 : 0;
    const double R = number % 41 ? scaled() : 0;
    if (number % 3 == 0)
        last = random_array(4, -100, 100);
    if (number % 3 == 1) /* near the optimum */
        (void)awiwi_joint_gains(&plant, Q, R * 1.1, last, 60, last);
    if (number % 23 == 0)
        last[number % 4] = NAN;
    print("joint", awiwi_joint_gains(&plant, Q, R, last, number % 60, K), K, 4);
}

/* Gains of the impedance law, what feedback they amount to, and starts beside them, on either side of the roots. */
static void law(int number)
{
    double *gains = random_array(4, 0.2, 3), *plant = random_array(3, 0.3, 3), *weights = random_array(2, 0.3, 3);
    double *start = copy_of(gains, 4), *feedback = output(4), *found = output(4);
    if (number % 10 == 3)
        gains[3] = gains[2];
    if (number % 12 == 5)
        gains[1] = plant[0] * (gains[2] + gains[3]);
    const double m = plant[0], over = plant[1] / plant[2], q = weights[0] / weights[1] + gains[2] * gains[3];
    const double sum = gains[2] + gains[3], soft = 1 / weights[0];
    feedback[0] = over * gains[0] * q;
    feedback[1] = over * (gains[3] * soft + gains[1] * q + gains[0] * sum);
    feedback[2] = over * (q + (soft + gains[1] * sum + gains[0]) / m);
    feedback[3] = over * (gains[1] / m + sum);
    for (int i = 0; i < 4; i++)
        start[i] = gains[i] * (number % 3 ? random_in(0.9, 1.1) : random_in(0.3, 3));
    if (number % 7 == 0)
        start[3] = start[2];
    if (number % 19 == 0)
        feedback[number % 4] = number % 2 ? NAN : 1e200;
    print("law", awiwi_law_gains(feedback, plant, weights, start, found), found, 4);
}

int main(void)
{
    static void (*const tries[])(int) = {tendons, least_squares, regulator, joint, law, try_parts};
    for (int number = 0; number < PROBLEMS; number++) {
        for (int kind = 0; kind < 6; kind++) {
            begin(number, kind);
            tries[kind](number);
            release();
        }
    }
    try_files();
    return 0;
}
