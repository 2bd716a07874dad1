/* Direct calls of the linear algebra that the solvers share, at all sizes, and of the reader of files of numbers. */
#include "problems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "awiwi_params_file.h"

enum { NUMBERS = 3, FILE_SIZE = AWIWI_PARAMS_HEADER + NUMBERS * 8 };
enum { COUNT_AT = 16, SIZE_AT = 20, DIGEST_AT = 24, CRC_AT = 60 };

/* A matrix of small whole numbers in every fourth problem, so that pivots are equal or vanish; else of any numbers. */
static double *matrix(int number, int count)
{
    double *x = random_array(count, -2, 2);
    if (number % 4 == 1)
        coarsen(x, count, 1);
    return x;
}

static void numbers_of_any_kind(int number)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, AWIWI_REAL_MAX, -AWIWI_REAL_MAX, 0};
    const int n = 1 + number % 7;
    double *x = matrix(number, n);
    if (number % 3 == 0)
        x[number / 3 % n] = odd[number / 3 % 6];
    if (number % 15 == 0)
        x[n - 1] = odd[number / 15 % 6];
    double *found = output(1);
    found[0] = awiwi_largest(x, n);
    print("largest", awiwi_all_finite(x, n), found, 1);
    print("refuse", awiwi_refuse(number % 5, x, n), x, n);
}

static void elimination(int number)
{
    const int n = 1 + number % AWIWI_MOST_ROWS, m = 1 + number % 3;
    double *A = matrix(number, n * n), *B = matrix(number, n * m), *C = output(n * n);
    if (number % 9 == 2)
        A[number % (n * n)] = NAN;
    awiwi_product(n, A, matrix(number, n * n), C);
    print("product", n, C, n * n);
    double *factors = copy_of(A, n * n), *X = copy_of(B, n * m);
    int *order = indices(n, 0, 1);
    const int regular = awiwi_factor(n, factors, order);
    print("factors", regular, factors, n * n);
    for (int i = 0; regular && i < n; i++)
        print("row", order[i], 0, 0);
    if (regular)
        awiwi_substitute(n, m, factors, order, X);
    print("substitute", m, X, n * m);
    print("solve", awiwi_solve(n, m, A, B), B, n * m);
}

/* Symmetric matrices that are positive, have a rank of less, or are indefinite. */
static void symmetric(int number)
{
    const int n = 1 + number % AWIWI_MOST_TENDONS, width = n + number % 3, size = (n - 1) * width + n;
    const int rank = number % 5 ? n : number % n;
    double *H = output(size), *B = matrix(number, n * n), *b = matrix(number, n), *x = output(n), *pivot = output(1);
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            H[i * width + j] = i == j && number % 7 == 3 ? -0.1 * n : 0;
            for (int k = 0; k < rank; k++)
                H[i * width + j] += B[i * n + k] * B[j * n + k];
        }
    for (int i = 0; number % 4 == 1 && number % 3 == 0 && i < size; i++) /* all pivots 1: equal to the least */
        H[i] = i % (width + 1) == 0;
    *pivot = awiwi_solve_positive(n, width, H, number % 3 ? 0 : number % 4 == 1 ? 1 : 0.05, b, x);
    print("pivot", width, pivot, 1);
    print("positive", n, x, n);
    print("used", n, H, size);
}

static void few_states(int number)
{
    const int n = 1 + number % 4, rank = number / 4 % (n + 1), starts = 1 + number / 16 % 4;
    double *A = matrix(number, n * n), *B = matrix(number, n * n), *Q = random_array(n * n, 0, 0), *c = output(n);
    double *b = matrix(number, n), *K = matrix(number, n), *start = matrix(number, starts * n);
    for (int i = 0; i < n * n; i++)
        for (int k = 0; k < rank; k++)
            Q[i] += B[i / n * n + k] * B[i % n * n + k];
    print("rank", awiwi_semidefinite_rank(n, Q), 0, 0);
    Q[number % (n * n)] += number % 3 - 1 ? pow(10, random_in(-17, -4)) * (number % 3 - 1) : 0;
    print("rank of other", awiwi_semidefinite_rank(n, Q), 0, 0);
    awiwi_characteristic(n, A, c);
    print("characteristic", n, c, n);
    for (int i = 0; i < n; i++)
        A[i * n + i] -= number % 3;
    print("stable", awiwi_is_stable(n, A, b, K), 0, 0);
    for (int s = 0; s < starts; s++)
        for (int i = 0; i < n; i++)
            if (i > number % n || (number % 5 == 0 && i == s)) {
                start[s * n + i] = 0;
                for (int j = 0; j <= number % n && number % 3; j++)
                    A[i * n + j] = 0;
            }
    print("rest", awiwi_rest_decays(n, A, starts, start), 0, 0);
    double *S = output(n * n);
    const int found = awiwi_double_up(n, A, b, Q, number % 13 ? random_in(0.1, 2) : 1e-300, random_in(0.1, 3),
                                      number % 20, S);
    print("double", found, S, found ? n * n : 0);
}

/* Poles on the imaginary axis, beside others, in numbers that nothing rounds. */
static void marginal(int n)
{
    static const double c[][4] = {{1, 1, 1}, {2, 3, 3, 3}};
    double *A = random_array(n * n, 0, 0), *none = random_array(n, 0, 0);
    for (int i = 0; i < n; i++) {
        A[(n - 1) * n + i] = -c[n - 3][i];
        if (i + 1 < n)
            A[i * n + i + 1] = 1;
    }
    print("marginal", awiwi_is_stable(n, A, none, none), 0, 0);
    const double g[4] = {1, -3, 4, -3}; /* of (s^2 + 1)(s^2 + s + 1): a double zero */
    print("double zero", awiwi_stable_factor(copy_of(g, 4), output(4)), 0, 0);
}

/* Doublings that overflow somewhere, or whose first equations are singular. */
static void extremes(int number)
{
    const int n = 1 + number % 4;
    double *A = random_array(n * n, -1, 1), *b = random_array(n, -1, 1), *Q = random_array(n * n, 0, 0);
    double *S = output(n * n);
    for (int i = 0; i < n * n; i++)
        A[i] *= number % 3 ? pow(10, random_in(0, 160)) : 1;
    for (int i = 0; i < n; i++) {
        b[i] *= pow(10, random_in(-160, 160));
        Q[i * n + i] = pow(10, random_in(-160, 160));
        if (number % 30 == 1) {
            A[i * n + i] = 1;
            b[i] = Q[i * n + i] = 0;
        }
        for (int j = 0; number % 30 == 1 && j < i; j++)
            A[i * n + j] = 0;
    }
    const int found = awiwi_double_up(n, A, b, Q, 1, 1, number / 4 % 4, S);
    print("extremes", found, S, found ? n * n : 0);
}

/* Starts in a space of few dimensions and a plant that turns them out of it, both but for rounding or a little more. */
static void nearly_parallel(int number)
{
    const int n = 2 + number % 3, starts = 1 + number / 3 % 4, dimensions = 1 + number / 12 % (n - 1);
    double *A = random_array(n * n, -1, 1), *basis = random_array(dimensions * n, -1, 1);
    double *start = random_array(starts * n, -1, 1);
    for (int i = 0; i < n * n; i++)
        A[i] = i % (n + 1) ? number % 2 * A[i] * pow(10, random_in(-18, -13)) : number % 5 ? 1 : -1;
    for (int i = 0; i < starts * n; i++)
        start[i] *= number % 4 < 2 ? pow(10, random_in(-18, -13)) : 0;
    for (int s = 0; s < starts; s++)
        for (int k = 0; k < dimensions; k++) {
            const double share = random_in(-1, 1);
            for (int i = 0; i < n; i++)
                start[s * n + i] += share * basis[k * n + i];
        }
    print("nearly", awiwi_rest_decays(n, A, starts, start), 0, 0);
}

static void factor(int number)
{
    double *g = random_array(4, 0, 5), *c = output(4), a[4];
    for (int i = 0; i < 4; i++)
        a[i] = random_in(-1, 4) * (number % 4 ? 1 : scaled());
    if (number % 3) { /* of a polynomial whose factor is stable or not */
        g[0] = a[0] * a[0];
        g[1] = a[1] * a[1] - 2 * a[0] * a[2];
        g[2] = a[2] * a[2] + 2 * a[0] - 2 * a[1] * a[3];
        g[3] = a[3] * a[3] - 2 * a[2];
    }
    if (number % 17 == 0)
        g[number % 4] *= -1;
    const int found = awiwi_stable_factor(g, c);
    print("factor", found, c, found ? 4 : 0);
}

void try_parts(int number)
{
    numbers_of_any_kind(number);
    elimination(number);
    symmetric(number);
    few_states(number);
    factor(number);
    nearly_parallel(number);
    extremes(number);
    if (number < 2)
        marginal(3 + number);
}

/* -- files --------------------------------------------------------------------------------------------------------- */

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

static void seal(unsigned char *file, int size)
{
    uint32_t crc = ~UINT32_C(0);
    put(file + SIZE_AT, (uint32_t)size);
    for (int i = 0; i < size; i++)
        for (int bit = 0; bit < 8 && (i < CRC_AT || i >= CRC_AT + 4); bit++) {
            const uint32_t low = (crc ^ file[i] >> bit) & 1u;
            crc = crc >> 1 ^ (low ? UINT32_C(0xEDB88320) : 0u);
        }
    put(file + CRC_AT, ~crc);
}

/* Read a file of which `size` bytes are there. */
static void read_file(const char *name, const unsigned char *file, size_t size)
{
    static const unsigned char digest[AWIWI_PARAMS_DIGEST] = {1, 2, 3};
    static const double lowest[NUMBERS] = {-1, 0, -AWIWI_REAL_MAX}, highest[NUMBERS] = {1, 0, AWIWI_REAL_MAX};
    const awiwi_params_layout layout = {NUMBERS, digest, copy_of(lowest, NUMBERS), copy_of(highest, NUMBERS)};
    double *numbers = output(NUMBERS);
    unsigned char *there = malloc(size);
    memcpy(there, file, size);
    print(name, awiwi_params_read(there, size, &layout, numbers), numbers, NUMBERS);
    free(there);
    release();
}

void try_files(void)
{
    static const double tried[] = {0, -0.5, 1, -1, 1.5, -1.5, 1e300, -1e300, AWIWI_REAL_MAX, -AWIWI_REAL_MAX, INFINITY,
                                   -INFINITY, NAN};
    enum { TRIED = sizeof tried / sizeof tried[0], LONGER = FILE_SIZE + 16 };
    unsigned char whole[LONGER] = "AWIWIPAR", file[LONGER];
    put(whole + 8, AWIWI_PARAMS_VERSION);
    put(whole + 12, 8);
    put(whole + COUNT_AT, NUMBERS);
    memcpy(whole + DIGEST_AT, "\1\2\3", 3);
    put_number(whole, 0, 0.25);
    seal(whole, FILE_SIZE);
    print("nothing", awiwi_params_read(0, FILE_SIZE, 0, 0), 0, 0);
    for (size_t size = 0; size <= FILE_SIZE + 1; size++)
        read_file("cut", whole, size);
    for (int size = AWIWI_PARAMS_HEADER; size <= LONGER; size++) { /* sealed at another size, for that count or not */
        memcpy(file, whole, sizeof file);
        seal(file, size);
        read_file("sealed", file, (size_t)size);
        put(file + COUNT_AT, (uint32_t)(size - AWIWI_PARAMS_HEADER) / 8);
        seal(file, size);
        read_file("counted", file, (size_t)size);
    }
    for (int i = 0; i < FILE_SIZE; i++) {
        memcpy(file, whole, sizeof file);
        file[i] ^= 1;
        read_file("damaged", file, FILE_SIZE);
        seal(file, FILE_SIZE);
        read_file("other", file, FILE_SIZE);
    }
    for (int i = 0; i < TRIED * NUMBERS; i++) {
        memcpy(file, whole, sizeof file);
        put_number(file, i % NUMBERS, tried[i / NUMBERS]);
        seal(file, FILE_SIZE);
        read_file("number", file, FILE_SIZE);
    }
    for (int i = 0; i < TRIED; i++) {
        print("finite", awiwi_params_finite(copy_of(tried, i), (size_t)i), 0, 0);
        print("finite", awiwi_params_finite(copy_of(tried + i, 1), 1), 0, 0);
    }
    release();
}
