/* The algebraic Riccati equation S A + A'S - S b b'S/R + Q = 0 of one input (eq. 13.5), by structure-preserving
   doubling: a Cayley transform makes it a discrete one, whose closed loop is squared until it vanishes. */
#include <tgmath.h>

#include "awiwi_regulators.h"
#include "dense.h"

enum {
    N = AWIWI_MOST_STATES,
    UNKNOWNS = N * (N + 1) / 2,
    SWEEPS = 4,     /* of balancing */
    REFINEMENTS = 4 /* steps of Newton at the end, at most */
};

/* A plant and its costs in coordinates z with x = diag(d) z, whose entries are of like size. */
typedef struct plant {
    int n;
    awiwi_real d[N], A[N * N], b[N], Q[N * N], R;
} plant;

/* A candidate: gains, closed loop A - b K, the equation's left side E, and how large that is against its terms. */
typedef struct solution {
    awiwi_real S[N * N], K[N], loop[N * N], E[N * N], residual;
} solution;

/* Scale every coordinate by a power of two, so that its row and its column of the Hamiltonian matrix weigh alike. */
static void balance(plant *p)
{
    const int n = p->n;
    for (int i = 0; i < n; i++)
        p->d[i] = 1;
    for (int turn = 0; turn < SWEEPS * n; turn++) {
        const int i = turn % n;
        awiwi_real row = 0, column = 0;
        int exponent;
        for (int j = 0; j < n; j++) {
            row += awiwi_size(p->b[i] * p->b[j]) / p->R + (j == i ? 0 : awiwi_size(p->A[i * n + j]));
            column += awiwi_size(p->Q[j * n + i]) + (j == i ? 0 : awiwi_size(p->A[j * n + i]));
        }
        const awiwi_real ratio = row / column;
        if (!(ratio > 0 && ratio <= AWIWI_REAL_MAX))
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

/* The geometric mean of the optimal loop's poles, to a power of two. The square of their product is known beforehand:
   det(A)^2 + v'Q v/R with v = adj(A) b. Zero if one of them is zero. Where the square is out of range the norm will do,
   for doubling succeeds with any number, only later. */
static awiwi_real mean_pole(const plant *p)
{
    const int n = p->n;
    awiwi_real c[N], v[N], next[N], square;
    int exponent;
    awiwi_characteristic(n, p->A, c);
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
    square = c[0] * c[0];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            square += v[i] * p->Q[i * n + j] * v[j] / p->R;
    if (!(square > 0))
        return 0;
    if (!(square <= AWIWI_REAL_MAX))
        return awiwi_largest(p->A, n * n);
    (void)frexp(square, &exponent);
    return ldexp((awiwi_real)1, exponent / (2 * n));
}

/* Cayley transform: the discrete equation's A, G and H, which are blocks of the inverse of a Hamiltonian matrix. */
static int begin(const plant *p, awiwi_real pole, awiwi_real *A, awiwi_real *G, awiwi_real *H)
{
    const int n = p->n, twice = 2 * n;
    awiwi_real shifted[4 * N * N], inverse[4 * N * N];
    for (int i = 0; i < twice * twice; i++)
        inverse[i] = i % (twice + 1) ? 0 : 1;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const awiwi_real shift = i == j ? pole : 0;
            shifted[i * twice + j] = p->A[i * n + j] - shift;
            shifted[i * twice + n + j] = -p->b[i] * p->b[j] / p->R;
            shifted[(n + i) * twice + j] = -p->Q[i * n + j];
            shifted[(n + i) * twice + n + j] = shift - p->A[j * n + i];
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
    awiwi_real W[N * N], right[2 * N * N], WA[N * N], WG[N * N], turned[N * N], Y[N * N];
    awiwi_product(n, G, H, W);
    for (int i = 0; i < n; i++) {
        W[i * n + i] += 1;
        for (int j = 0; j < n; j++) {
            right[2 * i * n + j] = A[i * n + j];
            right[2 * i * n + n + j] = G[i * n + j];
            turned[j * n + i] = A[i * n + j];
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
    add_symmetric(n, Y, turned, G);
    awiwi_product(n, turned, H, Y);
    add_symmetric(n, Y, WA, H);
    awiwi_product(n, A, WA, Y);
    for (int i = 0; i < n * n; i++)
        A[i] = Y[i];
    return awiwi_all_finite(A, n * n) && awiwi_all_finite(H, n * n);
}

/* Gains, loop, left side and residual of S. */
static void weigh(const plant *p, solution *x)
{
    const int n = p->n;
    awiwi_real terms[N] = {0};
    for (int j = 0; j < n; j++) {
        x->K[j] = 0;
        for (int i = 0; i < n; i++)
            x->K[j] += p->b[i] * x->S[i * n + j] / p->R;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            awiwi_real sum = p->Q[i * n + j] - x->K[i] * p->R * x->K[j];
            for (int k = 0; k < n; k++) {
                const awiwi_real SA = x->S[i * n + k] * p->A[k * n + j], AS = x->S[j * n + k] * p->A[k * n + i];
                sum += SA + AS;
                terms[i] += i == j ? awiwi_size(SA) + awiwi_size(AS) : 0;
            }
            x->E[i * n + j] = sum;
            x->loop[i * n + j] = p->A[i * n + j] - p->b[i] * x->K[j];
        }
    for (int i = 0; i < n; i++)
        terms[i] = sqrt(terms[i] + awiwi_size(p->Q[i * n + i]) + x->K[i] * p->R * x->K[i]);
    x->residual = 0;
    for (int i = 0; i < n * n; i++) {
        const awiwi_real part = awiwi_size(x->E[i]), whole = terms[i / n] * terms[i % n];
        x->residual = part <= x->residual * whole ? x->residual : part / whole;
    }
}

static int place(int i, int j)
{
    return i > j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

/* One step of Newton: S += X with loop'X + X loop = -E; 0 if there is no such X. */
static int refine(int n, solution *s)
{
    awiwi_real L[UNKNOWNS * UNKNOWNS] = {0}, X[UNKNOWNS];
    const int unknowns = n * (n + 1) / 2;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            awiwi_real *row = L + place(i, j) * unknowns;
            X[place(i, j)] = -s->E[i * n + j];
            for (int k = 0; k < n; k++) {
                row[place(k, j)] += s->loop[k * n + i];
                row[place(i, k)] += s->loop[k * n + j];
            }
        }
    if (!awiwi_solve(unknowns, 1, L, X) || !awiwi_all_finite(X, unknowns))
        return 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            s->S[i * n + j] += X[place(i, j)];
    return 1;
}

static int search(plant *p, int iterations, solution *x)
{
    const int n = p->n;
    awiwi_real A[N * N], G[N * N], left = 1;
    balance(p);
    const awiwi_real pole = mean_pole(p);
    if (!(pole > 0) || !awiwi_is_stabilisable(n, p->A, p->b))
        return AWIWI_OUT_OF_DOMAIN;
    if (!begin(p, pole, A, G, x->S))
        return AWIWI_NOT_CONVERGED;
    for (int i = 0; i < iterations && left * left > AWIWI_REAL_EPSILON; i++) {
        if (!redouble(n, A, G, x->S))
            return AWIWI_NOT_CONVERGED;
        left = awiwi_largest(A, n * n);
    }
    weigh(p, x);
    for (int k = 0; k < REFINEMENTS; k++) {
        solution better = *x;
        if (!refine(n, &better))
            break;
        weigh(p, &better);
        if (!(better.residual < x->residual))
            break;
        *x = better;
    }
    return x->residual * x->residual <= AWIWI_REAL_EPSILON && awiwi_is_stable(n, x->loop) ? AWIWI_OK
                                                                                          : AWIWI_NOT_CONVERGED;
}

int awiwi_riccati(int n, const awiwi_real *A, const awiwi_real *b, const awiwi_real *Q, awiwi_real R, int iterations,
                  awiwi_real *K, awiwi_real *S, awiwi_real *residual)
{
    plant p = {.n = n, .R = R};
    solution x = {.residual = 1};
    int status = AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < n; i++) {
        p.b[i] = b[i];
        for (int j = 0; j < n; j++) {
            p.A[i * n + j] = A[i * n + j];
            p.Q[i * n + j] = (Q[i * n + j] + Q[j * n + i]) / 2;
        }
    }
    if (!awiwi_all_finite(A, n * n) || !awiwi_all_finite(b, n) || !awiwi_all_finite(Q, n * n) ||
        !awiwi_all_finite(&R, 1))
        status = AWIWI_NOT_FINITE;
    else if (R > 0)
        status = search(&p, iterations, &x);
    const int known = status == AWIWI_OK || (status == AWIWI_NOT_CONVERGED && x.residual < 1);
    for (int i = 0; i < n; i++) { /* back to the caller's coordinates */
        K[i] = known ? x.K[i] / p.d[i] : 0;
        for (int j = 0; j < n; j++)
            S[i * n + j] = known ? x.S[i * n + j] / (p.d[i] * p.d[j]) : 0;
    }
    *residual = known ? x.residual : 1;
    return status;
}
