/* Plants of any scale for the regulators, some with modes that the input does not reach, and joints with any costs. */
#include "problems.h"

#include <math.h>

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
void try_regulator(int number)
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
    if (number % 29 == 1)
        Q[number / 29 % (n * n)] = number % 2 ? NAN : INFINITY;
    if (number % 29 == 2)
        b[number / 29 % n] = NAN;
    const double R = number % 31 ? scaled() : number % 3 ? -(number % 2) : INFINITY;
    for (int i = 0; number % 43 == 7 && i < n * n; i++) /* products of poles overflow */
        A[i] *= 1e60;
    const int status = awiwi_riccati(n, A, b, Q, R, number % 50, K, S, residual);
    print("riccati", status, K, n);
    print("cost", status, S, n * n);
    print("residual", status, residual, 1);
}

void try_joint(int number)
{
    static const double odd[] = {-1e-3, 0, NAN, INFINITY};
    awiwi_joint plant = {1e-3 * scaled(), 1e-3 * scaled(), scaled(), number % 2 ? 0 : 1e-3 * scaled(),
                               number % 3 ? 0 : 1e-3 * scaled()};
    double *Q = random_array(4, -1e-3, -1e-3), *last = random_array(4, 0, 0), *K = output(4);
    Q[0] = number % 11 ? scaled() : 0;
    Q[1] = number % 4 ? scaled() : 0;
    Q[2] = number % 5 ? scaled() : 0;
    Q[3] = number % 7 ? 1 : number % 2 ? -1e-3 : 0;
    const double R = number % 41 ? scaled() : 0;
    double *const parts[] = {&plant.link, &plant.motor, &plant.spring, &plant.link_friction, &plant.motor_friction,
                             &Q[0], &Q[1], &Q[2], &Q[3]};
    if (number % 8 == 3)
        *parts[number / 8 % 9] = odd[number / 72 % 4];
    if (number % 3 == 0)
        last = random_array(4, -100, 100);
    if (number % 3 == 1) /* near the optimum */
        (void)awiwi_joint_gains(&plant, Q, R * 1.1, last, 60, last);
    if (number % 23 == 0)
        last[number % 4] = NAN;
    print("joint", awiwi_joint_gains(&plant, Q, R, last, number % 60, K), K, 4);
}

/* Gains of the impedance law, what feedback they amount to, and starts beside them, on either side of the roots. */
void try_law(int number)
{
    double *gains = random_array(4, 0.2, 3), *plant = random_array(3, 0.3, 3), *weights = random_array(2, 0.3, 3);
    double *start = copy_of(gains, 4), *feedback = output(4), *found = output(4);
    if (number % 10 == 3)
        gains[3] = gains[2];
    if (number % 12 == 5)
        gains[1] = plant[0] * (gains[2] + gains[3]);
    if (number % 9 == 4) /* numbers that nothing rounds: the first residual is zero */
        coarsen(gains, 4, 0.5);
    for (int i = 0; number % 9 == 4 && i < 3; i++)
        plant[i] = weights[i % 2] = 1;
    const double m = plant[0], over = plant[1] / plant[2], q = weights[0] / weights[1] + gains[2] * gains[3];
    const double sum = gains[2] + gains[3], soft = 1 / weights[0];
    feedback[0] = over * gains[0] * q;
    feedback[1] = over * (gains[3] * soft + gains[1] * q + gains[0] * sum);
    feedback[2] = over * (q + (soft + gains[1] * sum + gains[0]) / m);
    feedback[3] = over * (gains[1] / m + sum);
    for (int i = 0; i < 4; i++)
        start[i] = gains[i] * (number % 9 == 4 ? 1 : number % 3 ? random_in(0.9, 1.1) : random_in(0.3, 3));
    if (number % 8 == 1)
        start[1] = m * (start[2] + start[3]);
    if (number % 7 == 0)
        start[3] = start[2];
    if (number % 19 == 0)
        feedback[number % 4] = number % 2 ? NAN : 1e200;
    print("law", awiwi_law_gains(feedback, plant, weights, start, found), found, 4);
}
