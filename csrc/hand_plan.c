/* What a finger plans when it is its turn: forces for torque and stiffness, and how joints yield. Between its turns
   only its law runs. */
#include "numerics.h"
#include "dense.h"
#include "hand_parts.h"

enum { JOINTS = AWIWI_MOST_JOINTS, TENDONS = AWIWI_MOST_TENDONS };

awiwi_real awiwi_given(awiwi_real x, awiwi_real instead, unsigned *status)
{
    if (awiwi_is_number(x))
        return x;
    *status |= AWIWI_REFERENCE;
    return instead;
}

/* Joint torques of the filtered motion and of the caller. */
static unsigned feed(const awiwi_context *now, const awiwi_finger *finger)
{
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint;
    awiwi_real M[JOINTS * JOINTS], C[JOINTS * JOINTS], gravity[JOINTS], g[3];
    unsigned status = 0;
    for (int i = 0; i < 3; i++) {
        const awiwi_real axis[3] = {finger->base[i], finger->base[3 + i], finger->base[6 + i]};
        g[i] = awiwi_dot(axis, now->input->gravity, 3);
    }
    if (finger->dynamics(state->q + first, state->qd + first, g, M, C, gravity) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0; i < n; i++) {
        awiwi_real tau = gravity[i] + awiwi_given(now->input->torque[first + i], 0, &status);
        for (int k = 0; k < n; k++)
            tau += M[i * n + k] * state->motion[first + k][2] + C[i * n + k] * state->motion[first + k][1];
        state->feed[first + i] = tau;
        state->inertia[first + i] = M[i * n + i];
    }
    return status;
}

/* The torque that a soft end stop adds at the angle q. */
static awiwi_real end_stop(const awiwi_context *now, int j, unsigned *status)
{
    const awiwi_real low = now->hand->joint_low[j] + now->gains->stop_margin, q = now->state->q[j];
    const awiwi_real high = now->hand->joint_high[j] - now->gains->stop_margin;
    if ((q >= low && q <= high) || low >= high)
        return 0;
    *status |= AWIWI_END_STOP;
    return now->gains->stop_stiffness * (awiwi_clamp(q, low, high) - q);
}

/* The fingertip as a point between springs and dampers; nothing where its stiffness is 0. */
static unsigned hold_tip(const awiwi_context *now, int index, awiwi_real *tau)
{
    const awiwi_finger *finger = now->hand->finger + index;
    const int n = finger->joints;
    unsigned status = 0;
    const awiwi_real k = awiwi_given(now->input->tip_stiffness[index], 0, &status);
    const awiwi_real d = awiwi_given(now->input->tip_damping[index], 0, &status);
    awiwi_real T[16], J[6 * JOINTS];
    if (!(k > 0))
        return status;
    if (finger->tip(now->state->q + finger->first_joint, T, J) != AWIWI_OK)
        return status | AWIWI_NO_LAW;
    for (int axis = 0; axis < 3; axis++) {
        const awiwi_real at = T[4 * axis + 3], to = awiwi_given(now->input->tip[index][axis], at, &status);
        const awiwi_real rate = awiwi_dot(J + axis * n, now->state->qd + finger->first_joint, n);
        const awiwi_real force = k * (to - at) - d * rate;
        for (int i = 0; i < n; i++)
            tau[i] += J[axis * n + i] * force;
    }
    return status;
}

/* What the law of joint torques adds (eq. 11.4, 11.10): springs and dampers of the joints, soft end stops, the
   fingertip. */
static unsigned impedance(const awiwi_context *now, int index, awiwi_real *tau)
{
    const awiwi_finger *finger = now->hand->finger + index;
    const awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint;
    unsigned status = 0;
    for (int i = 0, j = first; i < n; i++, j++) {
        const awiwi_real K = awiwi_given(now->input->stiffness[j], 0, &status);
        const awiwi_real D = awiwi_given(now->input->damping[j], 0, &status);
        tau[i] += K * (state->motion[j][0] - state->q[j]) + D * (state->motion[j][1] - state->qd[j]);
        tau[i] += end_stop(now, j, &status);
    }
    return status | hold_tip(now, index, tau);
}

unsigned awiwi_torques(const awiwi_context *now, int index, awiwi_real *tau)
{
    const awiwi_finger *finger = now->hand->finger + index;
    unsigned status = 0;
    for (int i = 0; i < finger->joints; i++)
        tau[i] = now->state->feed[finger->first_joint + i];
    if (now->state->law != AWIWI_LAW_MOTOR_IMPEDANCE)
        status |= impedance(now, index, tau);
    for (int i = 0, j = finger->first_joint; i < finger->joints; i++, j++) {
        const awiwi_real most = now->hand->joint_effort[j];
        if (awiwi_size(tau[i]) > most) {
            status |= AWIWI_TORQUE_LIMIT;
            tau[i] = tau[i] < 0 ? -most : most;
        }
    }
    return status;
}

/* Forces of the wanted torque and stiffness. A search goes on from those of the last turn, so that none is long. */
static unsigned solve(const awiwi_context *now, int index, const awiwi_real *pose)
{
    const awiwi_finger *finger = now->hand->finger + index;
    awiwi_hand_state *state = now->state;
    const awiwi_real *low = &now->gains->force_low, *high = &now->gains->force_high;
    const int n = finger->joints, j = finger->first_joint;
    awiwi_real K[JOINTS * JOINTS], last[TENDONS], *f = state->planned_f + finger->first_tendon;
    const awiwi_real *tau = state->planned_tau + j;
    unsigned status = awiwi_torques(now, index, state->planned_tau + j);
    for (int i = 0; i < n * n; i++)
        K[i] = 0;
    for (int i = 0; i < n; i++)
        K[i * n + i] = awiwi_given(now->input->stiffness[j + i], 0, &status);
    for (int i = 0; i < finger->tendons; i++)
        last[i] = f[i];
    const int found = finger->update && state->ready ? finger->update(pose, tau, K, low, high, last, f)
                                                     : finger->distribution(pose, tau, K, low, high, f);
    if (found == AWIWI_INFEASIBLE)
        return status | AWIWI_UNREACHABLE;
    return found == AWIWI_OK || found == AWIWI_NOT_CONVERGED ? status : status | AWIWI_NO_LAW;
}

/* The least change of forces per change of torque, P (P'P)^-1: also the change of angles per change of lengths. */
static unsigned spread(const awiwi_context *now, const awiwi_finger *finger)
{
    const int n = finger->joints, m = finger->tendons, t = finger->first_tendon;
    awiwi_real P[TENDONS * JOINTS], A[JOINTS * JOINTS], x[JOINTS];
    int order[JOINTS], regular;
    if (finger->coupling(now->state->q + finger->first_joint, P) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0; i < n; i++)
        for (int k = 0; k <= i; k++) {
            awiwi_real sum = 0;
            for (int a = 0; a < m; a++)
                sum += P[a * n + i] * P[a * n + k];
            A[i * n + k] = A[k * n + i] = sum;
        }
    regular = awiwi_factor(n, A, order);
    for (int a = 0; a < m && regular; a++) {
        for (int i = 0; i < n; i++)
            x[i] = P[a * n + i];
        awiwi_substitute(n, 1, A, order, x);
        for (int i = 0; i < n; i++)
            now->state->spread[t + a][i] = x[i];
    }
    return regular ? 0u : AWIWI_NO_LAW;
}

/* Elongations, stiffnesses and their slopes at the planned forces. */
static unsigned elongate(const awiwi_context *now, const awiwi_finger *finger)
{
    awiwi_hand_state *state = now->state;
    const int t = finger->first_tendon;
    awiwi_real curvature[TENDONS];
    if (finger->tendon_stiffness(state->planned_f + t, state->stiffness + t, state->slope + t, curvature) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int k = t; k < t + finger->tendons; k++) {
        awiwi_real x;
        if (!(state->stiffness[k] > 0) || now->hand->spring_elongation(state->planned_f + k, &x) != AWIWI_OK)
            return AWIWI_NO_LAW;
        state->planned_x[k] = x + state->compliance * state->planned_f[k];
    }
    return 0;
}

/* Joints yield to their loads, as a spring in series with the tendons would, so that they have the wanted stiffness
   (eq. 8.1, each joint with the others held). A joint whose tendons are softer does not yield. */
static unsigned yield(const awiwi_context *now, const awiwi_finger *finger)
{
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint, t = finger->first_tendon;
    awiwi_real K[JOINTS * JOINTS], loaded[JOINTS], wanted[JOINTS];
    unsigned status = 0;
    if (finger->joint_stiffness(state->q + first, state->planned_f + t, state->stiffness + t, K) != AWIWI_OK
        || finger->joint_torque(state->q + first, state->f + t, loaded) != AWIWI_OK
        || finger->joint_torque(state->q + first, state->planned_f + t, wanted) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0; i < n; i++) {
        const awiwi_real k = now->input->stiffness[first + i];
        awiwi_real k_imp, sensitivity, aim = 0;
        state->elastic[first + i] = K[i * n + i];
        awiwi_real pace = now->gains->compliance_bandwidth * now->gains->period * (awiwi_real)now->hand->fingers;
        if (now->hand->stiffness_correction(&k, K + i * n + i, &k_imp, &sensitivity) == AWIWI_OK) {
            aim = (wanted[i] - loaded[i]) / k_imp;
            pace *= k / K[i * n + i]; /* so that a joint that is held yields at this bandwidth */
        } else {
            status |= AWIWI_STIFFER;
        }
        const awiwi_real yields = state->yield[first + i], wanted_angle = state->motion[first + i][0];
        state->yield[first + i] = awiwi_clamp(yields + pace / (1 + pace) * (aim - yields),
                                              now->hand->joint_low[first + i] - wanted_angle,
                                              now->hand->joint_high[first + i] - wanted_angle);
    }
    return status;
}

unsigned awiwi_plan(const awiwi_context *now, int index)
{
    const awiwi_finger *finger = now->hand->finger + index;
    awiwi_real pose[JOINTS];
    for (int i = 0, j = finger->first_joint; i < finger->joints; i++, j++)
        pose[i] = now->state->law == AWIWI_LAW_MOTOR_IMPEDANCE ? now->state->motion[j][0] : now->state->q[j];
    const unsigned status = solve(now, index, pose);
    return status & AWIWI_FAULTS ? status : status | elongate(now, finger);
}

unsigned awiwi_prepare(const awiwi_context *now, int index)
{
    const awiwi_finger *finger = now->hand->finger + index;
    if (finger->bent || !now->state->ready)
        now->state->spread_status[index] = spread(now, finger);
    const unsigned status = feed(now, finger);
    return status & AWIWI_FAULTS ? status : status | yield(now, finger);
}

int awiwi_hand_suggest(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_real *q,
                       awiwi_hand_input *input)
{
    static const awiwi_real rest[JOINTS], nowhere[3];
    awiwi_real f[TENDONS], k[TENDONS], slope[TENDONS], curvature[TENDONS];
    awiwi_real K[JOINTS * JOINTS], M[JOINTS * JOINTS], C[JOINTS * JOINTS], gravity[JOINTS];
    for (int i = 0; i < TENDONS; i++)
        f[i] = gains->force_low;
    for (int i = 0; i < hand->fingers; i++) {
        const awiwi_finger *finger = hand->finger + i;
        const int n = finger->joints, first = finger->first_joint;
        if (finger->tendon_stiffness(f, k, slope, curvature) != AWIWI_OK
            || finger->joint_stiffness(q + first, f, k, K) != AWIWI_OK
            || finger->dynamics(q + first, rest, nowhere, M, C, gravity) != AWIWI_OK)
            return AWIWI_OUT_OF_DOMAIN;
        for (int j = 0; j < n; j++) {
            input->stiffness[first + j] = K[j * n + j] / 4;
            input->damping[first + j] = 2 * awiwi_sqrt(input->stiffness[first + j] * M[j * n + j]);
        }
    }
    return AWIWI_OK;
}
