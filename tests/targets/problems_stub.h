/* Hands whose kernels are a few lines each, and which refuse when they are told to; and how their ticks are told. */
#ifndef PROBLEMS_STUB_H
#define PROBLEMS_STUB_H

#include "awiwi_hand_plant.h"
#include "problems.h"

enum { FINGERS = 2, HAND_JOINTS = 3, HAND_TENDONS = 6 };

enum kernel_of_hand {
    MEASURED_LENGTHS,
    JOINT_ESTIMATE,
    TENDON_LENGTHS,
    COUPLING,
    JOINT_TORQUE,
    JOINT_STIFFNESS,
    TENDON_STIFFNESS,
    DYNAMICS,
    TIP,
    DISTRIBUTION,
    SENSORS,
    WRIST_LENGTHS,
    SPRING_ELONGATION,
    TENDON_STRETCH,
    MOTOR_FRICTION,
    STIFFNESS_CORRECTION,
    REFERENCE_FILTER,
    FORWARD_DYNAMICS,
    MOTOR_ACCELERATION,
    HAND_KERNELS
};

/* From now on a kernel answers its calls from the one `after` so many with this status, or with a number that is none
   if it is AWIWI_OK. */
void refuse_call(int kernel, int after, int status);
void refuse_nothing(void);

/* The hand with all kernels, the one without those that it may lack, and one finger as large as there is room for. */
extern const awiwi_hand_plant stub_plant, plain_plant, whole_plant;

/* A hand in motion, all that belongs to it. */
typedef struct scene {
    const awiwi_hand_plant *plant;
    awiwi_hand_world world;
    awiwi_hand_input input;
    awiwi_hand_gains gains;
    awiwi_hand_state state;
} scene;

extern scene now;

/* Take the simulated sensors into now.input; step with it; or both for some ticks. */
void sense(void);
void step(const char *name);
void run(const char *name, int ticks);

/* Scenarios: each begins with a scene and may leave anything behind. */
void try_protection(const scene *start);
void try_slack(const scene *start);

#endif
