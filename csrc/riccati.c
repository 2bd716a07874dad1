/* The algebraic Riccati equation S A + A'S - S b b'S/R + Q = 0 of one input (eq. 13.5), by Newton's method, after
   Kleinman, from residuals with twice the digits: so gains are right to the last one. Four states start from the gains
   that a polynomial tells, the stable factor of the optimal loop's. Others, and those that fail, start from doubling. */
#include "numerics.h"
#include "awiwi_regulators.h"
#include "dense.h"

enum {
    N = AWIWI_MOST_STATES,
    UNKNOWNS = N * (N + 1) / 2,
    SWEEPS = 4,     /* of balancing */
    REFINEMENTS = 12 /* steps of Newton at the end, at most */
};

static const awiwi_real SHORT = (awiwi_real)1 / 1048576; /* step of Newton, against the largest gain */

/* A plant and its costs in coordinates z with x = diag(d) z, whose entries are of like size. */
typedef struct plant {
    int n;
    awiwi_real d[N], A[N * N], b[N], Q[N * N], R;
    awiwi_halves halves[N * N]; /* of A */
} plant;

/* A candidate in double the precision: S, its gains; the closed loop A - b K; the equation's left side E, of which the
   lower half is read, its terms, and how large it is against them; how far from the solution's K is from it, by the last
   step, against its largest. */
typedef struct solution {
    awiwi_twofold S[N * N], K[N];
    awiwi_real loop[N * N], E[N * N], terms[N], residual, left;
} solution;

/* What tells the poles of the optimal loop: det(s - A) = s^n + c[n-1] s^(n-1) + ... and adj(s - A) b = sum v[k] s^k. */
typedef struct polynomials {
    awiwi_real c[N], v[N][N];
} polynomials;

/* Scale every coordinate by a power of two, so that its row and its column of the Hamiltonian matrix weigh alike. */
static void balance(plant *p)
{
    const int n = p->n;
    for (int i = 0; i < n; i++)
        p->d[i] = 1;
    for (int step = 0, still = 0; step < SWEEPS * n && still < n; step++) {
        const int i = step % n;
        awiwi_real row = 0, column = 0, inputs = 0;
        int exponent;
        for (int j = 0; j < n; j++) {
            inputs += awiwi_size(p->b[i] * p->b[j]);
            row += j == i ? 0 : awiwi_size(p->A[i * n + j]);
            column += awiwi_size(p->Q[j * n + i]) + (j == i ? 0 : awiwi_size(p->A[j * n + i]));
        }
        const awiwi_real ratio = (row + inputs / p->R) / column;
        if (!(ratio > 0 && ratio <= AWIWI_REAL_MAX))
            continue;
        (void)awiwi_frexp(ratio, &exponent);
        still = exponent / 2 == 0 ? still + 1 : 0;
        if (still > 0)
            continue;
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

static void find_polynomials(const plant *p, polynomials *y)
{
    const int n = p->n;
    awiwi_characteristic(n, p->A, y->c);
    for (int i = 0; i < n; i++)
        y->v[n - 1][i] = p->b[i];
    for (int k = n - 1; k > 0; k--)
        for (int i = 0; i < n; i++)
            y->v[k - 1][i] = y->c[k] * p->b[i] + awiwi_dot(p->A + i * n, y->v[k], n);
}

/* v[j]'Q v[k]/R */
static awiwi_real weight(const plant *p, const polynomials *y, int j, int k)
{
    awiwi_real sum = 0;
    for (int i = 0; i < p->n; i++)
        sum += y->v[j][i] * awiwi_dot(p->Q + i * p->n, y->v[k], p->n);
    return sum / p->R;
}

/* The geometric mean of the optimal loop's poles, to a power of two. The square of their product is known beforehand:
   det(A)^2 + v'Q v/R with v = adj(A) b. Where that is out of range the norm will do, for doubling succeeds with any
   number, only later. */
static awiwi_real mean_pole(const plant *p, const polynomials *y)
{
    const awiwi_real square = y->c[0] * y->c[0] + weight(p, y, 0, 0);
    int exponent;
    if (!(square > 0 && square <= AWIWI_REAL_MAX))
        return awiwi_largest(p->A, p->n * p->n);
    (void)awiwi_frexp(square, &exponent);
    return awiwi_ldexp((awiwi_real)1, exponent / (2 * p->n));
}

/* Gains K of the optimal loop by its polynomial c = det(s - A) + K adj(s - A) b, the stable factor of what the costs add
   to that of the plant; and what makes the first of Newton's steps find their S. 0 where rounding is in the way. */
static int place_poles(const plant *p, const polynomials *y, solution *x)
{
    const awiwi_real *a = y->c;
    const awiwi_real g[N] = {
        a[0] * a[0] + weight(p, y, 0, 0),
        a[1] * a[1] - 2 * a[0] * a[2] + weight(p, y, 1, 1) - 2 * weight(p, y, 0, 2),
        a[2] * a[2] + 2 * a[0] - 2 * a[1] * a[3] + weight(p, y, 2, 2) - 2 * weight(p, y, 1, 3),
        a[3] * a[3] - 2 * a[2] + weight(p, y, 3, 3),
    };
    awiwi_real c[N], V[N * N], K[N];
    if (p->n != N || !awiwi_stable_factor(g, c))
        return 0;
    for (int k = 0; k < N; k++) {
        const awiwi_real scale = 1 / awiwi_largest(y->v[k], N);
        K[k] = (c[k] - a[k]) * scale;
        for (int i = 0; i < N; i++)
            V[k * N + i] = y->v[k][i] * scale;
    }
    if (!awiwi_solve(N, 1, V, K) || !awiwi_all_finite(K, N))
        return 0;
    for (int i = 0; i < N; i++) {
        x->K[i] = awiwi_twofold_of(K[i]);
        for (int j = 0; j < N; j++) {
            x->S[i * N + j] = awiwi_twofold_of(0);
            x->loop[i * N + j] = p->A[i * N + j] - p->b[i] * K[j];
            x->E[i * N + j] = p->Q[i * N + j] + p->R * K[i] * K[j];
        }
    }
    x->residual = x->left = AWIWI_REAL_MAX;
    return 1;
}

/* The gains of S; also S b. */
static void find_gains(const plant *p, solution *x, awiwi_twofold *Sb)
{
    const int n = p->n;
    for (int i = 0; i < n; i++) {
        Sb[i] = awiwi_twofold_of(0);
        for (int k = 0; k < n; k++)
            if (awiwi_size(p->b[k]) > 0)
                Sb[i] = awiwi_twofold_add(Sb[i],
                                          awiwi_twofold_multiply(x->S[i * n + k], awiwi_twofold_of(p->b[k])));
        x->K[i] = awiwi_twofold_divide(Sb[i], p->R);
    }
}

/* The residual of the left side E. */
static void compare(int n, solution *x)
{
    x->residual = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            const awiwi_real part = awiwi_size(x->E[i * n + j]), whole = x->terms[i] * x->terms[j];
            x->residual = part <= x->residual * whole ? x->residual : part / whole;
        }
}

/* Gains, loop, left side and residual of S: E almost cancels, so all of its terms have twice the digits. */
static void weigh(const plant *p, solution *x)
{
    const int n = p->n;
    awiwi_real terms[N] = {0}, largest;
    awiwi_twofold Sb[N], SA[N * N];
    find_gains(p, x, Sb);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            SA[i * n + j] = awiwi_twofold_of(0);
        for (int k = 0; k < n; k++) {
            const awiwi_twofold s = x->S[i * n + k];
            const awiwi_halves halves = awiwi_split(s.high);
            for (int j = 0; j < n; j++) {
                const awiwi_real a = p->A[k * n + j];
                if (!(awiwi_size(a) > 0))
                    continue;
                const awiwi_twofold product = awiwi_product_of_halves(halves, p->halves[k * n + j]);
                const awiwi_twofold term = {product.high, product.low + s.low * a};
                SA[i * n + j] = awiwi_twofold_add(SA[i * n + j], term);
                terms[i] += i == j ? 2 * awiwi_size(term.high) : 0;
            }
        }
        terms[i] += awiwi_size(p->Q[i * n + i]) + awiwi_size(x->K[i].high * Sb[i].high);
    }
    largest = awiwi_largest(terms, n);
    for (int i = 0; i < n; i++) /* what costs nothing has no terms but rounding */
        x->terms[i] = awiwi_sqrt(terms[i] > AWIWI_REAL_EPSILON * largest ? terms[i] : AWIWI_REAL_EPSILON * largest);
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            const awiwi_twofold left = awiwi_twofold_add(SA[i * n + j], SA[j * n + i]);
            const awiwi_twofold spent = awiwi_twofold_minus(awiwi_twofold_multiply(x->K[i], Sb[j]));
            const awiwi_twofold sum = awiwi_twofold_add(left, awiwi_twofold_of(p->Q[i * n + j]));
            x->E[i * n + j] = awiwi_twofold_add(sum, spent).high;
        }
    compare(n, x);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            x->loop[i * n + j] = p->A[i * n + j] - p->b[i] * x->K[j].high;
}

static int place(int i, int j)
{
    return i > j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

/* The equations loop'X + X loop = -E of a step, factored; 0 if they have no solution. */
static int prepare(int n, const awiwi_real *loop, awiwi_real *L, int *order)
{
    const int unknowns = n * (n + 1) / 2;
    for (int i = 0; i < unknowns * unknowns; i++)
        L[i] = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            awiwi_real *row = L + place(i, j) * unknowns;
            for (int k = 0; k < n; k++) {
                row[place(k, j)] += loop[k * n + i];
                row[place(i, k)] += loop[k * n + j];
            }
        }
    return awiwi_all_finite(loop, n * n) && awiwi_factor(unknowns, L, order);
}

/* One step of Newton: S += X. */
static int refine(int n, const awiwi_real *L, const int *order, solution *s)
{
    awiwi_real X[UNKNOWNS];
    const int unknowns = n * (n + 1) / 2;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++)
            X[place(i, j)] = -s->E[i * n + j];
    awiwi_substitute(unknowns, 1, L, order, X);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            s->S[i * n + j] = awiwi_twofold_add(s->S[i * n + j], awiwi_twofold_of(X[place(i, j)]));
    return awiwi_all_finite(X, unknowns);
}

/* Whether the costs are costs, some feedback stabilises the plant, and no motion that lasts is for nothing. */
static int is_sound(const plant *p)
{
    const int n = p->n, rank = awiwi_semidefinite_rank(n, p->Q);
    awiwi_real transposed[N * N], seen[N * N]; /* by the costs: the rows of Q, in parts of their own */
    if (rank < 0 || !awiwi_rest_decays(n, p->A, 1, p->b))
        return 0;
    for (int i = 0; i < n * n && rank < n; i++) {
        const awiwi_real own = p->Q[i / n * (n + 1)];
        transposed[i] = p->A[i % n * n + i / n];
        seen[i] = own > 0 ? p->Q[i] / awiwi_sqrt(own) : 0;
    }
    return rank == n || awiwi_rest_decays(n, transposed, n, seen);
}

/* Newton's method for as long as it comes nearer. From a stable loop it does, but perhaps for its first step. Errors
   shrink like residuals; after steps that are short and shrink them a lot, the equations of the next are the same. Where
   they tell that the step after this one would not change K, this one is the last, and leaves nothing of E. */
static void refine_all(const plant *p, solution *x)
{
    const int n = p->n;
    awiwi_real L[UNKNOWNS * UNKNOWNS];
    awiwi_twofold Sb[N];
    int order[UNKNOWNS], prepared = 0;
    solution here = *x;
    for (int k = 0; k < REFINEMENTS; k++) {
        awiwi_real step[N], gains[N];
        const awiwi_real before = here.residual;
        if (!prepared && !prepare(n, here.loop, L, order))
            return;
        for (int i = 0; i < n; i++)
            step[i] = here.K[i].high;
        if (!refine(n, L, order, &here))
            return;
        if (here.left <= SHORT * AWIWI_REAL_EPSILON) {
            for (int i = 0; i < n * n; i++)
                here.E[i] = 0;
            find_gains(p, &here, Sb);
            *x = here;
            return;
        }
        weigh(p, &here);
        for (int i = 0; i < n; i++) {
            gains[i] = here.K[i].high;
            step[i] -= gains[i];
        }
        const awiwi_real longest = awiwi_largest(step, n), ratio = here.residual / before;
        const awiwi_real moved = longest > 0 ? longest / awiwi_largest(gains, n) : 0;
        prepared = moved <= SHORT && ratio <= SHORT;
        const awiwi_real share = ratio > moved ? ratio : moved; /* that the next step leaves of the error, about */
        here.left = moved > AWIWI_REAL_EPSILON ? moved : AWIWI_REAL_EPSILON;
        here.left *= before < AWIWI_REAL_MAX && share < 1 ? share : 1;
        x->left = here.left;
        if (here.residual < x->residual)
            *x = here;
        else if (k > 0)
            return;
    }
}

/* Whether K is right but for rounding and the loop stable. It is where S is positive, for no motion that lasts costs
   nothing. */
static int holds(const plant *p, const solution *x)
{
    awiwi_real S[N * N], K[N];
    for (int i = 0; i < p->n * p->n; i++)
        S[i] = x->S[i].high;
    for (int i = 0; i < p->n; i++)
        K[i] = x->K[i].high;
    return x->left <= AWIWI_REAL_EPSILON && x->residual <= 16 * AWIWI_REAL_EPSILON &&
           (awiwi_semidefinite_rank(p->n, S) == p->n || awiwi_is_stable(p->n, p->A, p->b, K));
}

/* Doubling, from units of time that differ by 2^exponent; 0 where it leaves the numbers. */
static int double_up(const plant *p, const polynomials *y, int exponent, int iterations, solution *x)
{
    const awiwi_real pole = awiwi_ldexp(mean_pole(p, y), exponent);
    awiwi_real S[N * N];
    if (!awiwi_double_up(p->n, p->A, p->b, p->Q, p->R, pole, iterations, S))
        return 0;
    for (int i = 0; i < p->n * p->n; i++)
        x->S[i] = awiwi_twofold_of(S[i]);
    weigh(p, x);
    x->left = AWIWI_REAL_MAX;
    return 1;
}

static int search(plant *p, int iterations, solution *x)
{
    static const int exponents[] = {0, 2, -2};
    const int n = p->n;
    polynomials y;
    int found = 0;
    balance(p);
    if (!is_sound(p))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < n * n; i++)
        p->halves[i] = awiwi_split(p->A[i]);
    find_polynomials(p, &y);
    for (int k = -1; k < 3 && !found; k++) {
        solution here;
        if (!(k < 0 ? place_poles(p, &y, &here) : double_up(p, &y, exponents[k], iterations, &here)))
            continue;
        refine_all(p, &here);
        found = holds(p, &here);
        if (found || here.residual < x->residual)
            *x = here;
    }
    for (int i = 0; i < n && x->residual < 1; i++) /* of the S that is returned, less what rounding takes from S */
        for (int j = 0; j <= i; j++)
            for (int k = 0; k < n; k++)
                x->E[i * n + j] -= x->S[i * n + k].low * x->loop[k * n + j] + x->S[j * n + k].low * x->loop[k * n + i];
    if (x->residual < 1)
        compare(n, x);
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
