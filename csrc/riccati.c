/* The algebraic Riccati equation S A + A'S - S b b'S/R + Q = 0 of one input (eq. 13.5), by structure-preserving
   doubling: a Cayley transform makes it a discrete one, whose closed loop is squared until it vanishes. Then Newton's
   method, after Kleinman, from residuals with twice the digits: so gains are right to the last one. */
#include "numerics.h"
#include "awiwi_regulators.h"
#include "dense.h"

enum {
    N = AWIWI_MOST_STATES,
    UNKNOWNS = N * (N + 1) / 2,
    SWEEPS = 4,     /* of balancing */
    REFINEMENTS = 12 /* steps of Newton at the end, at most */
};

/* A plant and its costs in coordinates z with x = diag(d) z, whose entries are of like size. */
typedef struct plant {
    int n;
    awiwi_real d[N], A[N * N], b[N], Q[N * N], R;
} plant;

/* A candidate in double the precision: S, its gains, the closed loop A - b K of the returned gains; the equation's
   left side E, and how large that is against its terms; how far the last step moved K, against its largest. */
typedef struct solution {
    awiwi_twofold S[N * N], K[N], loop[N * N];
    awiwi_real E[N * N], residual, moved;
} solution;

/* Scale every coordinate by a power of two, so that its row and its column of the Hamiltonian matrix weigh alike. */
static void balance(plant *p)
{
    const int n = p->n;
    for (int i = 0; i < n; i++)
        p->d[i] = 1;
    for (int step = 0; step < SWEEPS * n; step++) {
        const int i = step % n;
        awiwi_real row = 0, column = 0;
        int exponent;
        for (int j = 0; j < n; j++) {
            row += awiwi_size(p->b[i] * p->b[j]) / p->R + (j == i ? 0 : awiwi_size(p->A[i * n + j]));
            column += awiwi_size(p->Q[j * n + i]) + (j == i ? 0 : awiwi_size(p->A[j * n + i]));
        }
        const awiwi_real ratio = row / column;
        if (!(ratio > 0 && ratio <= AWIWI_REAL_MAX))
            continue;
        (void)awiwi_frexp(ratio, &exponent);
        const awiwi_real f = awiwi_ldexp((awiwi_real)1, exponent / 2);
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
   det(A)^2 + v'Q v/R with v = adj(A) b. Where that is out of range the norm will do, for doubling succeeds with any
   number, only later. */
static awiwi_real mean_pole(const plant *p)
{
    const int n = p->n;
    awiwi_twofold A[N * N], c[N];
    awiwi_real v[N], next[N], square;
    int exponent;
    for (int i = 0; i < n * n; i++)
        A[i] = awiwi_twofold_of(p->A[i]);
    awiwi_characteristic(n, A, c);
    for (int i = 0; i < n; i++)
        v[i] = p->b[i];
    for (int k = n - 1; k > 0; k--) {
        for (int i = 0; i < n; i++)
            next[i] = c[k].high * p->b[i] + awiwi_dot(p->A + i * n, v, n);
        for (int i = 0; i < n; i++)
            v[i] = next[i];
    }
    square = c[0].high * c[0].high;
    for (int i = 0; i < n; i++)
        square += v[i] * awiwi_dot(p->Q + i * n, v, n) / p->R;
    if (!(square > 0 && square <= AWIWI_REAL_MAX))
        return awiwi_largest(p->A, n * n);
    (void)awiwi_frexp(square, &exponent);
    return awiwi_ldexp((awiwi_real)1, exponent / (2 * n));
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

/* Gains, loop, left side and residual of S: E almost cancels, so all of its terms have twice the digits. */
static void weigh(const plant *p, solution *x)
{
    const int n = p->n;
    awiwi_real terms[N] = {0}, largest;
    awiwi_twofold Sb[N];
    for (int j = 0; j < n; j++) {
        Sb[j] = awiwi_twofold_of(0);
        for (int i = 0; i < n; i++)
            Sb[j] = awiwi_twofold_add(Sb[j], awiwi_twofold_multiply(x->S[i * n + j], awiwi_twofold_of(p->b[i])));
        x->K[j] = awiwi_twofold_divide(Sb[j], p->R);
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            awiwi_twofold sum = awiwi_twofold_minus(awiwi_twofold_multiply(x->K[i], Sb[j]));
            sum = awiwi_twofold_add(sum, awiwi_twofold_of(p->Q[i * n + j]));
            for (int k = 0; k < n; k++) {
                const awiwi_twofold SA = awiwi_twofold_multiply(x->S[i * n + k], awiwi_twofold_of(p->A[k * n + j]));
                const awiwi_twofold AS = awiwi_twofold_multiply(x->S[j * n + k], awiwi_twofold_of(p->A[k * n + i]));
                sum = awiwi_twofold_add(sum, awiwi_twofold_add(SA, AS));
                terms[i] += i == j ? awiwi_size(SA.high) + awiwi_size(AS.high) : 0;
            }
            x->E[i * n + j] = sum.high;
            x->loop[i * n + j] = awiwi_twofold_add(awiwi_twofold_of(p->A[i * n + j]),
                                                   awiwi_exact_product(-p->b[i], x->K[j].high));
        }
    for (int i = 0; i < n; i++)
        terms[i] += awiwi_size(p->Q[i * n + i]) + awiwi_size(x->K[i].high * Sb[i].high);
    largest = awiwi_largest(terms, n);
    for (int i = 0; i < n; i++) /* what costs nothing has no terms but rounding */
        terms[i] = awiwi_sqrt(terms[i] > AWIWI_REAL_EPSILON * largest ? terms[i] : AWIWI_REAL_EPSILON * largest);
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
                row[place(k, j)] += s->loop[k * n + i].high;
                row[place(i, k)] += s->loop[k * n + j].high;
            }
        }
    if (!awiwi_solve(unknowns, 1, L, X) || !awiwi_all_finite(X, unknowns))
        return 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            s->S[i * n + j] = awiwi_twofold_add(s->S[i * n + j], awiwi_twofold_of(X[place(i, j)]));
    return 1;
}

/* Whether the costs are costs, some feedback stabilises the plant, and no motion that lasts is for nothing. */
static int is_sound(const plant *p)
{
    const int n = p->n;
    awiwi_real transposed[N * N], seen[N * N]; /* by the costs: the rows of Q, in parts of their own */
    for (int i = 0; i < n * n; i++) {
        const awiwi_real own = p->Q[i / n * (n + 1)];
        transposed[i] = p->A[i % n * n + i / n];
        seen[i] = own > 0 ? p->Q[i] / awiwi_sqrt(own) : 0;
    }
    return awiwi_is_semidefinite(n, p->Q) && awiwi_rest_decays(n, p->A, 1, p->b) &&
           awiwi_rest_decays(n, transposed, n, seen);
}

/* Double until the closed loop vanishes; 0 where that leaves the numbers. */
static int double_up(const plant *p, awiwi_real pole, int iterations, solution *x)
{
    const int n = p->n;
    awiwi_real A[N * N], G[N * N], S[N * N], left = 1;
    if (!begin(p, pole, A, G, S))
        return 0;
    for (int i = 0; i < iterations && left * left > AWIWI_REAL_EPSILON; i++) {
        if (!redouble(n, A, G, S))
            return 0;
        left = awiwi_largest(A, n * n);
    }
    for (int i = 0; i < n * n; i++)
        x->S[i] = awiwi_twofold_of(S[i]);
    weigh(p, x);
    return 1;
}

/* Newton's method for as long as it comes nearer. From a stable loop it does, but perhaps for its first step. */
static void refine_all(const plant *p, solution *x)
{
    solution here = *x;
    x->moved = AWIWI_REAL_MAX;
    for (int k = 0; k < REFINEMENTS && refine(p->n, &here); k++) {
        awiwi_real before[N], after[N];
        for (int i = 0; i < p->n; i++)
            before[i] = here.K[i].high;
        weigh(p, &here);
        for (int i = 0; i < p->n; i++) {
            after[i] = here.K[i].high;
            before[i] -= after[i];
        }
        here.moved = awiwi_largest(before, p->n);
        if (here.moved > 0)
            here.moved /= awiwi_largest(after, p->n);
        x->moved = here.moved;
        if (here.residual < x->residual)
            *x = here;
        else if (k > 0)
            break;
    }
}

/* A step as short as that leaves K right but for rounding, for each is much shorter than the one before it. */
static int holds(const plant *p, const solution *x)
{
    return x->moved <= AWIWI_REAL_EPSILON && x->residual <= 16 * AWIWI_REAL_EPSILON && awiwi_is_stable(p->n, x->loop);
}

static int search(plant *p, int iterations, solution *x)
{
    static const int exponents[] = {0, 2, -2};
    int found = 0;
    balance(p);
    if (!is_sound(p))
        return AWIWI_OUT_OF_DOMAIN;
    const awiwi_real pole = mean_pole(p);
    for (int k = 0; k < 3 && !found; k++) {
        solution here;
        if (!double_up(p, awiwi_ldexp(pole, exponents[k]), iterations, &here))
            continue;
        refine_all(p, &here);
        found = holds(p, &here);
        if (found || here.residual < x->residual)
            *x = here;
    }
    solution rounded = *x;
    for (int i = 0; i < p->n * p->n; i++)
        rounded.S[i].low = 0;
    weigh(p, &rounded);
    x->residual = rounded.residual; /* of the S that is returned */
    return found ? AWIWI_OK : AWIWI_NOT_CONVERGED;
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
    int known = status == AWIWI_OK || (status == AWIWI_NOT_CONVERGED && x.residual < 1);
    for (int i = 0; i < n; i++) { /* back to the caller's coordinates */
        K[i] = x.K[i].high / p.d[i];
        for (int j = 0; j < n; j++)
            S[i * n + j] = x.S[i * n + j].high / (p.d[i] * p.d[j]);
    }
    known = known && awiwi_all_finite(K, n) && awiwi_all_finite(S, n * n);
    for (int i = 0; i < n && !known; i++) {
        K[i] = 0;
        for (int j = 0; j < n; j++)
            S[i * n + j] = 0;
    }
    *residual = known ? x.residual : 1;
    return status == AWIWI_OK && !known ? AWIWI_NOT_CONVERGED : status;
}
