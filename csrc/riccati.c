/* The algebraic Riccati equation S A + A'S - S b b'S / R + Q = 0 of one input (eq. 13.5), by structure-preserving
   doubling: a Cayley transform turns it into a discrete one whose closed loop is then squared until it vanishes. */
#include <tgmath.h>

#include "awiwi_regulators.h"

enum { N = AWIWI_MOST_STATES, SYMMETRIC = N * (N + 1) / 2, DOUBLE = 2 * N, SWEEPS = 4, REFINEMENTS = 2 };

typedef awiwi_real matrix[N * N]; /* n x n, row by row */

/* A plant and its costs in coordinates z with x = diag(d) z, chosen so that their entries are of like size. */
typedef struct balanced {
    int n;
    awiwi_real d[N], b[N];
    matrix A, Q;
    awiwi_real R;
} balanced;

static awiwi_real size(awiwi_real x)
{
    return x < 0 ? -x : x;
}

static awiwi_real largest(const awiwi_real *x, int n)
{
    awiwi_real found = 0;
    for (int i = 0; i < n; i++)
        found = size(x[i]) <= found ? found : size(x[i]); /* a NaN stays */
    return found;
}

static int all_finite(const awiwi_real *x, int n)
{
    for (int i = 0; i < n; i++)
        if (!(size(x[i]) <= AWIWI_REAL_MAX))
            return 0;
    return 1;
}

static void product(int n, const awiwi_real *A, const awiwi_real *B, awiwi_real *C)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            awiwi_real sum = 0;
            for (int k = 0; k < n; k++)
                sum += A[i * n + k] * B[k * n + j];
            C[i * n + j] = sum;
        }
}

static void transposed(int n, const awiwi_real *A, awiwi_real *B)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            B[j * n + i] = A[i * n + j];
}

/* X += (Y + Y')/2. */
static void add_symmetric(int n, const awiwi_real *Y, awiwi_real *X)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            X[i * n + j] += (Y[i * n + j] + Y[j * n + i]) / 2;
}

/* Solve A X = B for the n x m matrix X, in place of B, by elimination with row exchanges; 0 if A is singular. */
static int solve(int n, int m, awiwi_real *A, awiwi_real *B)
{
    for (int k = 0; k < n; k++) {
        int p = k;
        for (int i = k + 1; i < n; i++)
            if (size(A[i * n + k]) > size(A[p * n + k]))
                p = i;
        if (!(size(A[p * n + k]) > 0))
            return 0;
        for (int j = 0; j < n; j++) {
            const awiwi_real a = A[k * n + j];
            A[k * n + j] = A[p * n + j];
            A[p * n + j] = a;
        }
        for (int j = 0; j < m; j++) {
            const awiwi_real a = B[k * m + j];
            B[k * m + j] = B[p * m + j];
            B[p * m + j] = a;
        }
        for (int i = k + 1; i < n; i++) {
            const awiwi_real f = A[i * n + k] / A[k * n + k];
            for (int j = k + 1; j < n; j++)
                A[i * n + j] -= f * A[k * n + j];
            for (int j = 0; j < m; j++)
                B[i * m + j] -= f * B[k * m + j];
        }
    }
    for (int i = n - 1; i >= 0; i--)
        for (int j = 0; j < m; j++) {
            awiwi_real sum = B[i * m + j];
            for (int k = i + 1; k < n; k++)
                sum -= A[i * n + k] * B[k * m + j];
            B[i * m + j] = sum / A[i * n + i];
        }
    return 1;
}

/* Scale every coordinate by a power of two, so that rows and columns of the Hamiltonian matrix weigh alike. */
static void balance(balanced *p)
{
    const int n = p->n;
    for (int i = 0; i < n; i++)
        p->d[i] = 1;
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (int i = 0; i < n; i++) {
            awiwi_real row = 0, column = 0, ratio;
            int exponent;
            for (int j = 0; j < n; j++) {
                row += size(p->b[i] * p->b[j] / p->R);
                column += size(p->Q[j * n + i]);
                if (j != i) {
                    row += size(p->A[i * n + j]);
                    column += size(p->A[j * n + i]);
                }
            }
            ratio = row / column;
            if (!(ratio > 0) || !(ratio <= AWIWI_REAL_MAX))
                continue;
            (void)frexp(ratio, &exponent);
            const awiwi_real f = ldexp((awiwi_real)1, exponent / 2);
            p->d[i] *= f;
            p->b[i] /= f;
            for (int j = 0; j < n; j++) {
                p->A[i * n + j] /= f;
                p->A[j * n + i] *= f;
                p->Q[i * n + j] *= f;
                p->Q[j * n + i] *= f;
            }
        }
}

/* Coefficients c[0..n-1] of det(s - A) = s^n + c[n-1] s^(n-1) + ... + c[0], after Faddeev and LeVerrier. */
static void characteristic(int n, const awiwi_real *A, awiwi_real *c)
{
    matrix M = {0}, AM;
    for (int k = 1; k <= n; k++) {
        awiwi_real trace = 0;
        for (int i = 0; i < n; i++)
            M[i * n + i] += k == 1 ? 1 : c[n - k + 1];
        product(n, A, M, AM);
        for (int i = 0; i < n; i++)
            trace += AM[i * n + i];
        c[n - k] = -trace / (awiwi_real)k;
        for (int i = 0; i < n * n; i++)
            M[i] = AM[i];
    }
}

/* Whether all eigenvalues of A have negative real parts, by the criterion of Hurwitz. */
static int stable(int n, const awiwi_real *A)
{
    awiwi_real c[N];
    if (n == 0)
        return 1;
    characteristic(n, A, c);
    for (int i = 0; i < n; i++)
        if (!(c[i] > 0))
            return 0;
    if (n == 3)
        return c[2] * c[1] > c[0];
    return n < 3 || c[3] * c[2] * c[1] > c[1] * c[1] + c[0] * c[3] * c[3];
}

/* Whether what the input cannot move is stable. Elimination brings (b, A) to Hessenberg form with the input on top; a
   pivot that vanishes but for rounding ends what it moves. */
static int stabilisable(const balanced *p)
{
    const int n = p->n;
    const awiwi_real nothing = 64 * AWIWI_REAL_EPSILON * largest(p->A, n * n);
    matrix A, rest;
    awiwi_real column[N];
    int reached = 0;
    for (int i = 0; i < n * n; i++)
        A[i] = p->A[i];
    for (int i = 0; i < n; i++)
        column[i] = p->b[i];
    for (; reached < n; reached++) {
        const int k = reached;
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (size(column[i]) > size(column[pivot]))
                pivot = i;
        if (!(size(column[pivot]) > (k ? nothing : 0)))
            break;
        for (int j = 0; j < n; j++) {
            const awiwi_real a = A[k * n + j];
            A[k * n + j] = A[pivot * n + j];
            A[pivot * n + j] = a;
        }
        for (int i = 0; i < n; i++) {
            const awiwi_real a = A[i * n + k];
            A[i * n + k] = A[i * n + pivot];
            A[i * n + pivot] = a;
        }
        const awiwi_real top = column[pivot];
        column[pivot] = column[k];
        for (int i = k + 1; i < n; i++) {
            const awiwi_real f = column[i] / top;
            for (int j = 0; j < n; j++)
                A[i * n + j] -= f * A[k * n + j];
            for (int j = 0; j < n; j++)
                A[j * n + k] += f * A[j * n + i];
        }
        for (int i = 0; i < n; i++)
            column[i] = A[i * n + k];
    }
    const int left = n - reached;
    for (int i = 0; i < left; i++)
        for (int j = 0; j < left; j++)
            rest[i * left + j] = A[(reached + i) * n + reached + j];
    return stable(left, rest);
}

/* The geometric mean of the closed loop's poles, to a power of two: their product squared is det(A)^2 + v'Q v / R with
   v = adj(A) b. Zero if one of them is zero. */
static awiwi_real mean_pole(const balanced *p)
{
    const int n = p->n;
    awiwi_real c[N], v[N], next[N], total;
    int exponent;
    characteristic(n, p->A, c);
    for (int i = 0; i < n; i++)
        v[i] = p->b[i];
    for (int k = n - 1; k > 0; k--) {
        for (int i = 0; i < n; i++) {
            next[i] = c[k] * p->b[i];
            for (int j = 0; j < n; j++)
                next[i] += p->A[i * n + j] * v[j];
        }
        for (int i = 0; i < n; i++)
            v[i] = next[i];
    }
    total = c[0] * c[0];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            total += v[i] * p->Q[i * n + j] * v[j] / p->R;
    if (!(total > 0))
        return 0;
    (void)frexp(total, &exponent);
    return ldexp((awiwi_real)1, exponent / (2 * n));
}

/* Doubling. Writes the solution in balanced coordinates; 0 if the closed loop does not vanish. */
static int doubled(const balanced *p, awiwi_real pole, int iterations, awiwi_real *H)
{
    const int n = p->n, twice = 2 * n;
    awiwi_real hamiltonian[DOUBLE * DOUBLE], both[DOUBLE * DOUBLE];
    matrix A, G, At, V, W, T;
    for (int i = 0; i < n; i++) /* A - pole over -G, beside -Q over -(A - pole)' */
        for (int j = 0; j < n; j++) {
            const awiwi_real shift = i == j ? pole : 0;
            hamiltonian[i * twice + j] = p->A[i * n + j] - shift;
            hamiltonian[i * twice + n + j] = -p->b[i] * p->b[j] / p->R;
            hamiltonian[(n + i) * twice + j] = -p->Q[i * n + j];
            hamiltonian[(n + i) * twice + n + j] = shift - p->A[j * n + i];
        }
    for (int i = 0; i < twice * twice; i++)
        both[i] = i % (twice + 1) ? 0 : 1;
    if (!solve(twice, twice, hamiltonian, both))
        return 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            A[i * n + j] = (i == j ? 1 : 0) + 2 * pole * both[i * twice + j];
            G[i * n + j] = -pole * (both[i * twice + n + j] + both[j * twice + n + i]);
            H[i * n + j] = -pole * (both[(n + i) * twice + j] + both[(n + j) * twice + i]);
        }
    for (int k = 0; k < iterations; k++) {
        product(n, G, H, W);
        for (int i = 0; i < n; i++) {
            W[i * n + i] += 1;
            for (int j = 0; j < n; j++) {
                both[i * twice + j] = A[i * n + j];
                both[i * twice + n + j] = G[i * n + j];
            }
        }
        if (!solve(n, twice, W, both))
            return 0;
        transposed(n, A, At);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                V[i * n + j] = both[i * twice + n + j];
        product(n, A, V, W);
        product(n, W, At, T);
        add_symmetric(n, T, G);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                V[i * n + j] = both[i * twice + j];
        product(n, At, H, W);
        product(n, W, V, T);
        add_symmetric(n, T, H);
        product(n, A, V, W);
        for (int i = 0; i < n * n; i++)
            A[i] = W[i];
        if (!all_finite(A, n * n) || !all_finite(H, n * n))
            return 0;
        if (largest(A, n * n) * largest(A, n * n) <= AWIWI_REAL_EPSILON)
            return 1;
    }
    return 0;
}

/* Gains of a solution, its closed loop F, the equation's left side E, and how large that is against its terms. */
static awiwi_real left_side(const balanced *p, const awiwi_real *S, awiwi_real *K, awiwi_real *F, awiwi_real *E)
{
    const int n = p->n;
    awiwi_real most = 0, worst = 0;
    for (int j = 0; j < n; j++) {
        K[j] = 0;
        for (int i = 0; i < n; i++)
            K[j] += p->b[i] * S[i * n + j] / p->R;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            awiwi_real sum = p->Q[i * n + j] - K[i] * p->R * K[j];
            awiwi_real terms = size(p->Q[i * n + j]) + size(K[i] * p->R * K[j]);
            for (int k = 0; k < n; k++) {
                const awiwi_real one = S[i * n + k] * p->A[k * n + j], other = S[j * n + k] * p->A[k * n + i];
                sum += one + other;
                terms += size(one) + size(other);
            }
            E[i * n + j] = sum;
            F[i * n + j] = p->A[i * n + j] - p->b[i] * K[j];
            most = terms > most ? terms : most;
            worst = size(sum) <= worst ? worst : size(sum);
        }
    return most > 0 ? worst / most : 0;
}

/* One step of Newton: S += X with F'X + X F = -E; 0 if there is no such X. */
static int refine(int n, const awiwi_real *F, const awiwi_real *E, awiwi_real *S)
{
    awiwi_real L[SYMMETRIC * SYMMETRIC] = {0}, x[SYMMETRIC];
    const int unknowns = n * (n + 1) / 2;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            const int row = i * (i + 1) / 2 + j;
            x[row] = -E[i * n + j];
            for (int k = 0; k < n; k++) {
                const int kj = k > j ? k * (k + 1) / 2 + j : j * (j + 1) / 2 + k;
                const int ik = i > k ? i * (i + 1) / 2 + k : k * (k + 1) / 2 + i;
                L[row * unknowns + kj] += F[k * n + i];
                L[row * unknowns + ik] += F[k * n + j];
            }
        }
    if (!solve(unknowns, 1, L, x))
        return 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            S[i * n + j] += x[i * (i + 1) / 2 + j];
            S[j * n + i] = S[i * n + j];
        }
    return 1;
}

static int solved(balanced *p, int iterations, awiwi_real *K, awiwi_real *S, awiwi_real *residual)
{
    matrix F, E;
    awiwi_real pole;
    balance(p);
    pole = mean_pole(p);
    if (!(pole > 0) || !stabilisable(p))
        return AWIWI_OUT_OF_DOMAIN;
    if (!doubled(p, pole, iterations, S))
        return AWIWI_NOT_CONVERGED;
    *residual = left_side(p, S, K, F, E);
    for (int k = 0; k < REFINEMENTS; k++)
        if (refine(p->n, F, E, S))
            *residual = left_side(p, S, K, F, E);
    return *residual * *residual <= AWIWI_REAL_EPSILON && stable(p->n, F) ? AWIWI_OK : AWIWI_NOT_CONVERGED;
}

int awiwi_riccati(int n, const awiwi_real *A, const awiwi_real *b, const awiwi_real *Q, awiwi_real R, int iterations,
                  awiwi_real *K, awiwi_real *S, awiwi_real *residual)
{
    balanced p = {.n = n, .R = R};
    int status = AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < n; i++) {
        p.b[i] = b[i];
        for (int j = 0; j < n; j++) {
            p.A[i * n + j] = A[i * n + j];
            p.Q[i * n + j] = (Q[i * n + j] + Q[j * n + i]) / 2;
        }
    }
    *residual = 1; /* that of S = 0 */
    if (!all_finite(A, n * n) || !all_finite(b, n) || !all_finite(Q, n * n) || !all_finite(&R, 1))
        status = AWIWI_NOT_FINITE;
    else if (R > 0)
        status = solved(&p, iterations, K, S, residual);
    for (int i = 0; i < n; i++) { /* back to the caller's coordinates */
        K[i] = status == AWIWI_OK ? K[i] / p.d[i] : 0;
        for (int j = 0; j < n; j++)
            S[i * n + j] = status == AWIWI_OK ? S[i * n + j] / (p.d[i] * p.d[j]) : 0;
    }
    if (status != AWIWI_OK)
        *residual = 1;
    return status;
}
