/* What a board is to the firmware of docs/hand_step.md, which stands above when this is compiled: a simulated hand, and a
   place for the log. */
#include "meter.h"

#include <stdint.h>
#include <string.h>

#if !defined(__ARM_ARCH_PROFILE) || __ARM_ARCH_PROFILE != 'M'
#include <stdio.h>
static FILE *file;
#endif

#ifndef TICKS
#define TICKS 600
#endif

static awiwi_hand_world world;

static void sense(awiwi_hand_input *given)
{
    awiwi_hand_measure(&awiwi_simulated_hand, &world, given);
}

static void act(const awiwi_real *motors)
{
    (void)awiwi_hand_move(&awiwi_simulated_hand, motors, &world);
}

/* Write to the file that the program was given; a bare board has none. */
static void write_log(const void *bytes, size_t size)
{
#if !defined(__ARM_ARCH_PROFILE) || __ARM_ARCH_PROFILE != 'M'
    if (file)
        (void)fwrite(bytes, size, 1, file);
#else
    (void)bytes, (void)size;
#endif
}

/* A hand at rest in the middle of its range. */
static int place(awiwi_real *pose)
{
    static const awiwi_real straight[AWIWI_TENDONS];
    for (int j = 0; j < AWIWI_JOINTS; j++) {
        pose[j] = (awiwi_joint_low[j] + awiwi_joint_high[j]) / 2;
        world.damping[j] = (awiwi_real)2e-4;
    }
    for (int k = 0; k < AWIWI_TENDONS; k++)
        world.spring[k] = 1;
    world.period = awiwi_default_gains.period;
    world.substeps = 4;
    world.friction = 1;
    world.reading_noise = (awiwi_real)0.5;
    world.gravity[2] = (awiwi_real)-9.81;
    world.wrist[0] = (awiwi_real)0.6239;
    world.wrist[1] = (awiwi_real)0.9725;
    return awiwi_hand_place(&awiwi_simulated_hand, pose, straight, 20, &world);
}

int main(int count, char **words)
{
    awiwi_real pose[AWIWI_JOINTS];
    uint64_t digest = 0xCBF29CE484222325u;
    unsigned seen = 0;
#if !defined(__ARM_ARCH_PROFILE) || __ARM_ARCH_PROFILE != 'M'
    file = count > 1 ? fopen(words[1], "wb") : 0;
#else
    (void)count, (void)words;
#endif
    if (place(pose) != AWIWI_OK || begin(sense, pose) & AWIWI_FAULTS)
        return 1;
    begin_log(pose);
    write_log(&head, sizeof head);
    for (int i = 0; i < TICKS; i++) {
        input.q_des[AWIWI_JOINT_INDEX_PIP] = pose[AWIWI_JOINT_INDEX_PIP] + (i < TICKS / 2 ? (awiwi_real)0.2 : 0);
        seen |= tick(sense, act);
        log_tick(pose);
        write_log(&record, sizeof record);
        const unsigned char *bytes = (const unsigned char *)torque;
        for (size_t b = 0; b < sizeof torque; b++)
            digest = (digest ^ bytes[b]) * 0x100000001B3u;
    }
    meter_print("ticks", TICKS);
    meter_print("status", seen);
    meter_print("digest", (uint32_t)(digest ^ digest >> 32));
#if !defined(__ARM_ARCH_PROFILE) || __ARM_ARCH_PROFILE != 'M'
    return file && fclose(file) != 0;
#else
    return 0;
#endif
}
