/* Parts of a hand's tick. Not part of the firmware interface. */
#ifndef AWIWI_HAND_PARTS_H
#define AWIWI_HAND_PARTS_H

#include "awiwi_hand.h"

#define AWIWI_MOST_TRAVEL ((awiwi_real)0.98) /* of the motors' travel is used */

/* What a tick works on. */
typedef struct awiwi_context {
    const awiwi_hand *hand;
    const awiwi_hand_gains *gains;
    const awiwi_hand_input *input;
    awiwi_hand_state *state;
    awiwi_real per_period; /* 1/period [1/s] */
    awiwi_real pace;       /* share of a change that the filters of rates take in a tick */
    awiwi_real fade;       /* share of the torque after a change that a tick takes away */
    awiwi_real heating;    /* share of the load that becomes heat in a tick */
    awiwi_real per_lasting; /* 1/continuous_torque [1/(N m)] */
    awiwi_real inertia_per_radius; /* of a motor and its pulley [kg m] */
} awiwi_context;

/* The context of a tick with these gains. */
awiwi_context awiwi_context_of(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                               awiwi_hand_state *state);

/* Take the sensors: forces, elongations, wrist lengths, and the status of every tendon and of the wrist. A sensor that
   is not good keeps its last value. */
unsigned awiwi_sense(const awiwi_context *now);

/* A low-pass filter of first order: its value a tick later, which takes a share `pace` of the change. */
static inline awiwi_real awiwi_low_pass(awiwi_real value, awiwi_real now, awiwi_real pace)
{
    return value + pace * (now - value);
}

/* Whether a tendon of this status has an unknown length. */
static inline unsigned awiwi_unseen(unsigned status)
{
    return status & (AWIWI_FAULTS | AWIWI_SLACK);
}

/* Find anew the friction of some motors, of each in one of a few ticks: speeds are filtered for longer than that. */
void awiwi_resist(const awiwi_context *now);

/* The matrices of the reference filter, by the columns that its kernel gives; not AWIWI_OK, and no other matrices,
   where these gains have none. */
int awiwi_set_filter(const awiwi_hand *hand, const awiwi_hand_gains *gains, awiwi_hand_state *state);

/* Lengths [tendons] of a finger as measured. */
void awiwi_lengths(const awiwi_context *now, const awiwi_finger *finger, awiwi_real *h);

/* A number of the input, or `instead` where it is none, with AWIWI_REFERENCE in the status. */
awiwi_real awiwi_given(awiwi_real x, awiwi_real instead, unsigned *status);

/* A finger's joint torques [joints], within their limits: those that are fed forward, and what the law of joint torques
   adds; returns the status. */
unsigned awiwi_torques(const awiwi_context *now, int finger, awiwi_real *tau);

/* Plan a finger's forces, when it is its turn; returns its status. */
unsigned awiwi_plan(const awiwi_context *now, int finger);

/* What changes slowly, half a round after a finger has planned: torques fed forward, how joints yield, and where the
   coupling changes the forces per torque; returns its status. */
unsigned awiwi_prepare(const awiwi_context *now, int finger);

/* A finger's motor torques [tendons], where its tendons together have this status; returns the finger's status. */
unsigned awiwi_finger_law(const awiwi_context *now, int finger, unsigned of_tendons, awiwi_real *torque);

#endif
