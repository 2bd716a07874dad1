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
    awiwi_real measured[TENDONS];           /* lengths as measured, */
    awiwi_real h[TENDONS];                  /* and with those of the last estimate where they are unknown */
    awiwi_real M[JOINTS * JOINTS];          /* dynamics */
    awiwi_real C[JOINTS * JOINTS];
    awiwi_real gravity[JOINTS];
    awiwi_real stiffness[TENDONS];          /* of the tendons at the wanted forces, */
    awiwi_real slope[TENDONS];              /* and its derivative */
    awiwi_real pose[JOINTS];                /* in which forces are chosen: the wanted or the present one */
} finger_now;

/* -- where the finger is --------------------------------------------------------------------------------------------- */

/* Tendons of unknown length have that of the last estimate. */
static int fill_in(const awiwi_tick_of *now, finger_now *own)
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
static unsigned compare(const awiwi_tick_of *now, const finger_now *own)
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

static unsigned estimate(const awiwi_tick_of *now, finger_now *own)
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
        qd[j] = awiwi_rate(qd[j], found[j] - q[j], now->gains);
        q[j] = found[j];
    }
    return compare(now, own);
}

/* -- what is wanted -------------------------------------------------------------------------------------------------- */

/* A number of the input, or `instead` where it is none. */
static awiwi_real given(awiwi_real x, awiwi_real instead, unsigned *status)
{
    if (awiwi_all_finite(&x, 1))
        return x;
    *status |= AWIWI_REFERENCE;
    return instead;
}

static unsigned refer(const awiwi_tick_of *now, const awiwi_finger *finger)
{
    awiwi_hand_state *state = now->state;
    unsigned status = 0;
    for (int i = 0, j = finger->first_joint; i < finger->joints; i++, j++) {
        const awiwi_real wanted = given(now->input->q_des[j], state->demand[j], &status);
        const awiwi_real within = awiwi_clamp(wanted, now->hand->joint_low[j] + now->gains->stop_margin,
                                              now->hand->joint_high[j] - now->gains->stop_margin);
        awiwi_real desired[5] = {within, given(now->input->qd_des[j], 0, &status),
                                 given(now->input->qdd_des[j], 0, &status), 0, 0};
        awiwi_real next[5];
        if (within < wanted || within > wanted) {
            status |= AWIWI_REFERENCE;
            desired[1] = desired[2] = 0;
        }
        state->demand[j] = within;
        if (now->hand->reference_filter(state->motion[j], desired, &now->gains->delay, &now->gains->period, next) != AWIWI_OK)
            return status | AWIWI_NO_LAW;
        for (int k = 0; k < 5; k++)
            state->motion[j][k] = next[k];
    }
    return status;
}

static int dynamics(const awiwi_tick_of *now, finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    const int j = finger->first_joint;
    awiwi_real g[3];
    for (int i = 0; i < 3; i++) {
        const awiwi_real axis[3] = {finger->base[i], finger->base[3 + i], finger->base[6 + i]};
        g[i] = awiwi_dot(axis, now->input->gravity, 3);
    }
    return finger->dynamics(now->state->q + j, now->state->qd + j, g, own->M, own->C, own->gravity);
}

/* The torque that a soft end stop adds at the angle q. */
static awiwi_real end_stop(const awiwi_tick_of *now, int j, unsigned *status)
{
    const awiwi_real low = now->hand->joint_low[j] + now->gains->stop_margin, q = now->state->q[j];
    const awiwi_real high = now->hand->joint_high[j] - now->gains->stop_margin;
    if (low >= high || (q >= low && q <= high))
        return 0;
    *status |= AWIWI_END_STOP;
    return now->gains->stop_stiffness * ((q < low ? low : high) - q);
}

/* The fingertip as a point between springs and dampers; nothing where its stiffness is 0. */
static unsigned hold_tip(const awiwi_tick_of *now, const finger_now *own, awiwi_real *tau)
{
    const awiwi_finger *finger = own->finger;
    const int n = finger->joints;
    unsigned status = 0;
    const awiwi_real k = given(now->input->tip_stiffness[own->index], 0, &status);
    const awiwi_real d = given(now->input->tip_damping[own->index], 0, &status);
    awiwi_real T[16], J[6 * JOINTS];
    if (!(k > 0))
        return status;
    if (finger->tip(now->state->q + finger->first_joint, T, J) != AWIWI_OK)
        return status | AWIWI_NO_LAW;
    for (int axis = 0; axis < 3; axis++) {
        const awiwi_real place = T[4 * axis + 3], to = given(now->input->tip[own->index][axis], place, &status);
        const awiwi_real rate = awiwi_dot(J + axis * n, now->state->qd + finger->first_joint, n);
        const awiwi_real force = k * (to - place) - d * rate;
        for (int i = 0; i < n; i++)
            tau[i] += J[axis * n + i] * force;
    }
    return status;
}

/* What the law of joint torques adds (eq. 11.4, 11.10): springs and dampers of the joints, soft end stops, the fingertip. */
static unsigned impedance(const awiwi_tick_of *now, const finger_now *own, awiwi_real *tau)
{
    const awiwi_hand_state *state = now->state;
    const int n = own->finger->joints, first = own->finger->first_joint;
    unsigned status = 0;
    for (int i = 0, j = first; i < n; i++, j++) {
        const awiwi_real K = given(now->input->stiffness[j], 0, &status);
        const awiwi_real D = given(now->input->damping[j], 0, &status);
        tau[i] += K * (state->motion[j][0] - state->q[j]) + D * (state->motion[j][1] - state->qd[j]);
        tau[i] += end_stop(now, j, &status);
    }
    return status | hold_tip(now, own, tau);
}

/* Joint torques of the filtered motion and of the caller, and of the impedance where the law controls torques. */
static unsigned torques(const awiwi_tick_of *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint;
    awiwi_real *tau = state->tau + first;
    unsigned status = 0;
    for (int i = 0; i < n; i++) {
        tau[i] = own->gravity[i] + given(now->input->torque[first + i], 0, &status);
        for (int k = 0; k < n; k++)
            tau[i] += own->M[i * n + k] * state->motion[first + k][2] + own->C[i * n + k] * state->motion[first + k][1];
    }
    if (state->law == AWIWI_CASCADE)
        status |= impedance(now, own, tau);
    for (int i = 0; i < n; i++) {
        const awiwi_real most = now->hand->joint_effort[first + i], within = awiwi_clamp(tau[i], -most, most);
        if (within < tau[i] || within > tau[i])
            status |= AWIWI_TORQUE_LIMIT;
        tau[i] = within;
    }
    return status;
}

/* -- tendon forces --------------------------------------------------------------------------------------------------- */

/* Forces of the wanted torque and stiffness, from the solver. */
static unsigned solve(const awiwi_tick_of *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, j = finger->first_joint;
    awiwi_real K[JOINTS * JOINTS];
    unsigned ignored = 0;
    for (int i = 0; i < n * n; i++)
        K[i] = 0;
    for (int i = 0; i < n; i++)
        K[i * n + i] = given(now->input->stiffness[j + i], 0, &ignored);
    const int status = finger->distribution(own->pose, state->tau + j, K, &now->gains->force_low,
                                            &now->gains->force_high, state->f_solved + finger->first_tendon);
    for (int i = 0; i < n; i++)
        state->tau_solved[j + i] = state->tau[j + i];
    if (status == AWIWI_INFEASIBLE)
        return AWIWI_UNREACHABLE;
    return status == AWIWI_OK || status == AWIWI_NOT_CONVERGED ? 0 : AWIWI_NO_LAW;
}

/* Between two solutions forces follow the torque by the least change. */
static unsigned follow(const awiwi_tick_of *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, m = finger->tendons, j = finger->first_joint, t = finger->first_tendon;
    awiwi_real P[TENDONS * JOINTS], A[JOINTS * JOINTS], change[JOINTS];
    if (finger->coupling(own->pose, P) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0; i < n; i++) {
        change[i] = state->tau_solved[j + i] - state->tau[j + i];
        for (int k = 0; k < n; k++) {
            A[i * n + k] = 0;
            for (int a = 0; a < m; a++)
                A[i * n + k] += P[a * n + i] * P[a * n + k];
        }
    }
    if (!awiwi_solve(n, 1, A, change))
        return AWIWI_NO_LAW;
    for (int i = 0; i < m; i++) {
        const awiwi_real f = state->f_solved[t + i] + awiwi_dot(P + i * n, change, n);
        state->f_des[t + i] = awiwi_clamp(f, now->gains->force_low, now->gains->force_high);
    }
    return 0;
}

static unsigned forces(const awiwi_tick_of *now, finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    const int t = finger->first_tendon, fresh = now->state->turn == own->index;
    awiwi_real curvature[TENDONS];
    for (int i = 0; i < finger->joints; i++) {
        const int j = finger->first_joint + i;
        own->pose[i] = now->state->law == AWIWI_CASCADE ? now->state->q[j] : now->state->motion[j][0];
    }
    unsigned status = fresh ? solve(now, own) : now->state->finger_status[own->index] & AWIWI_UNREACHABLE;
    if (!(status & AWIWI_FAULTS))
        status |= follow(now, own);
    if (!(status & AWIWI_FAULTS)
        && finger->tendon_stiffness(now->state->f_des + t, own->stiffness, own->slope, curvature) != AWIWI_OK)
        status |= AWIWI_NO_LAW;
    return status;
}

/* -- the laws -------------------------------------------------------------------------------------------------------- */

/* Joints yield to their loads, as a spring in series with the tendons would, so that they have the wanted stiffness
   (eq. 8.1, each joint with the others held). A joint whose tendons are softer does not yield. */
static unsigned yield(const awiwi_tick_of *now, const finger_now *own)
{
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int n = finger->joints, first = finger->first_joint;
    const awiwi_real *f = state->f + finger->first_tendon, *f_des = state->f_des + finger->first_tendon;
    awiwi_real K[JOINTS * JOINTS], loaded[JOINTS], wanted[JOINTS];
    unsigned status = 0;
    if (finger->joint_stiffness(state->q + first, f_des, own->stiffness, K) != AWIWI_OK
        || finger->joint_torque(state->q + first, f, loaded) != AWIWI_OK
        || finger->joint_torque(state->q + first, f_des, wanted) != AWIWI_OK)
        return AWIWI_NO_LAW;
    for (int i = 0; i < n; i++) {
        const awiwi_real k = now->input->stiffness[first + i];
        awiwi_real k_imp, sensitivity, aim = 0, pace = now->gains->compliance_bandwidth * now->gains->period;
        if (now->hand->stiffness_correction(&k, K + i * n + i, &k_imp, &sensitivity) == AWIWI_OK)
            aim = (wanted[i] - loaded[i]) / k_imp, pace *= k / K[i * n + i]; /* for a joint that is held */
        else
            status |= AWIWI_STIFFER;
        state->yield[first + i] += pace / (1 + pace) * (aim - state->yield[first + i]);
    }
    return status;
}

static awiwi_real friction(const awiwi_tick_of *now, int k)
{
    awiwi_real tau = 0;
    if (now->hand->compensation && now->hand->compensation(now->state->theta + k, now->state->thd + k, &tau) != AWIWI_OK)
        return 0;
    return tau;
}

/* Motors stand where the tendons have the wanted forces at the wanted angles. */
static unsigned motor_impedance(const awiwi_tick_of *now, const finger_now *own, awiwi_real *torque)
{
    const awiwi_hand *hand = now->hand;
    const awiwi_hand_gains *gains = now->gains;
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    const int first = finger->first_joint;
    awiwi_real q[JOINTS], h[TENDONS];
    unsigned status = yield(now, own);
    if (status & AWIWI_FAULTS)
        return status;
    for (int i = 0; i < finger->joints; i++)
        q[i] = awiwi_clamp(state->motion[first + i][0] + state->yield[first + i], hand->joint_low[first + i],
                           hand->joint_high[first + i]);
    if (finger->tendon_lengths(q, h) != AWIWI_OK)
        return status | AWIWI_NO_LAW;
    for (int i = 0; i < finger->tendons; i++) {
        const int k = finger->first_tendon + i;
        const awiwi_real resistance = friction(now, k);
        awiwi_real x, stretch = 0;
        if (hand->spring_elongation(state->f_des + k, &x) != AWIWI_OK)
            return status | AWIWI_NO_LAW;
        if (hand->tendon_stretch)
            (void)hand->tendon_stretch(state->f_des + k, &stretch);
        const awiwi_real shorter = own->measured[i] - h[i] + (x + stretch - state->x[k]);
        const awiwi_real end = MOST_TRAVEL * hand->motor_travel;
        const awiwi_real theta_des = awiwi_clamp(state->theta[k] + shorter / hand->motor_pulley, -end, end);
        if (hand->motor_impedance(state->theta + k, state->thd + k, &theta_des, state->f_des + k, &resistance,
                                  &hand->motor_pulley, &gains->motor_kp, &gains->motor_kd, torque + i) != AWIWI_OK)
            return status | AWIWI_NO_LAW;
    }
    return status;
}

/* Every tendon's force is controlled. */
static unsigned cascade(const awiwi_tick_of *now, const finger_now *own, awiwi_real *torque)
{
    static const awiwi_real nothing = 0;
    const awiwi_hand *hand = now->hand;
    const awiwi_hand_gains *gains = now->gains;
    const awiwi_finger *finger = own->finger;
    awiwi_hand_state *state = now->state;
    for (int i = 0; i < finger->tendons; i++) {
        const int k = finger->first_tendon + i;
        const awiwi_real resistance = friction(now, k);
        if (hand->cascade(state->f + k, state->xd + k, own->stiffness + i, own->slope + i, &nothing, state->f_des + k,
                          &nothing, &nothing, &resistance, &hand->motor_pulley, &hand->motor_inertia, &gains->force_kp,
                          &gains->force_kd, torque + i) != AWIWI_OK)
            return AWIWI_NO_LAW;
    }
    return 0;
}

/* Motors are held back before the ends of their travel. */
static unsigned hold_back(const awiwi_tick_of *now, const awiwi_finger *finger, awiwi_real *torque)
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

unsigned awiwi_finger_law(const awiwi_tick_of *now, int index, awiwi_real *torque)
{
    finger_now own;
    own.finger = now->hand->finger + index;
    own.index = index;
    unsigned status = estimate(now, &own);
    status |= refer(now, own.finger);
    if (status & AWIWI_FAULTS)
        return status;
    if (dynamics(now, &own) != AWIWI_OK)
        return status | AWIWI_NO_LAW;
    status |= torques(now, &own);
    status |= forces(now, &own);
    if (status & AWIWI_FAULTS)
        return status;
    status |= now->state->law == AWIWI_CASCADE ? cascade(now, &own, torque) : motor_impedance(now, &own, torque);
    return status | hold_back(now, own.finger, torque);
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
