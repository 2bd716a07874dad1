/* The simulated hand: fingers on tendons over lever springs, motors with friction, sensors. */
#include "numerics.h"
#include "dense.h"
#include "noise.h"
#include "awiwi_hand_plant.h"

enum { ALL = AWIWI_ALL_TENDONS, JOINTS = AWIWI_MOST_JOINTS };
enum { ROUNDS = 20 }; /* of Newton's method, from the middle of a lever */

static const awiwi_real STIFF_JOINT = (awiwi_real)10;   /* of the joints' hard ends [N m/rad] */
static const awiwi_real STIFF_LINE = (awiwi_real)60000; /* of a line without stretch, behind a spring's end [N/m] */
static const awiwi_real BESIDE = (awiwi_real)1 / 4096;  /* of a sensor's span: where slopes are taken */

/* Force and elongation of every tendon at these readings; springs pull as the world says. */
static int at_levers(const awiwi_hand_plant *plant, const awiwi_hand_world *world, const awiwi_real *lever,
                     awiwi_real *force, awiwi_real *elongation)
{
    const int status = plant->hand->sensors(lever, elongation, force);
    for (int k = 0; k < plant->hand->tendons; k++) {
        awiwi_real stretch = 0;
        force[k] *= world->spring[k];
        if (plant->hand->tendon_stretch)
            (void)plant->hand->tendon_stretch(force + k, &stretch);
        elongation[k] = world->slack[k] - elongation[k] + stretch;
    }
    return status;
}

/* Forces of tendons with these elongations, by a step of Newton's from the levers' last readings. Behind the ends of
   its lever a tendon is a fibre. */
static int pull(const awiwi_hand_plant *plant, awiwi_hand_world *world, const awiwi_real *elongation)
{
    const awiwi_hand *hand = plant->hand;
    awiwi_real beside[ALL], force[ALL], x[ALL], force_beside[ALL], x_beside[ALL];
    for (int k = 0; k < hand->tendons; k++) {
        const awiwi_real span = hand->sensor_taut[k] - hand->sensor_slack[k];
        const awiwi_real share = (world->lever[k] - hand->sensor_slack[k]) / span;
        beside[k] = world->lever[k] + (share < (awiwi_real)0.5 ? BESIDE : -BESIDE) * span;
    }
    if (at_levers(plant, world, world->lever, force, x) || at_levers(plant, world, beside, force_beside, x_beside))
        return AWIWI_OUT_OF_DOMAIN;
    for (int k = 0; k < hand->tendons; k++) {
        const awiwi_real slack = hand->sensor_slack[k], taut = hand->sensor_taut[k], one = 1;
        const awiwi_real counts = (beside[k] - world->lever[k]) / (x_beside[k] - x[k]); /* per elongation */
        const awiwi_real slope = (force_beside[k] - force[k]) / (x_beside[k] - x[k]);
        const awiwi_real wanted = world->lever[k] + counts * (elongation[k] - x[k]);
        const awiwi_real lever = awiwi_clamp(wanted, slack < taut ? slack : taut, slack < taut ? taut : slack);
        const awiwi_real moved = (lever - world->lever[k]) / counts;
        awiwi_real yields, line = STIFF_LINE;
        if (hand->tendon_stretch && hand->tendon_stretch(&one, &yields) == AWIWI_OK)
            line = one / yields;
        world->lever[k] = lever;
        world->f[k] = force[k] + slope * moved + line * (elongation[k] - x[k] - moved);
        if (world->spring[k] <= 0)
            world->lever[k] = slack;
        if (world->spring[k] <= 0 || world->f[k] < 0)
            world->f[k] = 0;
    }
    return AWIWI_OK;
}

/* Path lengths of all tendons, in fingers and wrist, and what motors have wound up. */
static int paths(const awiwi_hand_plant *plant, const awiwi_hand_world *world, awiwi_real *path)
{
    const awiwi_hand *hand = plant->hand;
    awiwi_real in_finger[ALL] = {0}, in_wrist[ALL] = {0};
    int status = AWIWI_OK;
    for (int i = 0; i < hand->fingers; i++) {
        const awiwi_finger *finger = hand->finger + i;
        status |= finger->tendon_lengths(world->q + finger->first_joint, in_finger + finger->first_tendon);
    }
    if (hand->wrist_lengths)
        status |= hand->wrist_lengths(world->wrist, in_wrist);
    for (int k = 0; k < hand->tendons; k++)
        path[k] = in_finger[k] + (hand->motor_pulley * world->theta[k] + in_wrist[k]);
    return status ? AWIWI_OUT_OF_DOMAIN : AWIWI_OK;
}

static awiwi_real hard_end(const awiwi_hand *hand, int j, awiwi_real q)
{
    return STIFF_JOINT * (awiwi_clamp(q, hand->joint_low[j], hand->joint_high[j]) - q);
}

static int move_finger(const awiwi_hand_plant *plant, int index, awiwi_real h, awiwi_hand_world *world)
{
    const awiwi_finger *finger = plant->hand->finger + index;
    const int first = finger->first_joint;
    const awiwi_real share = 1 / (1 + world->added_inertia); /* of torque and weight, for links with their own inertia */
    awiwi_real tau[JOINTS], qdd[JOINTS], g[3];
    for (int i = 0; i < 3; i++) {
        const awiwi_real axis[3] = {finger->base[i], finger->base[3 + i], finger->base[6 + i]};
        g[i] = share * awiwi_dot(axis, world->gravity, 3);
    }
    int status = finger->joint_torque(world->q + first, world->f + finger->first_tendon, tau);
    for (int i = 0, j = first; i < finger->joints; i++, j++)
        tau[i] = share * (tau[i] + (world->load[j] + hard_end(plant->hand, j, world->q[j])
                                    - world->damping[j] * world->qd[j]));
    status |= plant->forward_dynamics[index](world->q + first, world->qd + first, tau, g, qdd);
    for (int i = 0, j = first; i < finger->joints; i++, j++) {
        world->qd[j] += h * qdd[i];
        world->q[j] += h * world->qd[j];
    }
    return status;
}

static int move_motor(const awiwi_hand_plant *plant, int k, awiwi_real h, awiwi_hand_world *world)
{
    awiwi_real friction, acceleration;
    int status = plant->motor_friction(world->thd + k, &friction);
    const awiwi_real torque = world->torque[k] + (1 - world->friction) * friction;
    status |= plant->motor_acceleration(world->theta + k, world->thd + k, &torque, world->f + k, &acceleration);
    world->thd[k] += h * acceleration;
    world->theta[k] += h * world->thd[k];
    if (awiwi_size(world->theta[k]) > plant->hand->motor_travel) {
        world->theta[k] = awiwi_clamp(world->theta[k], -plant->hand->motor_travel, plant->hand->motor_travel);
        world->thd[k] = 0;
    }
    return status;
}

/* One step of the semi-implicit Euler method. */
static int advance(const awiwi_hand_plant *plant, awiwi_real h, awiwi_hand_world *world)
{
    awiwi_real path[ALL];
    int status = paths(plant, world, path);
    for (int k = 0; k < plant->hand->tendons; k++)
        path[k] += world->begin[k];
    status |= pull(plant, world, path);
    for (int k = 0; k < plant->hand->tendons; k++)
        status |= move_motor(plant, k, h, world);
    for (int i = 0; i < plant->hand->fingers; i++)
        status |= move_finger(plant, i, h, world);
    return status;
}

int awiwi_hand_place(const awiwi_hand_plant *plant, const awiwi_real *q, const awiwi_real *theta, awiwi_real force,
                     awiwi_hand_world *world)
{
    const awiwi_hand *hand = plant->hand;
    awiwi_real path[ALL], elongation[ALL], ignored[ALL], x, stretch = 0;
    int status = hand->sensors(hand->sensor_slack, world->slack, ignored);
    status |= hand->spring_elongation(&force, &x);
    if (hand->tendon_stretch)
        status |= hand->tendon_stretch(&force, &stretch);
    for (int j = 0; j < hand->joints; j++) {
        world->q[j] = q[j];
        world->qd[j] = 0;
    }
    for (int k = 0; k < hand->tendons; k++) {
        world->theta[k] = theta[k];
        world->thd[k] = 0;
        world->torque[k] = hand->motor_pulley * force;
        world->lever[k] = (hand->sensor_slack[k] + hand->sensor_taut[k]) / 2;
        elongation[k] = x + stretch;
    }
    for (int round = 0; round < ROUNDS; round++)
        status |= pull(plant, world, elongation);
    status |= paths(plant, world, path);
    for (int k = 0; k < hand->tendons; k++)
        world->begin[k] = elongation[k] - path[k];
    return status ? AWIWI_OUT_OF_DOMAIN : AWIWI_OK;
}

void awiwi_hand_measure(const awiwi_hand_plant *plant, const awiwi_hand_world *world, awiwi_hand_input *input)
{
    for (int k = 0; k < plant->hand->tendons; k++) {
        const awiwi_real noise = world->reading_noise * awiwi_normal(world->seed, world->tick, (uint32_t)k);
        input->reading[k] = awiwi_rounded(world->lever[k] + noise, 1);
        input->theta[k] = world->theta_step > 0 ? awiwi_rounded(world->theta[k], world->theta_step) : world->theta[k];
        input->reading_valid[k] = input->theta_valid[k] = 1;
    }
    for (int i = 0; i < 3; i++)
        input->gravity[i] = world->gravity[i];
    for (int i = 0; i < 2; i++)
        input->wrist[i] = world->wrist[i];
}

int awiwi_hand_move(const awiwi_hand_plant *plant, const awiwi_real *torque, awiwi_hand_world *world)
{
    int status = AWIWI_OK;
    for (int i = 0; i < world->substeps; i++)
        status |= advance(plant, world->period / (awiwi_real)world->substeps, world);
    for (int k = 0; k < plant->hand->tendons; k++)
        world->torque[k] = torque[k];
    world->tick++;
    return status ? AWIWI_OUT_OF_DOMAIN : AWIWI_OK;
}
