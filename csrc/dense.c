/* Small dense linear algebra: products, elimination with row exchanges. */
#include "numerics.h"
#include "dense.h"

awiwi_real awiwi_largest(const awiwi_real *x, int n)
{
    awiwi_real found = 0;
    for (int i = 0; i < n; i++)
        found = awiwi_size(x[i]) <= found || !(found <= AWIWI_REAL_MAX) ? found : awiwi_size(x[i]);
    return found;
}

int awiwi_all_finite(const awiwi_real *x, int n)
{
    awiwi_real nothing = 0; /* neither a number that is infinite nor one that is none gives 0 */
    for (int i = 0; i < n; i++)
        nothing += x[i] * 0;
    return nothing >= 0;
}

void awiwi_product(int n, const awiwi_real *A, const awiwi_real *B, awiwi_real *C)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            awiwi_real sum = 0;
            for (int k = 0; k < n; k++)
                sum += A[i * n + k] * B[k * n + j];
            C[i * n + j] = sum;
        }
}

static void exchange(int m, awiwi_real *a, awiwi_real *b)
{
    for (int j = 0; j < m; j++) {
        const awiwi_real saved = a[j];
        a[j] = b[j];
        b[j] = saved;
    }
}

/* a -= f b */
static void subtract(int m, awiwi_real f, const awiwi_real *b, awiwi_real *a)
{
    for (int j = 0; j < m; j++)
        a[j] -= f * b[j];
}

int awiwi_factor(int n, awiwi_real *A, int *order)
{
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (awiwi_size(A[i * n + k]) > awiwi_size(A[pivot * n + k]))
                pivot = i;
        order[k] = pivot;
        if (!(awiwi_size(A[pivot * n + k]) > 0))
            return 0;
        if (pivot != k)
            exchange(n, A + k * n, A + pivot * n);
        for (int i = k + 1; i < n; i++) {
            awiwi_real *row = A + i * n + k;
            row[0] /= A[k * n + k];
            if (row[0] < 0 || !(row[0] <= 0)) /* not 0 */
                subtract(n - k - 1, row[0], A + k * n + k + 1, row + 1);
        }
    }
    return 1;
}

void awiwi_substitute(int n, int m, const awiwi_real *A, const int *order, awiwi_real *B)
{
    for (int k = 0; k < n; k++)
        if (order[k] != k)
            exchange(m, B + k * m, B + order[k] * m);
    for (int j = 0; j < m; j++) {
        for (int i = 1; i < n; i++)
            for (int k = 0; k < i; k++)
                B[i * m + j] -= A[i * n + k] * B[k * m + j];
        for (int i = n - 1; i >= 0; i--) {
            for (int k = i + 1; k < n; k++)
                B[i * m + j] -= A[i * n + k] * B[k * m + j];
            B[i * m + j] /= A[i * n + i];
        }
    }
}

int awiwi_solve(int n, int m, awiwi_real *A, awiwi_real *B)
{
    int order[AWIWI_MOST_ROWS];
    const int regular = awiwi_factor(n, A, order);
    if (regular)
        awiwi_substitute(n, m, A, order, B);
    return regular;
}

awiwi_real awiwi_solve_positive(int n, int width, awiwi_real *H, awiwi_real least, const awiwi_real *b, awiwi_real *x)
{
    awiwi_real smallest = AWIWI_REAL_MAX;
    int done = 0;
    for (; done < n && smallest > least; done++) { /* L below the diagonal, pivots on it */
        awiwi_real *row = H + done * width;
        x[done] = b[done];
        for (int k = 0; k < done; k++) {
            awiwi_real sum = row[k];
            for (int i = 0; i < k; i++)
                sum -= row[i] * H[i * width + i] * H[k * width + i];
            row[k] = sum / H[k * width + k];
            row[done] -= row[k] * sum;
            x[done] -= row[k] * x[k];
        }
        smallest = row[done] >= smallest ? smallest : row[done];
    }
    const int solved = smallest > least;
    for (int i = 0; !solved && i < n; i++)
        x[i] = i == done - 1;
    for (int j = done - 1; j >= 0; j--) {
        if (solved)
            x[j] /= H[j * width + j];
        for (int k = j + 1; k < done; k++)
            x[j] -= H[k * width + j] * x[k];
    }
    return smallest;
}

/* By elimination: a pivot that vanishes must have nothing beside it. */
int awiwi_semidefinite_rank(int n, const awiwi_real *Q)
{
    const awiwi_real rounding = 64 * AWIWI_REAL_EPSILON;
    const awiwi_real surely = 32 * awiwi_sqrt(AWIWI_REAL_EPSILON); /* pivots after it err by rounding over this */
    awiwi_real left[4][4];
    int rank = n;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            left[i][j] = Q[i * n + j];
    for (int k = 0; k < n; k++) {
        if (!(left[k][k] >= -rounding * Q[k * n + k]))
            return -1;
        const int vanishes = left[k][k] <= rounding * Q[k * n + k];
        rank -= !(left[k][k] > surely * Q[k * n + k]);
        for (int i = k + 1; i < n; i++) {
            if (vanishes && left[i][k] * left[i][k] > rounding * Q[k * n + k] * Q[i * n + i])
                return -1;
            for (int j = k + 1; j < n && !vanishes; j++)
                left[i][j] -= left[i][k] / left[k][k] * left[k][j];
        }
    }
    return rank;
}
