/* What can be said of the poles of up to four states without finding them. */
#include "numerics.h"
#include "dense.h"

enum { N = 4, FACTORINGS = 32 };

/* After Faddeev and LeVerrier. */
void awiwi_characteristic(int n, const awiwi_real *A, awiwi_real *c)
{
    awiwi_real M[N * N] = {0}, AM[N * N];
    for (int k = 1; k <= n; k++) {
        awiwi_real trace = 0;
        for (int i = 0; i < n; i++)
            M[i * (n + 1)] += k == 1 ? 1 : c[n - k + 1];
        awiwi_product(n, A, M, AM);
        for (int i = 0; i < n; i++)
            trace += AM[i * (n + 1)];
        c[n - k] = -trace / (awiwi_real)k;
        for (int i = 0; i < n * n; i++)
            M[i] = AM[i];
    }
}

/* The same with twice the digits. */
static void characteristic(int n, const awiwi_twofold *A, awiwi_twofold *c)
{
    awiwi_twofold M[N * N] = {{0, 0}}, AM[N * N];
    for (int k = 1; k <= n; k++) {
        awiwi_twofold trace = {0, 0};
        for (int i = 0; i < n; i++)
            M[i * n + i] = awiwi_twofold_add(M[i * n + i], k == 1 ? awiwi_twofold_of(1) : c[n - k + 1]);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                AM[i * n + j] = awiwi_twofold_of(0);
                for (int l = 0; l < n; l++)
                    AM[i * n + j] =
                        awiwi_twofold_add(AM[i * n + j], awiwi_twofold_multiply(A[i * n + l], M[l * n + j]));
            }
        for (int i = 0; i < n; i++)
            trace = awiwi_twofold_add(trace, AM[i * n + i]);
        c[n - k] = awiwi_twofold_divide(awiwi_twofold_minus(trace), (awiwi_real)k);
        for (int i = 0; i < n * n; i++)
            M[i] = AM[i];
    }
}

/* Whether all eigenvalues of A have negative real parts, by Hurwitz' determinants. */
static int is_stable(int n, const awiwi_twofold *A)
{
    awiwi_twofold c[N], left, right;
    characteristic(n, A, c);
    for (int i = 0; i < n; i++)
        if (!(c[i].high > 0))
            return 0;
    if (n < 3)
        return 1;
    left = awiwi_twofold_multiply(c[n - 1], c[n - 2]); /* n = 3: c2 c1 > c0; n = 4: c3 c2 c1 > c1^2 + c0 c3^2 */
    right = c[n - 3];
    if (n == 4) {
        left = awiwi_twofold_multiply(left, c[1]);
        right = awiwi_twofold_add(awiwi_twofold_multiply(c[1], c[1]),
                                  awiwi_twofold_multiply(c[0], awiwi_twofold_multiply(c[3], c[3])));
    }
    return awiwi_twofold_add(left, awiwi_twofold_minus(right)).high > 0;
}

int awiwi_is_stable(int n, const awiwi_real *A, const awiwi_real *b, const awiwi_real *K)
{
    awiwi_twofold loop[N * N];
    for (int i = 0; i < n * n; i++)
        loop[i] = awiwi_twofold_add(awiwi_twofold_of(A[i]), awiwi_exact_product(-b[i / n], K[i % n]));
    return is_stable(n, loop);
}

/* In the unit of time that makes c0 = 1: c3^2 = g3 + 2 c2, c1^2 = g1 + 2 c2, and c2 is the largest zero of the convex
   F(c2) = c2^2 + 2 - g2 - 2 c1 c3. Since 2 c1 c3 is at most t c3^2 + c1^2/t, a zero of a parabola bounds it from above
   for any t > 0, closely if t is near c1/c3. From there Newton's method converges from above. */
int awiwi_stable_factor(const awiwi_real *g, awiwi_real *c)
{
    const awiwi_real c0 = awiwi_sqrt(g[0]), square = awiwi_sqrt(c0), rate = awiwi_sqrt(square);
    const awiwi_real g1 = g[1] / (c0 * square), g2 = g[2] / c0, g3 = g[3] / square;
    const awiwi_real about = 2 * awiwi_sqrt(1 + awiwi_size(g2));
    awiwi_real t = awiwi_sqrt((awiwi_size(g1) + about) / (awiwi_size(g3) + about));
    awiwi_real half = t + 1 / t, c2, c1 = 0, c3 = 0;
    c2 = half * half - 2 + g2 + t * g3 + g1 / t;
    c2 = half + (c2 > 0 ? awiwi_sqrt(c2) : 0);
    for (int i = 0; i < FACTORINGS; i++) {
        c3 = awiwi_sqrt(g3 + 2 * c2);
        c1 = awiwi_sqrt(g1 + 2 * c2);
        const awiwi_real slope = c2 - c1 / c3 - c3 / c1, step = (c2 * c2 + 2 - g2 - 2 * c1 * c3) / (2 * slope);
        if (!(slope > 0))
            return 0;
        if (!(step * step > AWIWI_REAL_EPSILON * c2 * c2))
            break;
        c2 -= step;
    }
    c[0] = c0;
    c[1] = c1 * square * rate;
    c[2] = c2 * square;
    c[3] = c3 * rate;
    return awiwi_all_finite(c, 4);
}

/* A vector, and how far rounding may have moved its elements. An element that is zero by itself has no error. */
typedef struct known {
    awiwi_real value[N], error[N];
} known;

static const awiwi_real ROUNDING = AWIWI_REAL_EPSILON; /* of a product, in parts of it */

/* v'w, with its error. */
static awiwi_real product(int n, const known *v, const known *w, awiwi_real *error)
{
    *error = 0;
    for (int i = 0; i < n; i++)
        *error += v->error[i] * awiwi_size(w->value[i]) + awiwi_size(v->value[i]) * w->error[i] +
                  ROUNDING * awiwi_size(v->value[i] * w->value[i]);
    return awiwi_dot(v->value, w->value, n);
}

/* A v */
static known image(int n, const awiwi_real *A, const known *v)
{
    known x = {{0}, {0}};
    for (int i = 0; i < n; i++) {
        known row = {{0}, {0}};
        for (int j = 0; j < n; j++)
            row.value[j] = A[i * n + j];
        x.value[i] = product(n, &row, v, &x.error[i]);
    }
    return x;
}

/* Add to orthonormal directions what is new in v, twice orthogonal for the sake of rounding. It is new if more of it
   remains than `least`; if that is 0, if some element is more than its error. Returns how many directions there are. */
static int extend(int n, int count, known *directions, known v, awiwi_real least)
{
    awiwi_real error, unused;
    int is_new = least > 0;
    if (count == n)
        return n;
    for (int k = 0; k < 2 * count; k++) {
        const known *along = &directions[k % count];
        const awiwi_real share = product(n, &v, along, k < count ? &error : &unused);
        for (int i = 0; i < n; i++) {
            v.value[i] -= share * along->value[i];
            if (k < count)
                v.error[i] += error * awiwi_size(along->value[i]) + awiwi_size(share) * along->error[i] +
                              ROUNDING * awiwi_size(share * along->value[i]);
        }
    }
    const awiwi_real length = awiwi_sqrt(awiwi_dot(v.value, v.value, n));
    for (int i = 0; i < n; i++)
        is_new = is_new || awiwi_size(v.value[i]) > v.error[i];
    if (!is_new || !(length > least))
        return count;
    for (int i = 0; i < n; i++) {
        directions[count].value[i] = v.value[i] / length;
        directions[count].error[i] = v.error[i] / length;
    }
    return count + 1;
}

/* A turns the starts into directions; the modes in what is left must decay by more than rounding. */
int awiwi_rest_decays(int n, const awiwi_real *A, int starts, const awiwi_real *start)
{
    known directions[N];
    awiwi_twofold rest[N * N];
    awiwi_real margin = 0;
    int found = 0;
    for (int s = 0; s < starts; s++) {
        known v = {{0}, {0}};
        for (int i = 0; i < n; i++)
            v.value[i] = start[s * n + i];
        for (int i = 0; i < n && starts > 1; i++)
            v.error[i] = ROUNDING * awiwi_size(v.value[i]);
        found = extend(n, found, directions, v, 0);
    }
    for (int k = 0; k < found && found < n; k++)
        found = extend(n, found, directions, image(n, A, &directions[k]), 0);
    const int left = n - found;
    if (left == 0)
        return 1;
    for (int i = 0, count = found; i < n; i++) { /* fill up with unit vectors: some remainder is at least a half */
        known unit = {{0}, {0}};
        unit.value[i] = 1;
        count = extend(n, count, directions, unit, (awiwi_real)0.25);
    }
    for (int j = 0; j < left; j++) {
        const known moved = image(n, A, &directions[found + j]);
        for (int i = 0; i < left; i++) {
            awiwi_real error;
            rest[i * left + j] = awiwi_twofold_of(product(n, &moved, &directions[found + i], &error));
            margin = error > margin ? error : margin;
        }
    }
    for (int i = 0; i < left; i++)
        rest[i * (left + 1)] = awiwi_twofold_add(rest[i * (left + 1)], awiwi_twofold_of((awiwi_real)left * margin));
    return is_stable(left, rest);
}
