/* The whole hand at 3 kHz: awiwi_hand_step drives a simulated hand, in all laws, through a fault and out of it. On a real
   board sense() reads converters and act() writes drives. Build and run with `make hand` (POSIX) or `make run-hand`
   (bare metal); the digest of all torques is the same on every machine. */
#include "awiwi.h"
#include "hand.h"
#include "meter.h"
#include "self_test.h"

#include <stdint.h>
#include <string.h>

#ifndef TICKS
#define TICKS 1200 /* of which each law runs the same share */
#endif

enum { FAULTY = 8, FAULT_BEGINS = 200, FAULT_ENDS = 205 };

static awiwi_hand_input input;
static awiwi_hand_gains gains;
static awiwi_hand_state state;
static awiwi_hand_world world; /* instead of a hand */
static awiwi_real torque[AWIWI_TENDONS];

static void sense(void)
{
    awiwi_hand_measure(&awiwi_simulated_hand, &world, &input);
}

static int act(void)
{
    return awiwi_hand_move(&awiwi_simulated_hand, torque, &world);
}

/* A hand at rest in the middle of its range, under pretension. */
static int place(awiwi_real *q)
{
    static const awiwi_real straight[AWIWI_TENDONS];
    for (int j = 0; j < AWIWI_JOINTS; j++) {
        q[j] = (awiwi_joint_low[j] + awiwi_joint_high[j]) / 2;
        world.damping[j] = (awiwi_real)2e-4;
    }
    for (int k = 0; k < AWIWI_TENDONS; k++)
        world.spring[k] = 1;
    world.period = gains.period;
    world.substeps = 4;
    world.friction = 1;
    world.reading_noise = (awiwi_real)0.5;
    world.gravity[2] = (awiwi_real)-9.81;
    world.wrist[0] = (awiwi_real)0.6239;
    world.wrist[1] = (awiwi_real)0.9725;
    return awiwi_hand_place(&awiwi_simulated_hand, q, straight, 20, &world);
}

/* What a planner wants. */
static void demand(int tick, const awiwi_real *start)
{
    for (int j = 0; j < AWIWI_JOINTS; j++)
        input.q_des[j] = start[j] + (tick % 400 < 200 ? (awiwi_real)0.1 : (awiwi_real)-0.1);
    input.law = tick / (TICKS / AWIWI_LAWS);
    input.enable = 1;
    if (tick >= FAULT_BEGINS && tick < FAULT_ENDS)
        input.reading_valid[FAULTY] = 0; /* sense() sets it again */
}

static uint64_t add(uint64_t digest, const awiwi_real *numbers, int count)
{
    for (int i = 0; i < count; i++) {
        unsigned char bytes[sizeof *numbers];
        memcpy(bytes, numbers + i, sizeof bytes);
        for (unsigned b = 0; b < sizeof bytes; b++)
            digest = (digest ^ bytes[b]) * 0x100000001B3u;
    }
    return digest;
}

int main(void)
{
    awiwi_real start[AWIWI_JOINTS];
    uint64_t digest = 0xCBF29CE484222325u;
    uint32_t longest[AWIWI_LAWS] = {0}, total[AWIWI_LAWS] = {0}, deepest = 0, late = 0;
    unsigned seen = 0;
    gains = awiwi_default_gains;
    if (awiwi_self_test(0) != 0 || place(start) != AWIWI_OK)
        return 2;
    sense();
    (void)awiwi_hand_suggest(&awiwi_hand_model, &gains, start, &input);
    if (awiwi_hand_init(&awiwi_hand_model, &gains, &input, start, &state) != 0)
        return 3;
    meter_start();
    for (int tick = 0; tick < TICKS; tick++) {
        sense();
        demand(tick, start);
        meter_begin(tick % 100 == 99); /* paints the stack now and then */
        seen |= awiwi_hand_step(&awiwi_hand_model, &gains, &input, &state, torque);
        const meter_reading spent = meter_end();
        longest[state.law] = spent.instructions > longest[state.law] ? spent.instructions : longest[state.law];
        total[state.law] += spent.instructions;
        deepest = spent.stack > deepest ? spent.stack : deepest;
        late += spent.instructions > meter_budget;
        digest = add(digest, torque, AWIWI_TENDONS);
        if (act() != AWIWI_OK)
            return 4;
    }
    meter_print("ticks", TICKS);
    meter_print("status", seen);
    meter_print("digest", (uint32_t)(digest ^ digest >> 32));
    meter_print("motor impedance, instructions on average", total[0] / (TICKS / AWIWI_LAWS));
    meter_print("motor impedance, instructions at most", longest[0]);
    meter_print("cascade, instructions on average", total[1] / (TICKS / AWIWI_LAWS));
    meter_print("cascade, instructions at most", longest[1]);
    meter_print("backstepping, instructions on average", total[2] / (TICKS / AWIWI_LAWS));
    meter_print("backstepping, instructions at most", longest[2]);
    meter_print("stack", deepest);
    meter_print("overruns", late);
    return late != 0;
}
