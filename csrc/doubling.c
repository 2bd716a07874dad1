/* The Riccati equation of one input by structure-preserving doubling: a Cayley transform makes it a discrete one, whose
   closed loop is squared until it vanishes. */
#include "numerics.h"
#include "awiwi_regulators.h"
#include "dense.h"

enum { N = AWIWI_MOST_STATES };

/* Cayley transform: the discrete equation's A, G and H, which are blocks of the inverse of a Hamiltonian matrix. */
static int begin(int n, const awiwi_real *plant, const awiwi_real *b, const awiwi_real *Q,
                 awiwi_real R, awiwi_real pole, awiwi_real *A, awiwi_real *G, awiwi_real *H)
{
    const int twice = 2 * n;
    awiwi_real shifted[4 * N * N], inverse[4 * N * N];
    for (int i = 0; i < twice * twice; i++)
        inverse[i] = i % (twice + 1) ? 0 : 1;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const awiwi_real shift = i == j ? pole : 0;
            shifted[i * twice + j] = plant[i * n + j] - shift;
            shifted[i * twice + n + j] = -b[i] * b[j] / R;
            shifted[(n + i) * twice + j] = -Q[i * n + j];
            shifted[(n + i) * twice + n + j] = shift - plant[j * n + i];
        }
    if (!awiwi_solve(twice, twice, shifted, inverse))
        return 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const awiwi_real *above = inverse + i * twice, *below = inverse + (n + i) * twice;
            A[i * n + j] = (i == j ? 1 : 0) + 2 * pole * above[j];
            G[i * n + j] = -pole * (above[n + j] + inverse[j * twice + n + i]);
            H[i * n + j] = -pole * (below[j] + inverse[(n + j) * twice + i]);
        }
    return 1;
}

/* X += (Y Z + (Y Z)')/2 */
static void add_symmetric(int n, const awiwi_real *Y, const awiwi_real *Z, awiwi_real *X)
{
    awiwi_real YZ[N * N];
    awiwi_product(n, Y, Z, YZ);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            X[i * n + j] += (YZ[i * n + j] + YZ[j * n + i]) / 2;
}

/* One doubling: A <- A W A, G <- G + A W G A', H <- H + A'H W A with W = (1 + G H)^-1. */
static int redouble(int n, awiwi_real *A, awiwi_real *G, awiwi_real *H)
{
    awiwi_real W[N * N], right[2 * N * N], WA[N * N], WG[N * N], transposed[N * N], Y[N * N];
    awiwi_product(n, G, H, W);
    for (int i = 0; i < n; i++) {
        W[i * n + i] += 1;
        for (int j = 0; j < n; j++) {
            right[2 * i * n + j] = A[i * n + j];
            right[2 * i * n + n + j] = G[i * n + j];
            transposed[j * n + i] = A[i * n + j];
        }
    }
    if (!awiwi_solve(n, 2 * n, W, right))
        return 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            WA[i * n + j] = right[2 * i * n + j];
            WG[i * n + j] = right[2 * i * n + n + j];
        }
    awiwi_product(n, A, WG, Y);
    add_symmetric(n, Y, transposed, G);
    awiwi_product(n, transposed, H, Y);
    add_symmetric(n, Y, WA, H);
    awiwi_product(n, A, WA, Y);
    for (int i = 0; i < n * n; i++)
        A[i] = Y[i];
    return awiwi_all_finite(A, n * n) && awiwi_all_finite(H, n * n);
}

int awiwi_double_up(int n, const awiwi_real *plant, const awiwi_real *b, const awiwi_real *Q, awiwi_real R,
                    awiwi_real pole, int iterations, awiwi_real *S)
{
    awiwi_real A[N * N], G[N * N], left = 1;
    if (!begin(n, plant, b, Q, R, pole, A, G, S))
        return 0;
    for (int i = 0; i < iterations && left * left > AWIWI_REAL_EPSILON; i++) {
        if (!redouble(n, A, G, S))
            return 0;
        left = awiwi_largest(A, n * n);
    }
    return 1;
}
