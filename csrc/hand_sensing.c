/* The sensors of a hand: which are good, and what they tell of tendons and wrist. */
#include "numerics.h"
#include "dense.h"
#include "hand_parts.h"

static const awiwi_real WITHIN = (awiwi_real)0.02; /* of a sensor's span: so far beyond its ends it is believed */
static const awiwi_real BEYOND = (awiwi_real)1.004; /* of the motors' travel: so far kernels compute */
static const awiwi_real LOOSE = (awiwi_real)0.002; /* of the span: up to here the lever is at its slack end */
enum { FRICTION_TICKS = 4 };                      /* in which the friction of each motor is found once */
static const awiwi_real FASTEST = (awiwi_real)4;   /* of the motors' velocity: a faster change is a jump */

/* A lever at its end stop reads as the end, up to noise. */
static unsigned take_reading(const awiwi_context *now, int i)
{
    const awiwi_real slack = now->hand->sensor_slack[i], taut = now->hand->sensor_taut[i];
    const awiwi_real reading = now->input->reading[i], share = (reading - slack) / (taut - slack);
    if (!now->input->reading_valid[i] || !awiwi_is_number(reading))
        return AWIWI_READING_LOST;
    if (share > LOOSE && share <= 1) { /* as nearly always */
        now->state->reading[i] = reading;
        now->state->slack_for[i] = 0;
        return 0;
    }
    if (share < -WITHIN || share > 1 + WITHIN)
        return AWIWI_READING_RANGE;
    now->state->reading[i] = share < 0 ? slack : share > 1 ? taut : reading;
    if (share > LOOSE || now->input->reset) {
        now->state->slack_for[i] = 0;
        return share > LOOSE ? 0u : AWIWI_SLACK;
    }
    now->state->slack_for[i] += now->state->slack_for[i] <= now->gains->slack_ticks;
    return AWIWI_SLACK | (now->state->slack_for[i] > now->gains->slack_ticks ? AWIWI_BROKEN : 0u);
}

static void take_readings(const awiwi_context *now)
{
    for (int i = 0; i < now->hand->tendons; i++)
        now->state->tendon_status[i] = take_reading(now, i);
}

/* A motor is believed within its travel, and where it can have turned since it was last seen. */
static void take_angles(const awiwi_context *now)
{
    const awiwi_hand_input *input = now->input;
    awiwi_hand_state *state = now->state;
    const awiwi_real pace = now->pace, per_period = now->per_period, most = BEYOND * now->hand->motor_travel;
    const awiwi_real end = AWIWI_MOST_TRAVEL * now->hand->motor_travel;
    const awiwi_real fastest = state->ready ? FASTEST * now->hand->motor_velocity * now->gains->period : AWIWI_REAL_MAX;
    for (int i = 0; i < now->hand->tendons; i++) {
        const awiwi_real theta = input->theta[i], change = theta - state->theta[i], ticks = 1 + state->lost[i];
        awiwi_real *rate = state->thd + i;
        if (input->theta_valid[i] && awiwi_size(theta) <= most && awiwi_size(change) <= fastest * ticks) {
            *rate = awiwi_low_pass(*rate, change / ticks * per_period, pace);
            state->theta[i] = theta;
            state->lost[i] = 0;
            if (awiwi_size(theta) > end)
                state->tendon_status[i] |= AWIWI_TRAVEL;
        } else {
            *rate = awiwi_low_pass(*rate, 0, pace);
            state->lost[i] = ticks;
            state->tendon_status[i] |= AWIWI_ANGLE_LOST;
        }
    }
}

static void elongate(const awiwi_context *now)
{
    awiwi_hand_state *state = now->state;
    const awiwi_real pace = now->pace, per_period = now->per_period, compliance = state->compliance;
    awiwi_real travel[AWIWI_ALL_TENDONS];
    (void)now->hand->sensors(state->reading, travel, state->f);
    for (int i = 0; i < now->hand->tendons; i++) {
        const awiwi_real x = state->slack[i] - travel[i] + compliance * state->f[i];
        state->xd[i] = awiwi_low_pass(state->xd[i], (x - state->x[i]) * per_period, pace);
        state->x[i] = x;
    }
}

static unsigned wrist(const awiwi_context *now)
{
    awiwi_real lengths[AWIWI_ALL_TENDONS];
    if (!now->hand->wrist_lengths)
        return 0;
    if (now->hand->wrist_lengths(now->input->wrist, lengths) != AWIWI_OK)
        return AWIWI_WRIST_LOST;
    for (int i = 0; i < now->hand->tendons; i++)
        now->state->wrist[i] = lengths[i];
    return 0;
}

awiwi_context awiwi_context_of(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                               awiwi_hand_state *state)
{
    const awiwi_real share = gains->velocity_bandwidth * gains->period;
    const awiwi_context now = {
        hand,
        gains,
        input,
        state,
        1 / gains->period,
        share / (1 + share),
        1 / (awiwi_real)gains->ramp_ticks,
        gains->period / gains->heating_time,
        1 / gains->continuous_torque,
        hand->motor_inertia / hand->motor_pulley,
    };
    return now;
}

unsigned awiwi_sense(const awiwi_context *now)
{
    take_readings(now);
    take_angles(now);
    elongate(now);
    return wrist(now);
}

void awiwi_resist(const awiwi_context *now)
{
    const unsigned first = now->state->tick % FRICTION_TICKS;
    for (int k = (int)first; now->hand->motor_friction && k < now->hand->tendons; k += FRICTION_TICKS) {
        awiwi_real tau;
        const int status = now->hand->motor_friction(now->state->thd + k, &tau);
        now->state->friction[k] = status == AWIWI_OK ? now->gains->friction_share * tau : 0;
    }
}

void awiwi_lengths(const awiwi_context *now, const awiwi_finger *finger, awiwi_real *h)
{
    const awiwi_hand_state *state = now->state;
    awiwi_real theta[AWIWI_MOST_TENDONS], w[AWIWI_MOST_TENDONS];
    for (int i = 0, k = finger->first_tendon; i < finger->tendons; i++, k++) {
        theta[i] = state->theta[k] + state->offset[k];
        w[i] = state->wrist[k] - state->wrist_start[k];
    }
    (void)finger->measured_lengths(theta, state->x + finger->first_tendon, w, h);
}

int awiwi_set_filter(const awiwi_hand *hand, const awiwi_hand_gains *gains, awiwi_hand_state *state)
{
    static const awiwi_real still[5];
    awiwi_real columns[5][5], ahead[2] = {0};
    int status = AWIWI_OK;
    for (int i = 0; i < 5; i++) {
        awiwi_real motion[5] = {0}, moved[5] = {0};
        motion[i] = 1;
        status |= hand->reference_filter(motion, still, &gains->delay, &gains->period, columns[i]);
        if (i == 1 || i == 2) { /* a motion that follows what it wants moves as that does */
            status |= hand->reference_filter(motion, motion, &gains->delay, &gains->period, moved);
            ahead[i - 1] = moved[0];
        }
    }
    for (int i = 0; i < 5 && status == AWIWI_OK; i++)
        for (int k = 0; k < 5; k++)
            state->filter[k][i] = columns[i][k];
    for (int i = 0; i < 2 && status == AWIWI_OK; i++)
        state->ahead[i] = ahead[i];
    return status;
}
