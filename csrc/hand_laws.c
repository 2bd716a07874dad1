/* From a finger's sensors and demands to the torques of its motors. */
#include "numerics.h"
#include "dense.h"
#include "hand_parts.h"

static const awiwi_real MOST_TRAVEL = (awiwi_real)0.98; /* of the motors' travel is used */

enum { JOINTS = AWIWI_MOST_JOINTS, TENDONS = AWIWI_MOST_TENDONS };

/* What the parts of one finger's tick hand on. */
typedef struct finger_now {
    const awiwi_finger *finger;
    int index;
    awiwi_real measured[TENDONS]; /* lengths as measured, */
    awiwi_real h[TENDONS];        /* and with those of the last estimate where they are unknown */
} finger_now;

/* -- where the finger is ------------------------------------------------------------------------------------------- */

/* Tendons of unknown length have that of the last estimate. */
static int fill_in(const awiwi_context *now, finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    const unsigned *status = now->state->tendon_status + finger->first_tendon;
    awiwi_real expected[TENDONS];
    unsigned unseen = 0;
    for (int i = 0; i < finger->tendons; i++) {
        own->h[i] = own->measured[i];
        unseen |= awiwi_unseen(status[i]);
    }
    if (!unseen)
        return AWIWI_OK;
    const int found = finger->tendon_lengths(now->state->q + finger->first_joint, expected);
    for (int i = 0; i < finger->tendons; i++)
        if (awiwi_unseen(status[i]))
            own->h[i] = expected[i];
    return found;
}

/* Tendons whose lengths disagree with those of the estimated joints. */
static unsigned compare(const awiwi_context *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_real expected[TENDONS];
    unsigned status = 0;
    if (finger->tendon_lengths(now->state->q + finger->first_joint, expected) != AWIWI_OK)
        return AWIWI_NO_ESTIMATE;
    for (int i = 0; i < finger->tendons; i++) {
        unsigned *known = now->state->tendon_status + finger->first_tendon + i;
        if (!awiwi_unseen(*known) && awiwi_size(own->h[i] - expected[i]) > now->gains->residual) {
            *known |= AWIWI_INCONSISTENT;
            status = AWIWI_INCONSISTENT;
        }
    }
    return status;
}

static unsigned estimate(const awiwi_context *now, finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_real *q = now->state->q + finger->first_joint, *qd = now->state->qd + finger->first_joint, found[JOINTS];
    awiwi_lengths(now, finger, own->measured);
    if (fill_in(now, own) != AWIWI_OK)
        return AWIWI_NO_ESTIMATE;
    const int status = finger->joint_estimate(own->h, q, found);
    if (status != AWIWI_OK || !awiwi_all_finite(found, finger->joints))
        return AWIWI_NO_ESTIMATE;
    for (int j = 0; j < finger->joints; j++) {
        qd[j] = awiwi_rate(now, qd[j], found[j] - q[j]);
        q[j] = found[j];
    }
    return compare(now, own);
}

/* -- what is wanted ------------------------------------------------------------------------------------------------ */

static unsigned refer(const awiwi_context *now, const awiwi_finger *finger)
{
    awiwi_hand_state *state = now->state;
    unsigned status = 0;
    for (int i = 0, j = finger->first_joint; i < finger->joints; i++, j++) {
        const awiwi_real wanted = awiwi_given(now->input->q_des[j], state->demand[j], &status);
        const awiwi_real within = awiwi_clamp(wanted, now->hand->joint_low[j] + now->gains->stop_margin,
                                              now->hand->joint_high[j] - now->gains->stop_margin);
        awiwi_real desired[5] = {within, awiwi_given(now->input->qd_des[j], 0, &status),
                                 awiwi_given(now->input->qdd_des[j], 0, &status), 0, 0};
        awiwi_real next[5];
        if (within < wanted || within > wanted) {
            status |= AWIWI_REFERENCE;
            desired[1] = desired[2] = 0;
        }
        state->demand[j] = within;
        if (now->hand->reference_filter(state->motion[j], desired, &now->gains->delay, &now->gains->period, next)
            != AWIWI_OK)
            return status | AWIWI_NO_LAW;
        for (int k = 0; k < 5; k++)
            state->motion[j][k] = next[k];
    }
    return status;
}

/* Torques of the joints and, by the least change of the planned ones, forces of the tendons. */
static unsigned follow(const awiwi_context *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint;
    awiwi_real change[JOINTS];
    const unsigned status = awiwi_torques(now, own->index, state->tau + first);
    for (int i = 0; i < n; i++)
        change[i] = state->planned_tau[first + i] - state->tau[first + i];
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++)
        state->f_des[k] = awiwi_clamp(state->planned_f[k] + awiwi_dot(state->spread[k], change, n),
                                      now->gains->force_low, now->gains->force_high);
    return status;
}

/* -- the laws ------------------------------------------------------------------------------------------------------ */

/* The friction of a motor, as far as it is compensated. */
static awiwi_real friction(const awiwi_context *now, int k)
{
    awiwi_real tau = 0;
    if (now->hand->motor_friction && now->hand->motor_friction(now->state->thd + k, &tau) != AWIWI_OK)
        return 0;
    return now->gains->friction_share * tau;
}

/* Motors stand where the tendons have the planned forces at the wanted angles. */
static unsigned motor_impedance(const awiwi_context *now, const finger_now *own, awiwi_real *torque)
{
    const awiwi_hand *hand = now->hand;
    const awiwi_hand_gains *gains = now->gains;
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int first = finger->first_joint;
    const awiwi_real end = MOST_TRAVEL * hand->motor_travel;
    awiwi_real q[JOINTS], h[TENDONS];
    for (int i = 0; i < finger->joints; i++)
        q[i] = awiwi_clamp(state->motion[first + i][0] + state->yield[first + i], hand->joint_low[first + i],
                           hand->joint_high[first + i]);
    if (finger->tendon_lengths(q, h) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0; i < finger->tendons; i++) {
        const int k = finger->first_tendon + i;
        const awiwi_real resistance = friction(now, k);
        const awiwi_real shorter = own->measured[i] - h[i] + (state->planned_x[k] - state->x[k]);
        const awiwi_real theta_des = awiwi_clamp(state->theta[k] + shorter / hand->motor_pulley, -end, end);
        state->f_des[k] = state->planned_f[k];
        if (hand->motor_impedance(state->theta + k, state->thd + k, &theta_des, state->f_des + k, &resistance,
                                  &hand->motor_pulley, &gains->motor_kp, &gains->motor_kd, torque + i) != AWIWI_OK)
            return AWIWI_NO_LAW;
    }
    return 0;
}

/* Every tendon's force is controlled. */
static unsigned cascade(const awiwi_context *now, const finger_now *own, awiwi_real *torque)
{
    static const awiwi_real nothing = 0;
    const awiwi_hand *hand = now->hand;
    const awiwi_hand_gains *gains = now->gains;
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const unsigned status = follow(now, own);
    for (int i = 0; i < finger->tendons && !(status & AWIWI_FAULTS); i++) {
        const int k = finger->first_tendon + i;
        const awiwi_real resistance = friction(now, k);
        if (hand->cascade(state->f + k, state->xd + k, state->stiffness + k, state->slope + k, &nothing,
                          state->f_des + k, &nothing, &nothing, &resistance, &hand->motor_pulley, &hand->motor_inertia,
                          &gains->force_kp, &gains->force_kd, torque + i) != AWIWI_OK)
            return status | AWIWI_NO_LAW;
    }
    return status;
}

/* Motors are held back before the ends of their travel. */
static unsigned hold_back(const awiwi_context *now, const awiwi_finger *finger, awiwi_real *torque)
{
    const awiwi_real end = MOST_TRAVEL * now->hand->motor_travel;
    unsigned status = 0;
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        const awiwi_real theta = now->state->theta[k], beyond = theta - awiwi_clamp(theta, -end, end);
        if (beyond < 0 || beyond > 0) {
            torque[i] -= now->gains->motor_kp * beyond;
            now->state->tendon_status[k] |= AWIWI_TRAVEL;
            status = AWIWI_TRAVEL;
        }
    }
    return status;
}

unsigned awiwi_finger_law(const awiwi_context *now, int index, awiwi_real *torque)
{
    finger_now own;
    own.finger = now->hand->finger + index;
    own.index = index;
    unsigned status = estimate(now, &own);
    status |= refer(now, own.finger);
    if (now->state->turn == index && !(status & AWIWI_FAULTS))
        now->state->plan_status[index] = awiwi_plan(now, index);
    status |= now->state->plan_status[index];
    if (status & AWIWI_FAULTS)
        return status;
    status |= now->state->law == AWIWI_LAW_CASCADE ? cascade(now, &own, torque) : motor_impedance(now, &own, torque);
    return status | hold_back(now, own.finger, torque);
}
