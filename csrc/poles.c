/* What can be said of the poles of up to four states without finding them. */
#include "dense.h"

enum { N = 4 };

/* After Faddeev and LeVerrier. */
void awiwi_characteristic(int n, const awiwi_real *A, awiwi_real *c)
{
    awiwi_real M[N * N] = {0}, AM[N * N];
    for (int k = 1; k <= n; k++) {
        awiwi_real trace = 0;
        for (int i = 0; i < n; i++)
            M[i * n + i] += k == 1 ? 1 : c[n - k + 1];
        awiwi_product(n, A, M, AM);
        for (int i = 0; i < n; i++)
            trace += AM[i * n + i];
        c[n - k] = -trace / (awiwi_real)k;
        for (int i = 0; i < n * n; i++)
            M[i] = AM[i];
    }
}

/* By Hurwitz' determinants. */
int awiwi_is_stable(int n, const awiwi_real *A)
{
    awiwi_real c[N];
    awiwi_characteristic(n, A, c);
    for (int i = 0; i < n; i++)
        if (!(c[i] > 0))
            return 0;
    if (n == 3)
        return c[2] * c[1] > c[0];
    return n < 3 || c[3] * c[2] * c[1] > c[1] * c[1] + c[0] * c[3] * c[3];
}

/* Elimination brings (b, A) to Hessenberg form with the input on top. A pivot that vanishes but for rounding ends what
   the input moves; the block below must be stable by itself. */
int awiwi_is_stabilisable(int n, const awiwi_real *A, const awiwi_real *b)
{
    const awiwi_real nothing = 64 * AWIWI_REAL_EPSILON * awiwi_largest(A, n * n);
    awiwi_real H[N][N], rest[N * N] = {0}, column[N];
    int moved = 0;
    for (int i = 0; i < n; i++) {
        column[i] = b[i];
        for (int j = 0; j < n; j++)
            H[i][j] = A[i * n + j];
    }
    for (; moved < n; moved++) {
        int pivot = moved;
        for (int i = moved + 1; i < n; i++)
            if (awiwi_size(column[i]) > awiwi_size(column[pivot]))
                pivot = i;
        const awiwi_real top = column[pivot];
        if (!(awiwi_size(top) > (moved ? nothing : 0)))
            break;
        column[pivot] = column[moved];
        for (int j = 0; j < n; j++) { /* exchange two states: rows, then columns */
            const awiwi_real kept = H[moved][j];
            H[moved][j] = H[pivot][j];
            H[pivot][j] = kept;
        }
        for (int i = 0; i < n; i++) {
            const awiwi_real kept = H[i][moved];
            H[i][moved] = H[i][pivot];
            H[i][pivot] = kept;
        }
        for (int i = moved + 1; i < n; i++) {
            const awiwi_real f = column[i] / top;
            for (int j = 0; j < n; j++)
                H[i][j] -= f * H[moved][j];
            for (int j = 0; j < n; j++)
                H[j][moved] += f * H[j][i];
        }
        for (int i = 0; i < n; i++)
            column[i] = H[i][moved];
    }
    const int left = n - moved;
    for (int i = 0; i < left; i++)
        for (int j = 0; j < left; j++)
            rest[i * left + j] = H[moved + i][moved + j];
    return awiwi_is_stable(left, rest);
}
