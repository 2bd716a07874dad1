/* The tick of a whole hand: sensors, laws, and what becomes of faults. */
#include "numerics.h"
#include "dense.h"
#include "hand_parts.h"

#include <stddef.h>
#include <string.h>

static const awiwi_real HOT = (awiwi_real)0.9; /* heat from which on a motor's limit falls to what it bears for ever */

/* -- motors -------------------------------------------------------------------------------------------------------- */

/* The largest torque of a motor that is hot. */
static awiwi_real limit_of(const awiwi_context *now, awiwi_real heat)
{
    const awiwi_real most = now->hand->motor_torque, lasting = now->gains->continuous_torque;
    const awiwi_real share = (heat - HOT) / (1 - HOT);
    if (lasting >= most)
        return most;
    return share < 1 ? most + share * (lasting - most) : lasting;
}

/* A motor's torque within its limit; its heat follows the square of the torque. */
static unsigned drive(const awiwi_context *now, int k, awiwi_real wanted)
{
    awiwi_real *heat = now->state->heat + k, most = now->hand->motor_torque, torque = wanted;
    unsigned status = 0;
    if (*heat > HOT) {
        const awiwi_real limit = limit_of(now, *heat);
        status = limit < most ? AWIWI_HOT : 0u;
        most = limit;
    }
    if (!(awiwi_size(wanted) <= most)) {
        torque = wanted < 0 ? -most : most;
        status |= AWIWI_SATURATED;
    }
    const awiwi_real load = torque * now->per_lasting;
    *heat = awiwi_low_pass(*heat, load * load, now->heating);
    now->state->torque[k] = torque;
    return status;
}

/* -- modes --------------------------------------------------------------------------------------------------------- */

/* A finger's next mode. A fault that lasted longer than hold_ticks ends in AWIWI_FAULT, whether or not it goes away. */
static int mode_after(const awiwi_context *now, int index, int faulty)
{
    const awiwi_hand_state *state = now->state;
    const int lasting = state->waited[index] > now->gains->hold_ticks, enabled = now->input->enable != 0;
    switch (state->mode[index]) {
    case AWIWI_OFF:
        return enabled && !faulty ? AWIWI_RUN : AWIWI_OFF;
    case AWIWI_RAMP:
        if (state->share[index] <= 0)
            return lasting ? AWIWI_FAULT : AWIWI_OFF;
        return enabled && !lasting && !faulty ? AWIWI_RUN : AWIWI_RAMP;
    case AWIWI_FAULT:
        return now->input->reset && !faulty ? AWIWI_OFF : AWIWI_FAULT;
    default:
        return lasting || !enabled ? AWIWI_RAMP : faulty ? AWIWI_HOLD : AWIWI_RUN;
    }
}

static void change_mode(const awiwi_context *now, int index, int faulty)
{
    awiwi_hand_state *state = now->state;
    const int lasting = state->waited[index] > now->gains->hold_ticks;
    state->waited[index] = lasting ? state->waited[index] : faulty ? state->waited[index] + 1 : 0;
    state->mode[index] = mode_after(now, index, faulty);
    if (state->mode[index] == AWIWI_RUN)
        state->share[index] = awiwi_clamp(state->share[index] + now->fade, 0, 1);
    else if (state->mode[index] == AWIWI_RAMP)
        state->share[index] = awiwi_clamp(state->share[index] - now->fade, 0, 1);
    else if (state->mode[index] == AWIWI_OFF)
        state->waited[index] = 0;
}

/* A finger without torque wants to be where it is. */
static void rest(awiwi_hand_state *state, const awiwi_finger *finger)
{
    for (int j = finger->first_joint; j < finger->first_joint + finger->joints; j++) {
        memset(state->motion[j], 0, sizeof state->motion[j]);
        state->motion[j][0] = state->q[j];
        state->yield[j] = 0;
    }
}

/* Offsets of a finger's motors, from its pose q of the whole hand's joints. */
static unsigned place(const awiwi_context *now, const awiwi_finger *finger, const awiwi_real *q)
{
    awiwi_hand_state *state = now->state;
    awiwi_real measured[AWIWI_MOST_TENDONS], known[AWIWI_MOST_TENDONS];
    const int t = finger->first_tendon, j = finger->first_joint;
    if (!awiwi_all_finite(q + j, finger->joints) || finger->tendon_lengths(q + j, known) != AWIWI_OK)
        return AWIWI_NO_ESTIMATE;
    awiwi_lengths(now, finger, measured);
    for (int i = 0; i < finger->tendons; i++) {
        state->offset[t + i] = (measured[i] - known[i]) / now->hand->motor_pulley;
        state->length[t + i] = known[i];
        state->f_des[t + i] = state->f[t + i];
    }
    for (int i = 0; i < finger->joints; i++)
        state->q[j + i] = state->demand[j + i] = q[j + i];
    rest(state, finger);
    return 0;
}

/* Torques begin with the last ones: what they differ by is faded out. */
static void begin(const awiwi_context *now, const awiwi_finger *finger, awiwi_real share, const awiwi_real *torque)
{
    awiwi_hand_state *state = now->state;
    const awiwi_real most = now->hand->motor_torque / share; /* what was wanted beyond it did not act */
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++)
        state->jump[k] = share > 0 ? awiwi_clamp(state->wanted[k], -most, most) - torque[i] : 0;
}

/* Torques of a finger's motors: those of its law, where it has a result, else the last ones. After a pause or a change
   they begin with the last ones. */
static unsigned give(const awiwi_context *now, int index, const awiwi_real *torque)
{
    const awiwi_finger *finger = now->hand->finger + index;
    awiwi_hand_state *state = now->state;
    const awiwi_real share = state->share[index], fade = now->fade;
    unsigned status = 0;
    if (torque && (!state->alive[index] || state->changed > 0))
        begin(now, finger, share, torque);
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        const awiwi_real jump = state->jump[k] - state->jump[k] * fade;
        state->jump[k] = jump;
        if (torque)
            state->wanted[k] = torque[i] + jump;
        const unsigned found = drive(now, k, share > 0 ? share * state->wanted[k] : 0);
        state->tendon_status[k] |= found;
        status |= found;
    }
    state->alive[index] = torque != 0;
    return status;
}

static unsigned step_finger(const awiwi_context *now, int index, unsigned status)
{
    const awiwi_finger *finger = now->hand->finger + index;
    awiwi_hand_state *state = now->state;
    awiwi_real torque[AWIWI_MOST_TENDONS];
    for (int i = 0; i < finger->tendons; i++)
        status |= state->tendon_status[finger->first_tendon + i];
    status |= awiwi_finger_law(now, index, status, torque);
    if (!(status & AWIWI_FAULTS) && !awiwi_all_finite(torque, finger->tendons))
        status |= AWIWI_NO_LAW;
    const int faulty = (status & AWIWI_FAULTS) != 0;
    change_mode(now, index, faulty);
    if (state->mode[index] == AWIWI_OFF || state->mode[index] == AWIWI_FAULT) {
        state->share[index] = 0;
        rest(state, finger);
    }
    status |= give(now, index, faulty ? 0 : torque);
    state->finger_status[index] = status;
    return status;
}

/* -- interface ----------------------------------------------------------------------------------------------------- */

static const int REALS_OF_GAINS = (int)(offsetof(awiwi_hand_gains, hold_ticks) / sizeof(awiwi_real));

/* Whether all gains are numbers that a law can take. */
static int usable(const awiwi_hand_gains *gains)
{
    const awiwi_real *number = &gains->period;
    for (int i = 0; i < REALS_OF_GAINS; i++)
        if (!(number[i] >= 0 && number[i] <= AWIWI_REAL_MAX))
            return 0;
    for (int finger = 0; finger < AWIWI_ALL_FINGERS; finger++)
        for (int i = 0; i < 4; i++)
            if (!(gains->tunings[finger][i] > 0))
                return 0;
    return gains->period > 0 && gains->delay > 0 && gains->motor_kp > 0 && gains->motor_kd > 0 && gains->force_kp > 0
           && gains->force_kd > 0 && gains->force_low < gains->force_high && gains->continuous_torque > 0
           && gains->heating_time >= gains->period && gains->hold_ticks >= 0 && gains->slack_ticks >= 0
           && gains->ramp_ticks > 0;
}

/* Whether gains are others; those that are no numbers are. */
static int differ(const awiwi_hand_gains *a, const awiwi_hand_gains *b)
{
    const awiwi_real *number = &a->period, *other = &b->period;
    for (int i = 0; i < REALS_OF_GAINS; i++)
        if (!(number[i] - other[i] == 0))
            return 1;
    return a->hold_ticks != b->hold_ticks || a->slack_ticks != b->slack_ticks || a->ramp_ticks != b->ramp_ticks;
}

/* Take over gains that a law can take, and what follows from them. */
static int take_gains(const awiwi_hand *hand, const awiwi_hand_gains *gains, awiwi_hand_state *state)
{
    if (!usable(gains) || awiwi_set_filter(hand, gains, state) != AWIWI_OK)
        return 0;
    state->gains = *gains;
    return 1;
}

/* Take over new gains and another law; what changes is faded in until all fingers have planned with it, and from then
   on. Gains that no law can take change nothing. */
static unsigned adopt(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                      awiwi_hand_state *state)
{
    const int law = input->law, known = law >= 0 && law < AWIWI_LAWS, others = differ(&state->gains, gains);
    const int good = !others || take_gains(hand, gains, state);
    if ((known && law != state->law) || (good && others))
        state->changed = hand->fingers;
    else if (state->changed > 0)
        state->changed--;
    if (known)
        state->law = law;
    return known && good ? 0u : AWIWI_REFERENCE;
}

unsigned awiwi_hand_init(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                         const awiwi_real *q, awiwi_hand_state *state)
{
    static const awiwi_real one = 1;
    awiwi_real ignored[AWIWI_ALL_TENDONS];
    const awiwi_context now = awiwi_context_of(hand, gains, input, state);
    memset(state, 0, sizeof *state);
    if (!take_gains(hand, gains, state)
        || hand->sensors(hand->sensor_slack, state->slack, ignored) != AWIWI_OK
        || (hand->tendon_stretch && hand->tendon_stretch(&one, &state->compliance) != AWIWI_OK))
        return state->status = AWIWI_NO_LAW;
    (void)adopt(hand, gains, input, state);
    state->changed = 0;
    memcpy(state->reading, hand->sensor_slack, (size_t)hand->tendons * sizeof *state->reading);
    unsigned status = awiwi_sense(&now);
    for (int k = 0; k < hand->tendons; k++) {
        state->thd[k] = state->xd[k] = 0;
        state->wrist_start[k] = state->wrist[k];
        if (state->tendon_status[k] & AWIWI_SLACK)
            state->tendon_status[k] |= AWIWI_READING_RANGE; /* a slack tendon: its length is unknown */
        status |= state->tendon_status[k];
    }
    for (int i = 0; i < hand->fingers; i++) {
        status |= place(&now, hand->finger + i, q);
        if (!(status & AWIWI_FAULTS))
            status |= awiwi_prepare(&now, i) & AWIWI_FAULTS; /* without forces, joints do not yield yet */
        if (!(status & AWIWI_FAULTS))
            status |= state->plan_status[i] = awiwi_plan(&now, i);
        if (!(status & AWIWI_FAULTS))
            status |= state->prepare_status[i] = awiwi_prepare(&now, i);
    }
    state->ready = !(status & AWIWI_FAULTS);
    state->status = status;
    return status;
}

unsigned awiwi_hand_step(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                         awiwi_hand_state *state, awiwi_real *torque)
{
    if (!state->ready) {
        memset(torque, 0, (size_t)hand->tendons * sizeof *torque);
        return state->status |= AWIWI_NO_LAW;
    }
    unsigned status = adopt(hand, gains, input, state);
    const awiwi_context now = awiwi_context_of(hand, &state->gains, input, state);
    const unsigned of_all = awiwi_sense(&now);
    awiwi_resist(&now);
    for (int i = 0; i < hand->fingers; i++)
        status |= step_finger(&now, i, of_all);
    memcpy(torque, state->torque, (size_t)hand->tendons * sizeof *torque);
    state->turn = (state->turn + 1) % hand->fingers;
    state->tick++;
    state->status = status;
    return status;
}

void awiwi_hand_log_begin(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                          const awiwi_real *q, awiwi_hand_log *log)
{
    memset(log, 0, sizeof *log);
    memcpy(log->magic, "AWIWILOG", sizeof log->magic);
    log->version = AWIWI_LOG_VERSION;
    log->build_id = hand->build_id;
    log->real_size = (unsigned)sizeof(awiwi_real);
    log->record_size = (unsigned)sizeof(awiwi_hand_record);
    log->gains = *gains;
    log->input = *input;
    memcpy(log->q, q, (size_t)hand->joints * sizeof *q);
}

void awiwi_hand_log_tick(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                         const awiwi_hand_state *state, awiwi_hand_record *record)
{
    memset(record, 0, sizeof *record);
    record->gains = *gains;
    record->input = *input;
    memcpy(record->torque, state->torque, (size_t)hand->tendons * sizeof *state->torque);
    record->status = state->status;
}
