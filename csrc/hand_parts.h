/* Parts of a hand's tick. Not part of the firmware interface. */
#ifndef AWIWI_HAND_PARTS_H
#define AWIWI_HAND_PARTS_H

#include "awiwi_hand.h"

/* What a tick works on. */
typedef struct awiwi_tick_of {
    const awiwi_hand *hand;
    const awiwi_hand_gains *gains;
    const awiwi_hand_input *input;
    awiwi_hand_state *state;
} awiwi_tick_of;

/* Take the sensors: forces, elongations, wrist lengths, and the status of every tendon and of the wrist. A sensor that
   is not good keeps its last value. */
unsigned awiwi_sense(const awiwi_tick_of *now);

/* Rates of motors and elongations by filtered differences to the values before, a share of 1/period a tick. */
awiwi_real awiwi_rate(awiwi_real rate, awiwi_real change, const awiwi_hand_gains *gains);

/* Whether a tendon of this status has an unknown length. */
unsigned awiwi_unseen(unsigned status);

/* Lengths [tendons] of a finger as measured. */
void awiwi_lengths(const awiwi_tick_of *now, const awiwi_finger *finger, awiwi_real *h);

/* A finger's motor torques [tendons]; returns its status. */
unsigned awiwi_finger_law(const awiwi_tick_of *now, int finger, awiwi_real *torque);

#endif
