/* Problems that no kernel of the Awiwi hand poses: random tendons and curves, least squares of other sizes, plants of
   any scale, files of numbers with every kind of damage. `make mutants` runs this program; it prints all results. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "awiwi.h"
#include "awiwi_params_file.h"
#include "dense.h"

enum { PROBLEMS = 150, JOINTS = 4, TENDONS = 8, NUMBERS = 3, FILE_SIZE = AWIWI_PARAMS_HEADER + NUMBERS * 8 };
enum { COUNT_AT = 16, SIZE_AT = 20, DIGEST_AT = 24, CRC_AT = 60 };

static uint32_t seed = 1;

static double random_in(double low, double high)
{
    seed = seed * 1664525u + 1013904223u;
    return low + (high - low) * (seed >> 8) / 16777216.0;
}

static void fill(double *x, int count, double low, double high)
{
    for (int i = 0; i < count; i++)
        x[i] = random_in(low, high);
}

static void print(const char *name, int status, const double *x, int count)
{
    printf("%s %d", name, status);
    for (int i = 0; i < count; i++)
        printf(" %a", x[i]);
    printf("\n");
}

/* Springs that stiffen; beyond 200 N they are refused. */
static int curve(const void *context, const double *f, double *k, double *slope, double *curvature)
{
    const int *tendons = context;
    for (int i = 0; i < *tendons; i++) {
        if (!(f[i] >= 0 && f[i] <= 200))
            return 1;
        k[i] = 100 + 20 * f[i] + 0.1 * (i + 1) * f[i] * f[i];
        slope[i] = 20 + 0.2 * (i + 1) * f[i];
        curvature[i] = 0.2 * (i + 1);
    }
    return 0;
}

/* A finger with tendons in pairs, in no pair, or both; every third one has couplings that change. */
static void tendons(int number)
{
    static const int all[TENDONS] = {0, 1, 2, 3, 4, 5, 6, 7};
    const int n = 1 + number % JOINTS, pairs = number % 3, m = 2 * pairs + 1 + number % (TENDONS - 2 * pairs);
    double P[TENDONS * JOINTS], dP[TENDONS * JOINTS * JOINTS], K[JOINTS * JOINTS], tau[JOINTS], f[TENDONS];
    awiwi_pair pair[2] = {{0, 1, 0}, {2, 3, 1}};
    if (pairs == 2 && number % 4 < 2)
        pair[0].partner = 1, pair[1].partner = 0;
    const awiwi_tendons t = {n, m, P, number % 3 ? 0 : dP, curve, &m, number % 5, number % 7 ? 90 : 220, pairs, pair,
                             m - 2 * pairs, all + 2 * pairs};
    fill(P, m * n, -0.01, 0.01);
    fill(dP, m * n * n, -0.002, 0.002);
    fill(K, n * n, 0, 3);
    fill(tau, n, -0.3, 0.3);
    for (int p = 0; p < pairs; p++)
        for (int j = 0; j < n; j++)
            P[(2 * p + 1) * n + j] = -P[2 * p * n + j];
    for (int j = 0; number % 11 == 0 && j < m; j++)
        P[j * n] = 0;
    if (number % 13 == 0)
        tau[0] = number % 2 ? NAN : 1e3;
    if (number % 17 == 5)
        K[n * n - 1] = NAN;
    if (number % 19 == 6)
        P[m * n - 1] = INFINITY;
    print("distribute", awiwi_distribute(&t, tau, K, 1e-11, f), f, m);
    fill(f, m, 0, 90);
    print("search", awiwi_search_forces(&t, tau, K, 1e-11, f), f, m);
    fill(f, m, -10, 100);
    print("gradient", awiwi_gradient_forces(&t, tau, K, number % 40, 1e-3, random_in(0, 1), f), f, m);
}

static void model(const void *context, const double *x, double *h, double *P)
{
    const int *sizes = context; /* unknowns, equations */
    for (int i = 0; i < sizes[1]; i++) {
        h[i] = 0;
        for (int j = 0; j < sizes[0]; j++) {
            h[i] += sin(x[j] * (i + 1)) + 0.3 * x[j] * x[(j + 1) % sizes[0]];
            P[i * sizes[0] + j] = (i + 1) * cos(x[j] * (i + 1));
        }
        for (int j = 0; j < sizes[0]; j++) {
            P[i * sizes[0] + j] += 0.3 * x[(j + 1) % sizes[0]];
            P[i * sizes[0] + (j + 1) % sizes[0]] += 0.3 * x[j];
        }
    }
}

static void least_squares(int number)
{
    const int sizes[2] = {1 + number % 4, 1 + number % 7};
    double low[4], high[4], start[4], measured[7], x[4];
    const awiwi_problem p = {model, sizes, sizes[0], sizes[1], low, high};
    fill(low, 4, -1, 0);
    fill(high, 4, 0, 1);
    fill(start, 4, -1.5, 1.5);
    fill(measured, 7, -2, 2);
    if (number % 10 == 0)
        start[0] = NAN;
    if (number % 17 == 0)
        measured[0] = INFINITY;
    print("least squares", awiwi_least_squares(&p, measured, start, number % 30, 1e-12, x), x, sizes[0]);
    print("descent", awiwi_gradient_search(&p, measured, start, number % 20, number % 2 ? 0 : 0.05, x), x, sizes[0]);
}

static double scaled(void)
{
    return pow(10, random_in(-6, 6));
}

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
    const int n = 1 + number % 4, rank = number % (n + 1), cut = number % 5 < 2 ? number % n : n;
    double A[16], b[4], B[16], Q[16] = {0}, K[4], S[16], residual[1], size[4];
    fill(A, n * n, -2, 2);
    fill(b, n, -1, 1);
    fill(B, n * n, -1, 1);
    for (int i = 0; i < n; i++)
        size[i] = number % 6 ? 1 : scaled();
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
    for (int i = 0; number % 37 == 1 && i < n; i++)
        b[i] *= 1e-200; /* costs overflow */
    if (number % 9 == 0)
        Q[n * n - 1] -= pow(10, random_in(-18, 0));
    if (number % 29 == 0)
        A[0] = NAN;
    const double R = number % 31 ? scaled() : -(number % 2);
    const int status = awiwi_riccati(n, A, b, Q, R, number % 50, K, S, residual);
    print("riccati", status, K, n);
    print("cost", status, S, n * n);
    print("residual", status, residual, 1);
    print("semidefinite", awiwi_semidefinite_rank(n, Q), 0, 0);
}

static void joint(int number)
{
    const awiwi_joint plant = {1e-3 * scaled(), 1e-3 * scaled(), scaled(), number % 2 ? 0 : 1e-3 * scaled(),
                               number % 3 ? 0 : 1e-3 * scaled()};
    const double Q[4] = {scaled(), number % 4 ? scaled() : 0, number % 5 ? scaled() : 0, number % 7 ? 1 : -1e-3};
    double last[4] = {0}, K[4];
    if (number % 3 == 0)
        fill(last, 4, -100, 100);
    if (number % 23 == 0)
        last[1] = NAN;
    print("joint", awiwi_joint_gains(&plant, Q, number % 41 ? scaled() : 0, last, number % 60, K), K, 4);
}

static void put(unsigned char *place, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        place[i] = (unsigned char)(value >> 8 * i);
}

static void put_number(unsigned char *file, int index, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(file + AWIWI_PARAMS_HEADER + 8 * index, (uint32_t)bits);
    put(file + AWIWI_PARAMS_HEADER + 8 * index + 4, (uint32_t)(bits >> 32));
}

static void seal(unsigned char *file)
{
    uint32_t crc = ~UINT32_C(0);
    for (int i = 0; i < FILE_SIZE; i++)
        for (int bit = 0; bit < 8 && (i < CRC_AT || i >= CRC_AT + 4); bit++) {
            const uint32_t low = (crc ^ file[i] >> bit) & 1u;
            crc = crc >> 1 ^ (low ? UINT32_C(0xEDB88320) : 0u);
        }
    put(file + CRC_AT, ~crc);
}

static void read(const char *name, const unsigned char *file, size_t size)
{
    static const unsigned char digest[AWIWI_PARAMS_DIGEST] = {1, 2, 3};
    static const double low[NUMBERS] = {-1, 0, -AWIWI_REAL_MAX}, high[NUMBERS] = {1, 0, AWIWI_REAL_MAX};
    const awiwi_params_layout layout = {NUMBERS, digest, low, high};
    double numbers[NUMBERS] = {7, 7, 7};
    const int status = awiwi_params_read(file, size, &layout, numbers);
    print(name, status, numbers, NUMBERS);
}

static void files(void)
{
    static const double tried[] = {0, -0.5, 1, -1, 1.5, -1.5, 1e300, -1e300, AWIWI_REAL_MAX, -AWIWI_REAL_MAX, INFINITY,
                                   -INFINITY, NAN};
    unsigned char whole[FILE_SIZE + 1] = "AWIWIPAR", file[FILE_SIZE + 1];
    put(whole + 8, AWIWI_PARAMS_VERSION);
    put(whole + 12, 8);
    put(whole + COUNT_AT, NUMBERS);
    put(whole + SIZE_AT, FILE_SIZE);
    memcpy(whole + DIGEST_AT, "\1\2\3", 3);
    put_number(whole, 0, 0.25);
    seal(whole);
    read("nothing", 0, FILE_SIZE);
    for (size_t size = 0; size <= FILE_SIZE + 1; size++)
        read("cut", whole, size);
    for (int i = 0; i < FILE_SIZE; i++) {
        memcpy(file, whole, sizeof file);
        file[i] ^= 1;
        read("damaged", file, FILE_SIZE);
        seal(file);
        read("other", file, FILE_SIZE);
    }
    for (int i = 0; i < (int)(sizeof tried / sizeof tried[0]) * NUMBERS; i++) {
        memcpy(file, whole, sizeof file);
        put_number(file, i % NUMBERS, tried[i / NUMBERS]);
        seal(file);
        read("number", file, FILE_SIZE);
    }
    for (int i = 0; i < (int)(sizeof tried / sizeof tried[0]); i++)
        print("finite", awiwi_params_finite(tried, (size_t)i), 0, 0);
}

int main(void)
{
    for (int number = 0; number < PROBLEMS; number++) {
        tendons(number);
        least_squares(number);
        regulator(number);
        joint(number);
    }
    files();
    return 0;
}
