/* From a finger's sensors and demands to the torques of its motors. */
#include "numerics.h"
#include "dense.h"
#include "hand_parts.h"

#include <string.h>

static const unsigned LIMITED = AWIWI_UNREACHABLE | AWIWI_TORQUE_LIMIT; /* torques do not follow the impedance then */
static const awiwi_real NEARBY = (awiwi_real)0.05; /* angle for which the coupling of the last round holds [rad] */

enum { JOINTS = AWIWI_MOST_JOINTS, TENDONS = AWIWI_MOST_TENDONS };

/* What the parts of one finger's tick hand on. */
typedef struct finger_now {
    const awiwi_finger *finger;
    int index;
    int seen;                     /* whether the lengths of all tendons are known */
    awiwi_real measured[TENDONS]; /* lengths as measured, */
    awiwi_real filled[TENDONS];   /* with those of the last estimate where they are unknown, */
    const awiwi_real *h;          /* and of both what the estimate takes */
    awiwi_real gained[JOINTS];    /* by how much the joints' rates have changed */
} finger_now;

/* -- where the finger is ------------------------------------------------------------------------------------------- */

/* Lengths of the tendons; those that are unknown have that of the last estimate. */
static void measure(const awiwi_context *now, finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_lengths(now, finger, own->measured);
    for (int i = 0, k = finger->first_tendon; i < finger->tendons && !own->seen; i++, k++)
        own->filled[i] = awiwi_unseen(now->state->tendon_status[k]) ? now->state->length[k] : own->measured[i];
}

/* Lengths of the tendons at the estimated joints; which of the measured ones disagree. */
static unsigned compare(const awiwi_context *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    const awiwi_real residual = now->gains->residual;
    awiwi_real expected[TENDONS];
    unsigned status = 0;
    if (finger->tendon_lengths(now->state->q + finger->first_joint, expected) != AWIWI_OK)
        return AWIWI_NO_ESTIMATE;
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        now->state->length[k] = expected[i];
        if (awiwi_size(own->h[i] - expected[i]) > residual && !awiwi_unseen(now->state->tendon_status[k])) {
            now->state->tendon_status[k] |= AWIWI_INCONSISTENT;
            status = AWIWI_INCONSISTENT;
        }
    }
    return status;
}

/* The step of Gauss and Newton from the last estimate, with the coupling of the last round: of the error it leaves a
   share as small as the coupling has changed. Returns whether it is short, and ends within the joints' limits or near
   them; other steps are the solver's. */
static int correct(const awiwi_context *now, const finger_now *own, awiwi_real *found)
{
    const awiwi_finger *finger = own->finger;
    const awiwi_hand_state *state = now->state;
    awiwi_real step[JOINTS] = {0};
    int near = !state->spread_status[own->index];
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        const awiwi_real longer = own->h[i] - state->length[k];
        AWIWI_UNROLLED for (int j = 0; j < JOINTS; j++)
            step[j] += state->spread[k][j] * longer;
    }
    for (int i = 0, j = finger->first_joint; i < finger->joints; i++, j++) {
        found[i] = state->q[j] + step[i];
        near = near && awiwi_size(step[i]) <= NEARBY && found[i] >= now->hand->joint_low[j] - NEARBY
               && found[i] <= now->hand->joint_high[j] + NEARBY;
    }
    return near;
}

static unsigned estimate(const awiwi_context *now, finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_real *q = now->state->q + finger->first_joint, *qd = now->state->qd + finger->first_joint, found[JOINTS];
    measure(now, own);
    if (!(finger->bent && correct(now, own, found))
        && (finger->joint_estimate(own->h, q, found) != AWIWI_OK || !awiwi_all_finite(found, finger->joints)))
        return AWIWI_NO_ESTIMATE;
    for (int j = 0; j < finger->joints; j++) {
        const awiwi_real last = qd[j];
        qd[j] = awiwi_low_pass(last, (found[j] - q[j]) * now->per_period, now->pace);
        own->gained[j] = qd[j] - last;
        q[j] = found[j];
    }
    return compare(now, own);
}

/* -- what is wanted ------------------------------------------------------------------------------------------------ */

/* The filtered motion of a joint a tick later, by the filter's matrices; 0 where it has no value. */
static int filter(const awiwi_hand_state *state, awiwi_real *motion, const awiwi_real *goal)
{
    const awiwi_real e[5] = {motion[0] - goal[0], motion[1] - goal[1], motion[2] - goal[2], motion[3], motion[4]};
    awiwi_real next[5], sum;
    AWIWI_UNROLLED for (int k = 0; k < 5; k++) {
        const awiwi_real *row = state->filter[k];
        next[k] = row[0] * e[0] + row[1] * e[1] + row[2] * e[2] + row[3] * e[3] + row[4] * e[4];
    }
    next[0] += goal[0] + state->ahead[0] * goal[1] + state->ahead[1] * goal[2];
    next[1] += goal[1] + state->ahead[0] * goal[2];
    next[2] += goal[2];
    sum = next[0] + next[1] + next[2] + next[3] + next[4];
    if (!awiwi_is_number(sum))
        return 0;
    AWIWI_UNROLLED for (int k = 0; k < 5; k++)
        motion[k] = next[k];
    return 1;
}

static unsigned refer(const awiwi_context *now, const awiwi_finger *finger)
{
    const awiwi_hand_input *input = now->input;
    awiwi_hand_state *state = now->state;
    const awiwi_real margin = now->gains->stop_margin;
    unsigned status = 0;
    for (int i = 0, j = finger->first_joint; i < finger->joints; i++, j++) {
        const awiwi_real low = now->hand->joint_low[j] + margin, high = now->hand->joint_high[j] - margin;
        awiwi_real goal[3] = {input->q_des[j], input->qd_des[j], input->qdd_des[j]};
        if (!awiwi_is_number(goal[0] + goal[1] + goal[2])) {
            goal[0] = awiwi_given(goal[0], state->demand[j], &status);
            goal[1] = awiwi_given(goal[1], 0, &status);
            goal[2] = awiwi_given(goal[2], 0, &status);
        }
        if (goal[0] < low || goal[0] > high) {
            status |= AWIWI_REFERENCE;
            goal[0] = awiwi_clamp(goal[0], low, high);
            goal[1] = goal[2] = 0;
        }
        state->demand[j] = goal[0];
        if (!filter(state, state->motion[j], goal))
            return status | AWIWI_NO_LAW;
    }
    return status;
}

/* Torques of the joints and, by the least change of the planned ones, forces of the tendons. */
static unsigned follow(const awiwi_context *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint;
    const awiwi_real low = now->gains->force_low, high = now->gains->force_high;
    awiwi_real change[JOINTS];
    const unsigned status = awiwi_torques(now, own->index, state->tau + first) | state->spread_status[own->index];
    AWIWI_UNROLLED for (int i = 0; i < JOINTS; i++)
        change[i] = i < n ? state->planned_tau[first + i] - state->tau[first + i] : 0;
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++)
        state->f_des[k] = awiwi_clamp(state->planned_f[k] + awiwi_dot(state->spread[k], change, JOINTS), low, high);
    return status;
}

/* -- the laws ------------------------------------------------------------------------------------------------------ */

/* Motors stand where the tendons have the planned forces at the wanted angles (eq. 11.3). */
static unsigned motor_impedance(const awiwi_context *now, const finger_now *own, awiwi_real *torque)
{
    const awiwi_hand *hand = now->hand;
    const awiwi_hand_gains *gains = now->gains;
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int first = finger->first_joint;
    const awiwi_real end = AWIWI_MOST_TRAVEL * hand->motor_travel, r = hand->motor_pulley, per_r = 1 / r;
    awiwi_real q[JOINTS], h[TENDONS];
    for (int i = 0; i < finger->joints; i++)
        q[i] = awiwi_clamp(state->motion[first + i][0] + state->yield[first + i], hand->joint_low[first + i],
                           hand->joint_high[first + i]);
    if (finger->tendon_lengths(q, h) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        const awiwi_real shorter = own->measured[i] - h[i] + (state->planned_x[k] - state->x[k]);
        const awiwi_real theta_des = awiwi_clamp(state->theta[k] + shorter * per_r, -end, end);
        state->f_des[k] = state->planned_f[k];
        torque[i] = state->friction[k] + r * state->f_des[k] + gains->motor_kp * (theta_des - state->theta[k])
                    - gains->motor_kd * state->thd[k];
    }
    return 0;
}

/* The second derivative of a tendon's force with which its error decays as e'' + kd e' + kp e = 0, where fd is its
   rate. */
static awiwi_real decay(const awiwi_context *now, int k, awiwi_real fd)
{
    const awiwi_hand_state *state = now->state;
    return now->gains->force_kp * (state->f_des[k] - state->f[k]) - now->gains->force_kd * fd;
}

/* Torque of the motor that gives a tendon's force this second derivative, for joints at rest (eq. 11.16, mended). */
static awiwi_real bend_force(const awiwi_context *now, int k, awiwi_real bend)
{
    const awiwi_hand_state *state = now->state;
    return state->friction[k] + now->hand->motor_pulley * state->f[k]
           + now->inertia_per_radius * (bend / state->stiffness[k] - state->slope[k] * (state->xd[k] * state->xd[k]));
}

/* Every tendon's force is controlled. */
static unsigned cascade(const awiwi_context *now, const finger_now *own, awiwi_real *torque)
{
    const awiwi_hand_state *state = now->state;
    const unsigned status = follow(now, own);
    for (int i = 0, k = own->finger->first_tendon; i < own->finger->tendons; i++, k++)
        torque[i] = bend_force(now, k, decay(now, k, state->stiffness[k] * state->xd[k]));
    return status;
}

/* Observe what acts on a joint besides its tendons: the share of its acceleration that they do not explain. It begins
   as at rest. */
static void observe(const awiwi_context *now, int j, awiwi_real tau, awiwi_real gained)
{
    awiwi_real *load = now->state->load + j;
    const awiwi_real pace = now->gains->load_bandwidth * now->gains->period;
    *load += pace / (1 + pace) * (now->state->inertia[j] * gained * now->per_period - tau - *load);
    if (now->state->changed > 0)
        *load = -tau;
}

/* The second derivative that motors are to give the torque of a joint, from the wanted torque, the torque that there
   is and its rate (eq. 15.71 to 15.81, mended, with the tendons for the spring). Errors of torque and rate decay, and
   the joint is a mass on a spring and a damper. */
static awiwi_real backstep(const awiwi_context *now, int j, const awiwi_real *tunings, awiwi_real wanted, awiwi_real tau,
                           awiwi_real rate)
{
    const awiwi_hand_state *state = now->state;
    const awiwi_real *motion = state->motion[j], m = state->inertia[j];
    const awiwi_real K = now->input->stiffness[j] * 0 >= 0 ? now->input->stiffness[j] : 0; /* told with the torques */
    const awiwi_real D = now->input->damping[j] * 0 >= 0 ? now->input->damping[j] : 0;
    const awiwi_real faster = tunings[0], slower = tunings[1], weight = tunings[2];
    const awiwi_real acceleration = (state->load[j] + tau) / m;
    const awiwi_real e1 = state->qd[j] - motion[1], e2 = acceleration - motion[2], e3 = rate / m - motion[3];
    const awiwi_real drift = rate + K * e1 + D * e2 - m * motion[3];
    const awiwi_real back = (faster * slower + weight / tunings[3]) * (tau - wanted) + (faster + slower) * drift;
    return state->elastic[j] * acceleration
           - (back + K * e2 + D * e3 - m * motion[4] + (slower * e1 + e2) / weight);
}

/* By how much the second derivative of a joint's torque is larger where the errors of all forces decay than the law wants
   it. */
static awiwi_real surplus(const awiwi_context *now, const finger_now *own, int i, awiwi_real wanted, awiwi_real tau,
                          awiwi_real rate)
{
    const awiwi_hand_gains *gains = now->gains;
    return gains->force_kp * (wanted - tau) - gains->force_kd * rate
           - backstep(now, own->finger->first_joint + i, gains->tunings[own->index], wanted, tau, rate);
}

/* The impedance of every joint through the torques of its tendons and their rates (chapter 15), as far as forces
   within their limits give the torques; what forces change no torque are those of the cascade. */
static unsigned backstepping(const awiwi_context *now, const finger_now *own, awiwi_real *torque)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint, t = finger->first_tendon;
    awiwi_real fd[TENDONS], tau[JOINTS], taud[JOINTS], wanted[JOINTS], change[JOINTS];
    const unsigned status = follow(now, own);
    for (int i = 0; i < finger->tendons; i++)
        fd[i] = state->stiffness[t + i] * state->xd[t + i];
    if (finger->joint_torque(state->q + first, state->f + t, tau) != AWIWI_OK
        || finger->joint_torque(state->q + first, fd, taud) != AWIWI_OK
        || finger->joint_torque(state->q + first, state->f_des + t, wanted) != AWIWI_OK)
        return status | AWIWI_NO_LAW;
    for (int i = 0; i < n; i++)
        observe(now, first + i, tau[i], own->gained[i]);
    for (int i = 0; i < JOINTS; i++)
        change[i] = i < n ? surplus(now, own, i, wanted[i], tau[i], taud[i]) : 0;
    for (int i = 0; i < finger->tendons; i++)
        torque[i] = bend_force(now, t + i, decay(now, t + i, fd[i]) + awiwi_dot(state->spread[t + i], change, JOINTS));
    return status;
}

/* Motors are held back before the ends of their travel. */
static void hold_back(const awiwi_context *now, const awiwi_finger *finger, awiwi_real *torque)
{
    const awiwi_real end = AWIWI_MOST_TRAVEL * now->hand->motor_travel;
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        const awiwi_real theta = now->state->theta[k];
        if (now->state->tendon_status[k] & AWIWI_TRAVEL)
            torque[i] -= now->gains->motor_kp * (theta < 0 ? theta + end : theta - end);
    }
}

unsigned awiwi_finger_law(const awiwi_context *now, int index, unsigned of_tendons, awiwi_real *torque)
{
    finger_now own;
    own.finger = now->hand->finger + index;
    own.index = index;
    own.seen = !awiwi_unseen(of_tendons);
    own.h = own.seen ? own.measured : own.filled;
    unsigned status = estimate(now, &own);
    status |= refer(now, own.finger);
    if ((now->state->turn + now->hand->fingers / 2) % now->hand->fingers == index && !(status & AWIWI_FAULTS))
        now->state->prepare_status[index] = awiwi_prepare(now, index);
    if (now->state->turn == index && !(status & AWIWI_FAULTS))
        now->state->plan_status[index] = awiwi_plan(now, index);
    status |= now->state->plan_status[index] | now->state->prepare_status[index];
    if (status & AWIWI_FAULTS)
        return status;
    if (now->state->law == AWIWI_LAW_MOTOR_IMPEDANCE)
        status |= motor_impedance(now, &own, torque);
    else if (now->state->law == AWIWI_LAW_CASCADE || (now->state->plan_status[index] & LIMITED))
        status |= cascade(now, &own, torque);
    else
        status |= backstepping(now, &own, torque);
    if (of_tendons & AWIWI_TRAVEL)
        hold_back(now, own.finger, torque);
    return status;
}
