/* Plants, and starts in a space of few dimensions, both but for rounding or a little more: prints whether what the
   starts do not reach decays. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include "numerics.h"
#include "dense.h"
static uint32_t seed = 1;
static double uniform(double low, double high)
{
    seed = seed * 1664525u + 1013904223u;
    return low + (high - low) * (seed >> 8) / 16777216.0;
}
int main(void)
{
    for (int number = 0; number < 900; number++) {
        const int n = 2 + number % 3, starts = 1 + number / 3 % 4, dimensions = 1 + number / 12 % (n - 1);
        double A[16], basis[16], start[16];
        for (int i = 0; i < n * n; i++)
            A[i] = i % (n + 1) ? number % 2 * uniform(-1, 1) * pow(10, uniform(-18, -13)) : number % 5 ? 1 : -1;
        for (int i = 0; i < dimensions * n; i++)
            basis[i] = uniform(-1, 1);
        for (int s = 0; s < starts; s++) {
            for (int i = 0; i < n; i++)
                start[s * n + i] = number % 4 < 2 ? uniform(-1, 1) * pow(10, uniform(-18, -13)) : 0;
            for (int k = 0; k < dimensions; k++) {
                const double share = uniform(-1, 1);
                for (int i = 0; i < n; i++)
                    start[s * n + i] += share * basis[k * n + i];
            }
        }
        printf("%d", awiwi_rest_decays(n, A, starts, start));
    }
    return 0;
}
