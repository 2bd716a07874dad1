/* Ticks of the whole hand in closed loop with inputs drawn to make them dear. With trace-pc coverage it counts the
   basic blocks of each tick and saves the dearest one of each law; without, it runs a saved tick again, for callgrind.
   Arguments: file, ticks to draw (0 to run the file's), law. */
#include "awiwi.h"
#include "hand.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct saved {
    long blocks;
    awiwi_hand_input input;
    awiwi_hand_gains gains;
    awiwi_hand_state state;
} saved;

static long blocks;
static saved now, dearest[AWIWI_LAWS];
static awiwi_hand_world world;
static awiwi_real torque[AWIWI_TENDONS], start[AWIWI_JOINTS];

void __sanitizer_cov_trace_pc(void);
void __sanitizer_cov_trace_pc(void)
{
    blocks++;
}

static double uniform(double low, double high)
{
    static unsigned long long seed = 88172645463325252u;
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return low + (high - low) * (double)(seed >> 11) / 9007199254740992.0;
}

/* Once in so many calls. */
static int rarely(double calls)
{
    return uniform(0, calls) < 1;
}

/* A hand at rest, and its tick at the beginning. */
static int begin(void)
{
    static const awiwi_real straight[AWIWI_TENDONS];
    memset(&now, 0, sizeof now);
    memset(&world, 0, sizeof world);
    now.gains = awiwi_default_gains;
    for (int j = 0; j < AWIWI_JOINTS; j++) {
        start[j] = (awiwi_joint_low[j] + awiwi_joint_high[j]) / 2;
        world.damping[j] = 2e-4;
    }
    for (int k = 0; k < AWIWI_TENDONS; k++)
        world.spring[k] = 1;
    world.period = now.gains.period;
    world.substeps = 4;
    world.friction = 1;
    world.reading_noise = 0.5;
    world.gravity[2] = -9.81;
    world.wrist[0] = 0.6239;
    world.wrist[1] = 0.9725;
    if (awiwi_hand_place(&awiwi_simulated_hand, start, straight, 20, &world))
        return 1;
    awiwi_hand_measure(&awiwi_simulated_hand, &world, &now.input);
    (void)awiwi_hand_suggest(&awiwi_hand_model, &now.gains, start, &now.input);
    memcpy(now.input.q_des, start, sizeof start);
    now.input.law = (int)uniform(0, AWIWI_LAWS);
    now.input.enable = 1;
    return awiwi_hand_init(&awiwi_hand_model, &now.gains, &now.input, start, &now.state) != 0;
}

/* Demands, gravity and loads of one joint or of the hand anew. */
static void draw(void)
{
    awiwi_hand_input *input = &now.input;
    const int j = (int)uniform(0, AWIWI_JOINTS), finger = (int)uniform(0, AWIWI_FINGERS);
    const double range = awiwi_joint_high[j] - awiwi_joint_low[j], effort = awiwi_joint_effort[j];
    input->q_des[j] = rarely(3) ? (rarely(2) ? awiwi_joint_low[j] : awiwi_joint_high[j])
                                : uniform(awiwi_joint_low[j] - range / 9, awiwi_joint_high[j] + range / 9);
    input->torque[j] = rarely(2) ? 0 : uniform(-effort, effort) * (rarely(3) ? 4 : 0.3);
    input->stiffness[j] *= pow(10, uniform(-0.5, 0.5));
    if (rarely(4) || !(fabs(input->stiffness[j]) < 100))
        input->stiffness[j] = uniform(-0.2, 2);
    input->tip_stiffness[finger] = rarely(3) ? uniform(0, 200) : 0;
    world.load[j] = rarely(2) ? 0 : uniform(-0.1, 0.1);
    for (int i = 0; i < 3; i++)
        input->tip[finger][i] = uniform(-0.1, 0.1);
    if (rarely(20))
        for (int i = 0; i < 3; i++)
            world.gravity[i] = uniform(-15, 15);
    if (rarely(50))
        input->qd_des[j] = rarely(2) ? NAN : uniform(-9, 9);
    if (rarely(50))
        input->qd_des[j] = 0;
    if (rarely(100))
        input->law = (int)uniform(0, AWIWI_LAWS);
    if (rarely(200)) {
        now.gains = awiwi_default_gains;
        now.gains.force_low = uniform(1, 20);
        now.gains.force_high = now.gains.force_low + uniform(5, 60);
        now.gains.motor_kp *= uniform(0.7, 1.2);
    }
}

/* What sensors say, some of them wrong. */
static void sense(void)
{
    awiwi_hand_measure(&awiwi_simulated_hand, &world, &now.input);
    const int k = (int)uniform(0, AWIWI_TENDONS);
    if (rarely(30))
        now.input.reading_valid[k] = 0;
    if (rarely(30))
        now.input.theta[k] += uniform(-0.3, 0.3);
    if (rarely(30))
        now.input.reading[k] += uniform(-200, 200);
    now.input.reset = rarely(100);
}

static int tick(void)
{
    saved before = now;
    blocks = 0;
    (void)awiwi_hand_step(&awiwi_hand_model, &now.gains, &now.input, &now.state, torque);
    before.blocks = blocks;
    if (blocks > dearest[now.state.law].blocks)
        dearest[now.state.law] = before;
    return awiwi_hand_move(&awiwi_simulated_hand, torque, &world);
}

int main(int count, char **words)
{
    const long ticks = count == 4 ? atol(words[2]) : -1;
    FILE *file = ticks >= 0 ? fopen(words[1], ticks > 0 ? "wb" : "rb") : 0;
    if (!file)
        return 2;
    if (ticks == 0) {
        const int found = fread(dearest, sizeof dearest, 1, file) == 1;
        now = dearest[atoi(words[3]) % AWIWI_LAWS];
        return !found + (awiwi_hand_step(&awiwi_hand_model, &now.gains, &now.input, &now.state, torque) == ~0u);
    }
    if (begin())
        return 3;
    for (long i = 0; i < ticks; i++) {
        for (int draws = (int)uniform(0, 3); draws > 0; draws--)
            draw();
        sense();
        if ((tick() || rarely(3000)) && begin())
            return 3;
    }
    (void)fwrite(dearest, sizeof dearest, 1, file);
    return fclose(file) != 0;
}
