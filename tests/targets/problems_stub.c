/* The kernels of the hand in problems_hand.c: a finger of two joints and four tendons, and one of one joint and two. */
#include "problems_stub.h"

#include <math.h>

static const double SPRING = 2000, BEND = 100, LEVER = 0.004, STRETCH = 2e-5;
static const double INERTIA = 1e-4, FRICTION = 1e-4;
#define PULLEY 0.005
#define MOTOR 2e-5 /* constants of initialisers */

static int refused = HAND_KERNELS, calls_left, refusal;

void refuse_call(int kernel, int after, int status)
{
    refused = kernel;
    calls_left = after;
    refusal = status;
}

void refuse_nothing(void)
{
    refused = HAND_KERNELS;
}

/* What a kernel returns, after its work. */
static int answer(int kernel, double *out)
{
    if (kernel != refused || calls_left-- > 0)
        return AWIWI_OK;
    if (refusal == AWIWI_OK)
        *out = NAN;
    return refusal;
}

/* -- fingers: change of length of tendon i per angle of joint j, by number of joints ------------------------------- */

static double straight_arm(int n, int i, int j)
{
    static const double few[2][8] = {{0.008, -0.007}, {0.009, 0.006, 0.008, -0.007, -0.0085, 0.006, -0.0095, -0.005}};
    int sign = 1;
    for (int both = i & (j + 1); both; both >>= 1)
        sign = both & 1 ? -sign : sign;
    return n > 2 ? sign * (0.008 - 0.0001 * j) : few[n - 1][i * n + j];
}

static double arm(int n, int i, int j, double q)
{
    return straight_arm(n, i, j) * (1 + 0.1 * q);
}

static int lengths(int n, const double *q, double *h)
{
    for (int i = 0; i < 2 * n; i++) {
        h[i] = 0.1 + 0.01 * i;
        for (int j = 0; j < n; j++)
            h[i] += straight_arm(n, i, j) * (q[j] + 0.05 * q[j] * q[j]);
    }
    return answer(TENDON_LENGTHS, h);
}

static int measured(int n, const double *theta, const double *x, const double *w, double *h)
{
    for (int i = 0; i < 2 * n; i++)
        h[i] = x[i] - PULLEY * theta[i] - w[i];
    return answer(MEASURED_LENGTHS, h);
}

/* Two steps of Gauss's and Newton's method. */
static int estimate(int n, const double *h, const double *start, double *q)
{
    for (int j = 0; j < n; j++)
        q[j] = start[j];
    for (int step = 0; step < 2; step++) {
        double A[AWIWI_ALL_JOINTS * AWIWI_ALL_JOINTS] = {0}, b[AWIWI_ALL_JOINTS] = {0};
        for (int i = 0; i < 2 * n; i++) {
            double off = h[i] - 0.1 - 0.01 * i;
            for (int j = 0; j < n; j++)
                off -= straight_arm(n, i, j) * (q[j] + 0.05 * q[j] * q[j]);
            for (int j = 0; j < n; j++) {
                b[j] += arm(n, i, j, q[j]) * off;
                for (int k = 0; k < n; k++)
                    A[j * n + k] += arm(n, i, j, q[j]) * arm(n, i, k, q[k]);
            }
        }
        (void)awiwi_solve(n, 1, A, b);
        for (int j = 0; j < n; j++)
            q[j] += b[j];
    }
    return answer(JOINT_ESTIMATE, q);
}

static int coupling(int n, const double *q, double *P)
{
    for (int i = 0; i < 2 * n; i++)
        for (int j = 0; j < n; j++)
            P[i * n + j] = arm(n, i, j, q[j]) * (fabs(q[0] - 0.7) < 1e-9 ? 0 : 1); /* singular there */
    return answer(COUPLING, P);
}

static int torque(int n, const double *q, const double *f, double *tau)
{
    for (int j = 0; j < n; j++) {
        tau[j] = 0;
        for (int i = 0; i < 2 * n; i++)
            tau[j] -= arm(n, i, j, q[j]) * f[i];
    }
    return answer(JOINT_TORQUE, tau);
}

static int stiffness(int n, const double *q, const double *f, const double *k, double *K)
{
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++) {
            K[a * n + b] = 0;
            for (int i = 0; i < 2 * n; i++)
                K[a * n + b] += arm(n, i, a, q[a]) * arm(n, i, b, q[b]) * (k[i] + f[i]);
        }
    return answer(JOINT_STIFFNESS, K);
}

static int of_tendons(int n, const double *f, double *k, double *slope, double *curvature)
{
    for (int i = 0; i < 2 * n; i++) {
        k[i] = SPRING + 60 * f[i];
        slope[i] = 60 - f[i];
        curvature[i] = -1;
    }
    return answer(TENDON_STIFFNESS, k);
}

static int dynamics(int n, const double *q, const double *qd, const double *g, double *M, double *C, double *gravity)
{
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) {
            M[a * n + b] = a == b ? INERTIA * (2 - (double)a / n + 0.1 * q[0]) : INERTIA / 10 / n * (1 + q[n - 1]);
            C[a * n + b] = INERTIA * (qd[0] + (a - b) * qd[n - 1]);
        }
        gravity[a] = -0.001 * (g[0] + (a + 1) * g[1] * q[a] + g[2] / 2);
    }
    return answer(DYNAMICS, M);
}

static int tip(int n, const double *q, double *T, double *J)
{
    for (int i = 0; i < 16; i++)
        T[i] = i % 5 == 0;
    for (int i = 0; i < 3; i++) {
        T[4 * i + 3] = 0.01 * i;
        for (int j = 0; j < n; j++) {
            J[i * n + j] = 0.01 * (i + 1 + j);
            T[4 * i + 3] += J[i * n + j] * q[j];
        }
    }
    return answer(TIP, T);
}

static int distribution(int n, const double *q, const double *tau, const double *K, const double *low,
                        const double *high, double *f)
{
    int status = AWIWI_OK;
    for (int i = 0; i < 2 * n; i++) {
        f[i] = 2.5 + 0.3 * i + K[0] + 2 * K[n * n - 1] - K[n - 1] + 0.1 * q[0];
        for (int j = 0; j < n; j++)
            f[i] -= 0.5 / n / n * tau[j] / straight_arm(n, i, j);
        if (f[i] < *low || f[i] > *high)
            status = AWIWI_INFEASIBLE;
        f[i] = f[i] < *low ? *low : f[i] > *high ? *high : f[i];
    }
    const int told = answer(DISTRIBUTION, f);
    return told ? told : status;
}

static int forward(int n, const double *q, const double *qd, const double *tau, const double *g, double *qdd)
{
    for (int j = 0; j < n; j++)
        qdd[j] = (tau[j] - INERTIA * qd[0] * qd[j] + 0.001 * (g[0] + (j + 1) * g[1] * q[j] + g[2] / 2))
                 / (INERTIA * (2 - (double)j / n + 0.1 * q[0]));
    return answer(FORWARD_DYNAMICS, qdd);
}

/* The same kernels with the shapes of both fingers. */
#define FINGER(n) \
    static int measured_##n(const double *theta, const double *x, const double *w, double *h) \
    { return measured(n, theta, x, w, h); } \
    static int estimate_##n(const double *h, const double *start, double *q) { return estimate(n, h, start, q); } \
    static int lengths_##n(const double *q, double *h) { return lengths(n, q, h); } \
    static int coupling_##n(const double *q, double *P) { return coupling(n, q, P); } \
    static int torque_##n(const double *q, const double *f, double *tau) { return torque(n, q, f, tau); } \
    static int stiffness_##n(const double *q, const double *f, const double *k, double *K) \
    { return stiffness(n, q, f, k, K); } \
    static int of_tendons_##n(const double *f, double *k, double *slope, double *curvature) \
    { return of_tendons(n, f, k, slope, curvature); } \
    static int dynamics_##n(const double *q, const double *qd, const double *g, double *M, double *C, double *gravity) \
    { return dynamics(n, q, qd, g, M, C, gravity); } \
    static int tip_##n(const double *q, double *T, double *J) { return tip(n, q, T, J); } \
    static int distribution_##n(const double *q, const double *tau, const double *K, const double *low, \
                                const double *high, double *f) \
    { return distribution(n, q, tau, K, low, high, f); } \
    static int forward_##n(const double *q, const double *qd, const double *tau, const double *g, double *qdd) \
    { return forward(n, q, qd, tau, g, qdd); }
FINGER(8)
FINGER(2)
FINGER(1)
#define KERNELS(n) \
    measured_##n, estimate_##n, lengths_##n, coupling_##n, torque_##n, stiffness_##n, of_tendons_##n, dynamics_##n, \
        tip_##n, distribution_##n

/* -- kernels of the whole hand ------------------------------------------------------------------------------------- */

static const double slack_ends[] = {0, 900, 120, 100, 110, 980}, taut_ends[] = {1000, 150, 880, 920, 930, 140};
static const double many_zeros[AWIWI_ALL_TENDONS];
static const double many_ends[] = {9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2, 9e2};

static int sensors_of(int n, const double *reading, const double *slack, const double *taut, double *travel, double *f)
{
    for (int i = 0; i < n; i++) {
        const double x = LEVER * (reading[i] - slack[i]) / (taut[i] - slack[i]);
        travel[i] = LEVER * (1 + 0.1 * i) - x;
        f[i] = SPRING * x * (1 + BEND * x);
    }
    return answer(SENSORS, f);
}

static int sensors(const double *reading, double *travel, double *f)
{
    return sensors_of(HAND_TENDONS, reading, slack_ends, taut_ends, travel, f);
}

static int many_sensors(const double *reading, double *travel, double *f)
{
    return sensors_of(AWIWI_ALL_TENDONS, reading, many_zeros, many_ends, travel, f);
}

static int elongation(const double *f, double *x)
{
    *x = (sqrt(1 + 4 * BEND / SPRING * *f) - 1) / (2 * BEND);
    return answer(SPRING_ELONGATION, x);
}

static int wrist_lengths(const double *wrist, double *w)
{
    for (int i = 0; i < HAND_TENDONS; i++)
        w[i] = 0.05 + 0.003 * (i - 2) * wrist[0] + 0.002 * wrist[1];
    return fabs(wrist[0]) < 1 ? answer(WRIST_LENGTHS, w) : AWIWI_OUT_OF_DOMAIN;
}

static int stretch(const double *f, double *x)
{
    *x = STRETCH * *f * (1 + 0.01 * *f);
    return answer(TENDON_STRETCH, x);
}

static int friction(const double *thd, double *tau)
{
    *tau = FRICTION * *thd;
    return answer(MOTOR_FRICTION, tau);
}

static int correction(const double *k_eff, const double *k_mech, double *k_imp, double *sensitivity)
{
    *k_imp = *k_eff * *k_mech / (*k_mech - *k_eff);
    *sensitivity = 1;
    return *k_eff < *k_mech ? answer(STIFFNESS_CORRECTION, k_imp) : AWIWI_OUT_OF_DOMAIN;
}

static int filter(const double *motion, const double *desired, const double *delay, const double *period, double *next)
{
    const double share = *period / *delay;
    for (int i = 0; i < 5; i++)
        next[i] = motion[i] + share * (desired[i] - motion[i]) + (i < 4 ? *period * 0.1 * motion[i + 1] : 0);
    return answer(REFERENCE_FILTER, next);
}

static int acceleration(const double *theta, const double *thd, const double *tau, const double *f, double *thdd)
{
    *thdd = (*tau - PULLEY * *f - FRICTION * *thd - 1e-6 * *theta) / MOTOR;
    return answer(MOTOR_ACCELERATION, thdd);
}

static const awiwi_finger fingers[FINGERS] = {
    {0, 2, 0, 4, 1, {0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1}, KERNELS(2)},
    {2, 1, 4, 2, 0, {0, 0, 1, 1, 0, 0, 0, 1, 0}, KERNELS(1)},
};
static const double joint_low[] = {-0.8, -0.9, -0.5}, joint_high[] = {0.9, 0.8, 1}, efforts[] = {0.06, 0.05, 0.07};
static const double tendon_low[] = {0.1, 0.1, 0.2, 0, 0.1, 0.1}, tendon_high[] = {9, 9, 8, 9, 9, 9};

#define HAND(wrist, stretches, resistance) \
    {77, FINGERS, HAND_JOINTS, HAND_TENDONS, fingers, joint_low, joint_high, efforts, tendon_low, tendon_high, \
     slack_ends, taut_ends, MOTOR, PULLEY, 0.2, 2.5, 20, sensors, wrist, elongation, stretches, resistance, \
     correction, filter}

static const awiwi_hand stub_hand = HAND(wrist_lengths, stretch, friction), plain_hand = HAND(0, 0, 0);
static const awiwi_forward forwards[] = {forward_2, forward_1};
const awiwi_hand_plant stub_plant = {&stub_hand, forwards, acceleration, friction};
static const awiwi_finger whole_finger = {0, 8, 0, 16, 1, {0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1}, KERNELS(8)};
static const double many_low[] = {-1, -1, -1, -1, -1, -1, -1, -1}, many_high[] = {1, 1, 1, 1, 1, 1, 1, 1};
static const awiwi_hand whole_hand = {
    78, 1, AWIWI_ALL_JOINTS, AWIWI_ALL_TENDONS, &whole_finger, many_low, many_high, many_high, many_zeros, many_ends,
    many_zeros, many_ends, MOTOR, PULLEY, 0.2, 2.5, 20, many_sensors, 0, elongation, stretch, friction,
    correction, filter};
static const awiwi_forward whole_forward[] = {forward_8};
const awiwi_hand_plant whole_plant = {&whole_hand, whole_forward, acceleration, friction};
const awiwi_hand_plant plain_plant = {&plain_hand, forwards, acceleration, friction};
