/* A simulated hand for its tick: motor torques in, sensor readings out. No heap; reentrant. */
#ifndef AWIWI_HAND_PLANT_H
#define AWIWI_HAND_PLANT_H

#include "awiwi_hand.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The kernels that only a simulated hand needs; a constant of the generated simulated_hand.c. */
typedef int (*awiwi_forward)(const awiwi_real *q, const awiwi_real *qd, const awiwi_real *tau, const awiwi_real *g,
                             awiwi_real *qdd);
typedef struct awiwi_hand_plant {
    const awiwi_hand *hand;
    const awiwi_forward *forward_dynamics; /* of every finger */
    int (*motor_acceleration)(const awiwi_real *theta, const awiwi_real *thd, const awiwi_real *tau,
                              const awiwi_real *f, awiwi_real *thdd);
    awiwi_of_one motor_friction; /* thd -> tau */
} awiwi_hand_plant;

/* A hand in motion. The caller may change the first part at any time; the second is the state. */
typedef struct awiwi_hand_world {
    awiwi_real period;   /* of the controller's clock [s] */
    int substeps;        /* steps of integration in a period */
    awiwi_real gravity[3];
    awiwi_real wrist[2];
    awiwi_real damping[AWIWI_ALL_JOINTS];     /* of the links [N m s/rad] */
    awiwi_real load[AWIWI_ALL_JOINTS];        /* torque from outside [N m] */
    awiwi_real spring[AWIWI_ALL_TENDONS];     /* force of a spring over that of its calibration; 0 for a cut tendon */
    awiwi_real friction;                      /* of the motors, over that of the hand */
    awiwi_real added_inertia;                 /* of the links, as a share of their own; it has no weight */
    awiwi_real reading_noise;                 /* standard deviation, in counts; readings are whole counts */
    awiwi_real theta_step;                    /* of the motors' sensors [rad]; 0 for none */
    unsigned seed;
    unsigned tick;
    awiwi_real q[AWIWI_ALL_JOINTS];
    awiwi_real qd[AWIWI_ALL_JOINTS];
    awiwi_real theta[AWIWI_ALL_TENDONS];
    awiwi_real thd[AWIWI_ALL_TENDONS];
    awiwi_real f[AWIWI_ALL_TENDONS];       /* forces [N] */
    awiwi_real lever[AWIWI_ALL_TENDONS];   /* readings without noise */
    awiwi_real torque[AWIWI_ALL_TENDONS];  /* what acts in this period: the command of the last one */
    awiwi_real begin[AWIWI_ALL_TENDONS];   /* path, motor and elongation that belong together [m] */
    awiwi_real slack[AWIWI_ALL_TENDONS];   /* travel of the levers at their slack ends [m] */
} awiwi_hand_world;

/* Rest in the pose q [joints] with motors at theta [tendons] and every tendon under about `force`, after the caller has
   set the first part. Returns an awiwi_status. */
int awiwi_hand_place(const awiwi_hand_plant *plant, const awiwi_real *q, const awiwi_real *theta, awiwi_real force,
                     awiwi_hand_world *world);

/* Write what sensors say into an input: readings, motor angles, wrist and gravity, all valid. */
void awiwi_hand_measure(const awiwi_hand_plant *plant, const awiwi_hand_world *world, awiwi_hand_input *input);

/* One period with the torques of the last call; `torque` [tendons] acts in the next. Returns an awiwi_status. */
int awiwi_hand_move(const awiwi_hand_plant *plant, const awiwi_real *torque, awiwi_hand_world *world);

#ifdef __cplusplus
}
#endif

#endif
