/* Gains of the impedance law from feedback gains of a joint whose spring's torque is cancelled (eq. 16.3, 16.4), from
   one unknown, q = C_t/C_s + K_3 K_4. With s = K_3 + K_4 and the feedback gains over b/k,

       K_p q = c0,  K_4/C_t + K_d q + K_p s = c1,  q + (1/C_t + K_d s + K_p)/m = c2,  K_d/m + s = c3:

   the first tells K_p; the third, with K_d from the last, is a quadratic for s; sum and product tell K_3 and K_4. What is
   left is the second, for Newton's method. */
#include "numerics.h"
#include "awiwi_regulators.h"
#include "dense.h"

enum { STEPS = 10 };

int awiwi_law_gains(const awiwi_real *feedback, const awiwi_real *plant, const awiwi_real *weights,
                    const awiwi_real *start, awiwi_real *gains)
{
    const awiwi_real m = plant[0], over = plant[2] / plant[1], soft = 1 / weights[0], ratio = weights[0] / weights[1];
    const awiwi_real c0 = feedback[0] * over, c1 = feedback[1] * over, c2 = feedback[2] * over - soft / m;
    const awiwi_real c3 = feedback[3] * over, order = start[3] > start[2] ? 1 : -1;
    const awiwi_real side = m * (start[2] + start[3]) > start[1] ? 1 : -1;
    int last = 0;
    awiwi_real q = ratio + start[2] * start[3];
    for (int i = 0; i < STEPS; i++) {
        const awiwi_real K_p = c0 / q, excess = K_p / m, p = q - ratio; /* K_3 K_4 */
        const awiwi_real wide = side * awiwi_sqrt(c3 * c3 - 4 * (c2 - q - excess)), s = (c3 + wide) / 2;
        const awiwi_real apart = order * awiwi_sqrt(s * s - 4 * p), K_4 = (s + apart) / 2, K_d = m * (c3 - s);
        const awiwi_real ds = (1 - excess / q) / wide, dK_4 = (ds * K_4 - 1) / apart; /* by q */
        const awiwi_real slope = dK_4 * soft + K_d - m * ds * q + K_p * (ds - s / q);
        const awiwi_real step = (K_4 * soft + K_d * q + K_p * s - c1) / slope;
        gains[0] = K_p;
        gains[1] = K_d;
        gains[2] = p / K_4;
        gains[3] = K_4;
        if (last)
            return awiwi_all_finite(gains, 4);
        last = step * step <= AWIWI_REAL_EPSILON * q * q; /* the next would be as short as rounding */
        q -= step;
    }
    return 0;
}
