/* The tick of a whole hand: sensor readings in, motor torques out. Bounded work, no heap; reentrant: all memory is in
   the caller's awiwi_hand_state. The hand itself is a constant of the generated hand_model.c, made of its kernels. */
#ifndef AWIWI_HAND_STEP_H
#define AWIWI_HAND_STEP_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

/* -- the hand, as the generator writes it -------------------------------------------------------------------------- */

/* Kernels of one input or several in a uniform shape; each returns an awiwi_status. */
typedef int (*awiwi_of_one)(const awiwi_real *in, awiwi_real *out);
typedef int (*awiwi_of_one_to_two)(const awiwi_real *in, awiwi_real *first, awiwi_real *second);
typedef int (*awiwi_of_two)(const awiwi_real *a, const awiwi_real *b, awiwi_real *out);
typedef int (*awiwi_of_three)(const awiwi_real *a, const awiwi_real *b, const awiwi_real *c, awiwi_real *out);

/* A finger: its places in arrays over the whole hand, the rotation [3][3] of its base in the palm, and its kernels. */
typedef struct awiwi_finger {
    int first_joint;
    int joints;
    int first_tendon;
    int tendons;
    int bent; /* whether the coupling changes with the pose */
    awiwi_real base[9];
    awiwi_of_three measured_lengths; /* theta, x, w -> h */
    awiwi_of_two joint_estimate;     /* h, start -> q */
    awiwi_of_one tendon_lengths;     /* q -> h */
    awiwi_of_one coupling;           /* q -> P */
    awiwi_of_two joint_torque;       /* q, f -> tau */
    awiwi_of_three joint_stiffness;  /* q, f, k -> K */
    int (*tendon_stiffness)(const awiwi_real *f, awiwi_real *k, awiwi_real *slope, awiwi_real *curvature);
    int (*dynamics)(const awiwi_real *q, const awiwi_real *qd, const awiwi_real *g, awiwi_real *M, awiwi_real *C,
                    awiwi_real *gravity);
    awiwi_of_one_to_two tip;         /* q -> T, J */
    int (*distribution)(const awiwi_real *q, const awiwi_real *tau, const awiwi_real *K, const awiwi_real *f_min,
                        const awiwi_real *f_max, awiwi_real *f);
    /* the same on from the last forces, with little work; null where the distribution has little */
    int (*update)(const awiwi_real *q, const awiwi_real *tau, const awiwi_real *K, const awiwi_real *f_min,
                  const awiwi_real *f_max, const awiwi_real *f_last, awiwi_real *f);
} awiwi_finger;

/* A hand: its fingers, limits by joint and by tendon, sensors, the motor, and kernels that all its parts share. */
typedef struct awiwi_hand {
    unsigned build_id;
    int fingers; /* at most AWIWI_ALL_FINGERS, and so on */
    int joints;
    int tendons;
    const awiwi_finger *finger;
    const awiwi_real *joint_low;
    const awiwi_real *joint_high;
    const awiwi_real *joint_effort;
    const awiwi_real *tendon_low;
    const awiwi_real *tendon_high;
    const awiwi_real *sensor_slack;
    const awiwi_real *sensor_taut;
    awiwi_real motor_inertia;
    awiwi_real motor_pulley;
    awiwi_real motor_torque;
    awiwi_real motor_travel;
    awiwi_real motor_velocity;
    awiwi_of_one_to_two sensors; /* readings -> travel of the levers, forces */
    awiwi_of_one wrist_lengths; /* two wrist angles -> length of every tendon in the wrist; null without a wrist */
    awiwi_of_one spring_elongation;
    awiwi_of_one tendon_stretch; /* in proportion to the force; null for tendons that do not stretch */
    awiwi_of_one motor_friction; /* thd -> tau; null where none is known */
    int (*stiffness_correction)(const awiwi_real *k_eff, const awiwi_real *k_mech, awiwi_real *k_imp,
                                awiwi_real *sensitivity);
    int (*reference_filter)(const awiwi_real *motion, const awiwi_real *desired, const awiwi_real *delay,
                            const awiwi_real *period, awiwi_real *next);
} awiwi_hand;

/* -- what the caller gives ----------------------------------------------------------------------------------------- */

/* Laws by which motors give the tendon forces. */
enum awiwi_law {
    AWIWI_LAW_MOTOR_IMPEDANCE, /* motors stand where the tendons' own stiffness holds the joint (eq. 11.3) */
    AWIWI_LAW_CASCADE,         /* joint impedance by torque, over force control of every tendon (eq. 11.16) */
    AWIWI_LAW_BACKSTEPPING,    /* joint impedance through torques and their rates (eq. 15.71 to 15.106) */
    AWIWI_LAWS
};

/* One tick's sensors, demands and commands. Arrays are in the order of hand.h. */
typedef struct awiwi_hand_input {
    awiwi_real reading[AWIWI_ALL_TENDONS]; /* of the springs' sensors, as they count */
    awiwi_real theta[AWIWI_ALL_TENDONS];   /* motor angles, as measured [rad] */
    awiwi_real wrist[2];                   /* wrist angles [rad] */
    awiwi_real gravity[3];                 /* the free fall's acceleration in palm axes [m/s^2] */
    awiwi_real q_des[AWIWI_ALL_JOINTS];    /* [rad]; jumps are filtered */
    awiwi_real qd_des[AWIWI_ALL_JOINTS];
    awiwi_real qdd_des[AWIWI_ALL_JOINTS];
    awiwi_real torque[AWIWI_ALL_JOINTS];    /* to add [N m] */
    awiwi_real stiffness[AWIWI_ALL_JOINTS]; /* K of every joint [N m/rad] */
    awiwi_real damping[AWIWI_ALL_JOINTS];   /* D of every joint [N m s/rad]; this and the next not in every law */
    awiwi_real tip[AWIWI_ALL_FINGERS][3];   /* desired place of every fingertip in its finger's base frame [m] */
    awiwi_real tip_stiffness[AWIWI_ALL_FINGERS]; /* [N/m]; 0 for none */
    awiwi_real tip_damping[AWIWI_ALL_FINGERS];   /* [N s/m] */
    unsigned char reading_valid[AWIWI_ALL_TENDONS];
    unsigned char theta_valid[AWIWI_ALL_TENDONS];
    int law;    /* an awiwi_law */
    int enable; /* 0 fades all torques out, and in again from 1 on */
    int reset;  /* 1 ends a fault */
} awiwi_hand_input;

/* What may be tuned, at any time: a change is faded in. Where they change in every tick, torques follow the law only as
   fast as it fades. They are numbers from 0 on, those that divide or that a law needs above 0. */
typedef struct awiwi_hand_gains {
    awiwi_real period;               /* of the clock [s] */
    awiwi_real delay;                /* of the reference filter [s] */
    awiwi_real velocity_bandwidth;   /* of the filters behind differences [rad/s] */
    awiwi_real compliance_bandwidth; /* of what joints yield to loads [rad/s] */
    awiwi_real motor_kp;             /* [N m/rad] */
    awiwi_real motor_kd;             /* [N m s/rad] */
    awiwi_real friction_share;       /* of the motors' friction that is compensated */
    awiwi_real force_kp;             /* [1/s^2] */
    awiwi_real force_kd;             /* [1/s] */
    awiwi_real force_low;            /* limits of the tendon forces [N] */
    awiwi_real force_high;
    awiwi_real stop_margin;       /* where the soft end stops begin, before the limits [rad] */
    awiwi_real stop_stiffness;    /* [N m/rad] */
    awiwi_real residual;          /* length by which a tendon may disagree with the joint estimate [m] */
    awiwi_real continuous_torque; /* that a motor bears for ever [N m] */
    awiwi_real heating_time;      /* time constant of a motor's heat [s] */
    awiwi_real load_bandwidth;    /* of the observer of what acts on a joint besides its tendons [rad/s] */
    awiwi_real tunings[AWIWI_ALL_FINGERS][4]; /* K_3, K_4 [1/s], C_t [rad/(N m)], C_s [rad s^2/(N m)] of backstepping */
    int hold_ticks;               /* for which a fault is borne with the last torques */
    int slack_ticks;              /* for which a tendon may be slack */
    int ramp_ticks;               /* in which torques then fall to zero, and in which any change is faded in */
} awiwi_hand_gains;

/* -- what the tick keeps and tells --------------------------------------------------------------------------------- */

enum awiwi_mode {
    AWIWI_OFF,   /* not enabled, or not initialised: no torque */
    AWIWI_RUN,   /* the law runs */
    AWIWI_HOLD,  /* a fault: the last torques for hold_ticks, then RAMP; without the fault RUN again */
    AWIWI_RAMP,  /* torques fall to zero in ramp_ticks */
    AWIWI_FAULT  /* no torque until a reset */
};

/* Bits of a status: those of tendons, then those of fingers. The first row are faults, the others are told only. */
enum {
    AWIWI_READING_LOST = 1 << 0,  /* invalid or not a number */
    AWIWI_READING_RANGE = 1 << 1, /* beyond the ends of the sensor */
    AWIWI_ANGLE_LOST = 1 << 2,    /* the motor's angle is invalid, not a number, beyond its travel, or jumped */
    AWIWI_INCONSISTENT = 1 << 3,  /* the length disagrees with the others': a sensor is stuck, or a tendon broke */
    AWIWI_WRIST_LOST = 1 << 4,    /* wrist angles that the wrist cannot have */
    AWIWI_NO_ESTIMATE = 1 << 5,   /* the joint estimate failed */
    AWIWI_NO_LAW = 1 << 6,        /* the dynamics, the forces or the law have no result */
    AWIWI_BROKEN = 1 << 7,        /* a tendon has been slack for slack_ticks */
    AWIWI_FAULTS = (1 << 8) - 1,
    AWIWI_SATURATED = 1 << 8,     /* a motor's torque is at its limit */
    AWIWI_HOT = 1 << 9,           /* a motor's limit is lowered, so that it cools */
    AWIWI_FORCE_LIMIT = 1 << 10,  /* a measured force is outside the limits */
    AWIWI_UNREACHABLE = 1 << 11,  /* the limits of forces forbid the torque: it is the nearest */
    AWIWI_TORQUE_LIMIT = 1 << 12, /* a joint's torque is at its limit */
    AWIWI_STIFFER = 1 << 13,      /* tendons are softer than the stiffness asked for: a joint has theirs */
    AWIWI_END_STOP = 1 << 14,     /* a joint is in a soft end stop */
    AWIWI_REFERENCE = 1 << 15,    /* a demand is not a number, or beyond limits: the last, or the nearest, is used */
    AWIWI_TRAVEL = 1 << 16,       /* a motor is at an end of its travel, and is held back */
    AWIWI_SLACK = 1 << 17         /* a tendon is slack: its length is unknown */
};

/* All memory of a hand. Read it as telemetry; write it by awiwi_hand_init only. */
typedef struct awiwi_hand_state {
    awiwi_real offset[AWIWI_ALL_TENDONS]; /* of motor angles, to those of the straight finger */
    awiwi_real slack[AWIWI_ALL_TENDONS];  /* travel of the levers at their slack ends [m] */
    awiwi_real compliance;                /* of the tendons themselves [m/N]; 0 where they do not stretch */
    awiwi_real wrist[AWIWI_ALL_TENDONS];  /* lengths in the wrist, and those at the start [m] */
    awiwi_real wrist_start[AWIWI_ALL_TENDONS];
    awiwi_real reading[AWIWI_ALL_TENDONS]; /* the last good ones */
    awiwi_real theta[AWIWI_ALL_TENDONS];
    awiwi_real thd[AWIWI_ALL_TENDONS];
    awiwi_real x[AWIWI_ALL_TENDONS]; /* elongations */
    awiwi_real xd[AWIWI_ALL_TENDONS];
    awiwi_real lost[AWIWI_ALL_TENDONS];  /* ticks since a motor was last seen */
    awiwi_real f[AWIWI_ALL_TENDONS];     /* measured forces [N] */
    awiwi_real f_des[AWIWI_ALL_TENDONS]; /* wanted ones */
    awiwi_real q[AWIWI_ALL_JOINTS];      /* estimates */
    awiwi_real qd[AWIWI_ALL_JOINTS];
    awiwi_real demand[AWIWI_ALL_JOINTS];    /* the last good q_des */
    awiwi_real motion[AWIWI_ALL_JOINTS][5]; /* filtered references and their derivatives */
    awiwi_real filter[5][5];                /* what their errors become in a tick, */
    awiwi_real ahead[2];                    /* and how far the reference moves with its rate and acceleration */
    awiwi_real yield[AWIWI_ALL_JOINTS];     /* angle by which a joint yields to its load */
    awiwi_real tau[AWIWI_ALL_JOINTS];       /* wanted joint torques [N m] */
    awiwi_real load[AWIWI_ALL_JOINTS];      /* observed torques of all that acts on a joint besides its tendons */
    awiwi_real inertia[AWIWI_ALL_JOINTS];   /* of the joints, the others held, and their stiffness by the tendons, */
    awiwi_real elastic[AWIWI_ALL_JOINTS];
    awiwi_real feed[AWIWI_ALL_JOINTS];      /* what every finger planned at its last turn: torques fed forward, */
    awiwi_real planned_tau[AWIWI_ALL_JOINTS];
    awiwi_real planned_f[AWIWI_ALL_TENDONS]; /* forces, elongations, stiffnesses and their slopes, */
    awiwi_real planned_x[AWIWI_ALL_TENDONS];
    awiwi_real stiffness[AWIWI_ALL_TENDONS];
    awiwi_real slope[AWIWI_ALL_TENDONS];
    awiwi_real spread[AWIWI_ALL_TENDONS][AWIWI_MOST_JOINTS]; /* and forces per torque, which are angles per length */
    awiwi_real length[AWIWI_ALL_TENDONS];   /* of the tendons at the estimated joints [m] */
    awiwi_real friction[AWIWI_ALL_TENDONS]; /* of the motors, as compensated [N m] */
    awiwi_real heat[AWIWI_ALL_TENDONS];   /* 1 where a motor is as hot as it may be */
    awiwi_real jump[AWIWI_ALL_TENDONS];   /* torque that is still to be faded out after a change */
    awiwi_real wanted[AWIWI_ALL_TENDONS]; /* torques before they are faded and limited */
    awiwi_real torque[AWIWI_ALL_TENDONS]; /* of the motors, as returned [N m] */
    awiwi_real share[AWIWI_ALL_FINGERS];  /* of the torques that motors get, from 0 to 1 */
    awiwi_hand_gains gains;               /* of the last tick */
    unsigned plan_status[AWIWI_ALL_FINGERS];
    unsigned prepare_status[AWIWI_ALL_FINGERS];
    unsigned spread_status[AWIWI_ALL_FINGERS];
    unsigned tendon_status[AWIWI_ALL_TENDONS];
    unsigned finger_status[AWIWI_ALL_FINGERS]; /* with those of its tendons */
    unsigned status;                           /* with those of all fingers */
    int mode[AWIWI_ALL_FINGERS];               /* an awiwi_mode each */
    int slack_for[AWIWI_ALL_TENDONS];          /* ticks for which a tendon has been slack */
    int waited[AWIWI_ALL_FINGERS];             /* ticks of the present fault */
    int alive[AWIWI_ALL_FINGERS];              /* whether the law had a result in the last tick */
    int changed; /* ticks until all fingers have planned with the present law and gains */
    int law;
    int turn; /* the finger that plans anew */
    int ready;
    unsigned tick;
} awiwi_hand_state;

/* -- what firmware may log ----------------------------------------------------------------------------------------- */

enum { AWIWI_LOG_VERSION = 2 };

/* A log is this head, and then a record for each tick, as they are in memory. `awiwi-gen replay` runs it again. */
typedef struct awiwi_hand_log {
    char magic[8]; /* AWIWILOG */
    unsigned version;
    unsigned build_id; /* of the library that ran */
    unsigned real_size;
    unsigned record_size;
    awiwi_hand_gains gains; /* with which the hand was initialised, */
    awiwi_hand_input input; /* the sensors of then, */
    awiwi_real q[AWIWI_ALL_JOINTS]; /* and the pose */
} awiwi_hand_log;

typedef struct awiwi_hand_record {
    awiwi_hand_gains gains;
    awiwi_hand_input input;
    awiwi_real torque[AWIWI_ALL_TENDONS];
    unsigned status;
} awiwi_hand_record;

/* Fill in the head of a log, at the call of awiwi_hand_init and with its arguments. */
void awiwi_hand_log_begin(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                          const awiwi_real *q, awiwi_hand_log *log);

/* Fill in the record of the tick that just ended. */
void awiwi_hand_log_tick(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                         const awiwi_hand_state *state, awiwi_hand_record *record);

/* -- the tick ------------------------------------------------------------------------------------------------------ */

/* Stiffness and damping of every joint that suit the hand in the pose q [joints]: a quarter of what its tendons have at
   the lower limit of their forces, and critical damping. Returns an awiwi_status. */
int awiwi_hand_suggest(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_real *q,
                       awiwi_hand_input *input);

/* Begin with the hand at rest in a known pose q [joints], all tendons taut: finds the offsets of the motors. Returns
   the status: where it has a fault, nothing runs, and `tendon_status` names the sensors. */
unsigned awiwi_hand_init(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                         const awiwi_real *q, awiwi_hand_state *state);

/* One tick: motor torques [tendons] from sensors and demands. Returns the status. Torques are finite and within the
   motors' limits, whatever the inputs. */
unsigned awiwi_hand_step(const awiwi_hand *hand, const awiwi_hand_gains *gains, const awiwi_hand_input *input,
                         awiwi_hand_state *state, awiwi_real *torque);

#ifdef __cplusplus
}
#endif

#endif
