/* Ticks of a small hand by a script: every law, mode, fault and limit, and its simulation. */
#include "problems_stub.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

enum { START = 40 };

scene now;

static const awiwi_hand_gains ordinary = {
    .period = 0.001, .delay = 0.01, .velocity_bandwidth = 300, .compliance_bandwidth = 20, .motor_kp = 0.6,
    .motor_kd = 0.008, .friction_share = 0.8, .force_kp = 10000, .force_kd = 250, .force_low = 0.5, .force_high = 8,
    .stop_margin = 0.05, .stop_stiffness = 0.3, .residual = 0.0015, .continuous_torque = 0.05, .heating_time = 0.05,
    .load_bandwidth = 200,
    .tunings = {{60, 50, 100, 1}, {50, 60, 80, 2}, {70, 40, 90, 1}, {60, 60, 100, 3}, {50, 50, 70, 2}},
    .hold_ticks = 3, .slack_ticks = 4, .ramp_ticks = 6,
};

/* -- one tick ------------------------------------------------------------------------------------------------------ */

static void show_numbers(const char *name, unsigned status, const void *structure, size_t size)
{
    print(name, (int)status, copy_of(structure, (int)(size / sizeof(double))), (int)(size / sizeof(double)));
    release();
}

static void show_counts(const awiwi_hand_state *state)
{
    const char *first = (const char *)state->plan_status, *last = (const char *)(&state->tick + 1);
    double counts[256];
    int n = 0;
    for (; first < last; first += sizeof(int)) {
        int count;
        memcpy(&count, first, sizeof count);
        counts[n++] = count;
    }
    print("counts", state->mode[0] * 10 + state->mode[1], counts, n);
}

static void show(const char *name, unsigned status)
{
    show_numbers(name, status, &now.state, offsetof(awiwi_hand_state, gains));
    show_numbers("gains", 0, &now.state.gains, offsetof(awiwi_hand_gains, hold_ticks));
    show_counts(&now.state);
}

void sense(void)
{
    awiwi_hand_measure(now.plant, &now.world, &now.input);
}

void step(const char *name)
{
    const int tendons = now.plant->hand->tendons;
    double *torque = output(tendons);
    const unsigned status = awiwi_hand_step(now.plant->hand, &now.gains, &now.input, &now.state, torque);
    const int moved = awiwi_hand_move(now.plant, torque, &now.world);
    print("torque", 0, torque, tendons);
    show(name, status);
    print("world", moved, now.world.q, (int)((sizeof now.world - offsetof(awiwi_hand_world, q)) / sizeof(double)));
}

void run(const char *name, int ticks)
{
    for (int i = 0; i < ticks; i++) {
        sense();
        step(name);
    }
}

/* -- the start ----------------------------------------------------------------------------------------------------- */

static const double pose[AWIWI_ALL_JOINTS] = {0.1, -0.2, 0.3, 0.2, -0.1, 0.15, -0.25, 0.1};

static void place(const awiwi_hand_plant *plant, int law)
{
    static const double theta[AWIWI_ALL_TENDONS] = {0.1, -0.1, 0.2, 0.05, -0.3, 0.15};
    const int joints = plant->hand->joints;
    memset(&now, 0, sizeof now);
    now.plant = plant;
    now.gains = ordinary;
    now.world = (awiwi_hand_world){.period = 0.001, .substeps = 3, .friction = 1.5, .reading_noise = 0.4,
                                   .theta_step = 1e-4, .seed = 5, .gravity = {1, -3, 9}, .wrist = {0.2, -0.1}};
    for (int j = 0; j < joints; j++)
        now.world.damping[j] = 0.004;
    for (int k = 0; k < plant->hand->tendons; k++)
        now.world.spring[k] = 1 + 0.01 * k;
    print("place", awiwi_hand_place(plant, pose, theta, 3, &now.world), now.world.q, joints);
    print("suggest", awiwi_hand_suggest(plant->hand, &now.gains, pose, &now.input), now.input.stiffness, joints);
    print("damping", 0, now.input.damping, joints);
    sense();
    for (int j = 0; j < joints; j++)
        now.input.q_des[j] = pose[j];
    now.input.law = law;
    now.input.enable = 1;
}

static void init(const char *name)
{
    show(name, awiwi_hand_init(now.plant->hand, &now.gains, &now.input, pose, &now.state));
}

/* Where every scenario begins: a hand that runs and moves. */
static scene moving(const awiwi_hand_plant *plant, int law)
{
    place(plant, law);
    init("init");
    run("start", START);
    for (int j = 0; j < plant->hand->joints; j++) {
        now.input.q_des[j] += 0.1 * (j % 3 + 1) - 0.15;
        now.input.qd_des[j] = 0.3;
        now.input.qdd_des[j] = 2 - j % 3;
        now.input.torque[j] = 0.002 * (j % 3 + 1);
    }
    run("move", START / 2);
    return now;
}

/* -- scenarios; each begins with a scene and may leave anything behind --------------------------------------------- */

static void demands(const scene *start)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, 5, -5};
    for (int i = 0; i < 5; i++) {
        now = *start;
        now.input.q_des[i % HAND_JOINTS] = odd[i];
        run("odd angle", 3);
        now.input.qd_des[1] = now.input.damping[2] = now.input.tip_damping[0] = odd[i];
        run("odd rate", 2);
        now.input.qdd_des[2] = now.input.torque[0] = odd[i];
        run("odd torque", 4);
        now.input.stiffness[i % HAND_JOINTS] = odd[i];
        run("odd stiffness", 4);
        now.input.tip_stiffness[0] = i ? 3 : NAN;
        now.input.tip[0][i % 3] = odd[i];
        run("odd tip", 4);
    }
}

static void tips(const scene *start)
{
    now = *start;
    now.input.tip_stiffness[0] = 20;
    now.input.tip_stiffness[1] = 30;
    now.input.tip_damping[0] = 0.5;
    now.input.tip_damping[1] = 0.7;
    now.input.tip[0][0] = now.input.tip[1][2] = 0.01;
    run("tip", 6);
    now.input.tip_stiffness[0] = 0.5;
    now.input.tip_stiffness[1] = -1;
    run("no tip", 3);
    refuse_call(TIP, 0, AWIWI_OUT_OF_DOMAIN);
    run("refused tip", 3);
    refuse_nothing();
}

/* Joints in their soft and hard ends, and joint torques beyond their limits. */
static void ends(const scene *start)
{
    for (int side = -1; side <= 1; side += 2) {
        now = *start;
        for (int j = 0; j < HAND_JOINTS; j++)
            now.world.load[j] = side * 0.3;
        run("end", 20);
        now.gains.stop_margin = 0.7;
        run("stop", 10);
        now.gains.stop_margin = 0.75; /* the ends of the last joint are one */
        run("one stop", 3);
        now.gains.stop_margin = 2; /* low and high ends change places */
        run("no stop", 8);
        now.input.torque[1] = side;
        run("torque", 12);
    }
}

static void changes(const scene *start)
{
    now = *start;
    for (int i = 0; i < 9; i++) {
        now.input.law = i % 4 == 3 ? i - 4 : i % 4; /* -1 and 3 are no laws */
        run("law", 2 + i);
        now.gains.motor_kd *= 0.9;
        now.gains.force_kd *= 0.9;
        run("gain", 3);
    }
    for (int i = 0; i < 4; i++) {
        now.gains.motor_kp = 0.6 + 0.1 * i;
        run("gain in every tick", 1);
    }
    for (int i = 0; i < 19 * 6 + 6; i++) {
        static const double odd[] = {0, -1, 0.5, NAN, INFINITY, AWIWI_REAL_MAX};
        now = *start;
        double *number = i / 6 < 18 ? &now.gains.period + i / 6 : &now.gains.tunings[AWIWI_ALL_FINGERS - 1][3];
        int *count = &now.gains.hold_ticks + (i - 114) / 2;
        if (i < 114)
            *number = odd[i % 6];
        else
            *count = i % 2 - 1;
        run("odd gain", 2);
        now.gains = ordinary;
        run("good gain", 2);
    }
    now.gains.period *= 1.01;
    run("period", 3);
    now = *start;
    now.gains.motor_kp = now.gains.force_kp = 1e308;
    run("huge gain", 4);
    now.gains.ramp_ticks = 1;
    now.input.enable = 0;
    run("and no share", 4);
    now = *start;
    now.gains.force_high = now.gains.force_low;
    run("no forces", 2);
    now.gains.heating_time = now.gains.period;
    now.gains.force_high = 3;
    run("few forces", 10);
    init("again");
}

static void reaches(const scene *start)
{
    now = *start;
    for (int j = 0; j < HAND_JOINTS; j++)
        now.input.stiffness[j] *= 5;
    run("stiffer", 8);
    now.gains.force_high = 2.9;
    run("unreachable", 10);
    now.world.wrist[0] = 0.4;
    run("wrist", 3);
    now.world.wrist[0] = 1.5;
    run("no wrist", 3);
    now.world.wrist[0] = 0.4;
    run("wrist again", 5);
}

/* Lines that break, forces beyond both ends of levers, motors at both ends of their travel. */
static void simulation(const scene *start)
{
    static const double pulls[] = {0.2, -0.2, 0.05, -0.02};
    for (int i = 0; i < 8; i++) {
        now = *start;
        now.world.substeps = 1 + i % 3;
        now.world.reading_noise = i % 2 ? 30 : 0;
        now.world.theta_step = i % 3 ? 0 : 0.01;
        now.world.spring[i % HAND_TENDONS] = i % 4 ? 1 : 0;
        now.world.added_inertia = i % 2 ? 0.5 : 0;
        for (int tick = 0; tick < 30; tick++) {
            double torque[HAND_TENDONS];
            for (int k = 0; k < HAND_TENDONS; k++)
                torque[k] = pulls[(i + (k == i % 6)) % 4];
            print("pulled", awiwi_hand_move(now.plant, torque, &now.world), now.world.q,
                  (int)((sizeof now.world - offsetof(awiwi_hand_world, q)) / sizeof(double)));
            now.input.reading_valid[2] = now.input.theta_valid[3] = 0;
            sense();
            print("seen", now.input.reading_valid[2] * 2 + now.input.theta_valid[3], now.input.reading, HAND_TENDONS);
            show_numbers("sensed", 0, now.input.theta, 5 * sizeof(double) + HAND_TENDONS * sizeof(double));
            show_numbers("wrist", 0, now.input.wrist, 5 * sizeof(double));
        }
        run("found", 3);
    }
}

static void refusing_simulation(const scene *start)
{
    for (int kernel = 0; kernel < HAND_KERNELS; kernel++)
        for (int i = 0; i < 4; i++) {
            now = *start;
            double torque[HAND_TENDONS] = {0};
            refuse_call(kernel, i, AWIWI_OUT_OF_DOMAIN);
            print("refused", awiwi_hand_move(now.plant, torque, &now.world), now.world.q, HAND_JOINTS);
            refuse_call(kernel, i, AWIWI_OUT_OF_DOMAIN);
            print("refused", awiwi_hand_place(now.plant, pose, now.world.theta, 1, &now.world), now.world.q,
                  HAND_JOINTS);
            refuse_call(kernel, i, AWIWI_OUT_OF_DOMAIN);
            print("refused", awiwi_hand_suggest(now.plant->hand, &now.gains, pose, &now.input), now.input.damping,
                  HAND_JOINTS);
            refuse_nothing();
        }
}

/* Beginnings that fail, and ticks after them. */
static void beginnings(const awiwi_hand_plant *plant)
{
    for (int i = 0; i < 8 + 3 * HAND_KERNELS; i++) {
        place(plant, i % AWIWI_LAWS);
        if (i == 0)
            now.gains.ramp_ticks = 0;
        if (i == 1)
            now.input.reading_valid[5] = 0;
        if (i == 2)
            now.input.reading[1] = plant->hand->sensor_slack[1] - 4;
        if (i == 3)
            now.input.theta[4] = -2.6;
        if (i == 4)
            now.input.wrist[0] = 1;
        if (i == 5)
            now.input.law = 9;
        if (i == 6)
            now.gains.force_low = 4.5;
        if (i == 7)
            now.input.reading[3] = plant->hand->sensor_slack[3];
        if (i >= 8)
            refuse_call((i - 8) / 3, (i - 8) % 3, AWIWI_OUT_OF_DOMAIN);
        init("beginning");
        refuse_nothing();
        run("and then", 2);
    }
    place(plant, 0);
    double nowhere[HAND_JOINTS] = {0, 0, NAN};
    show("nowhere", awiwi_hand_init(plant->hand, &now.gains, &now.input, nowhere, &now.state));
}

static void logs(const scene *start)
{
    static awiwi_hand_log head;
    static awiwi_hand_record record;
    now = *start;
    memset(&head, 1, sizeof head);
    memset(&record, 1, sizeof record);
    awiwi_hand_log_begin(now.plant->hand, &now.gains, &now.input, pose, &head);
    awiwi_hand_log_tick(now.plant->hand, &now.gains, &now.input, &now.state, &record);
    const double numbers[] = {head.magic[0], head.magic[7], head.version, head.build_id, head.real_size,
                              head.record_size == sizeof record, head.input.law, record.input.enable,
                              head.gains.ramp_ticks, record.gains.hold_ticks};
    print("log", (int)record.status, numbers, 10);
    print("log pose", 0, head.q, AWIWI_ALL_JOINTS);
    print("log torque", 0, record.torque, AWIWI_ALL_TENDONS);
    show_numbers("log input", 0, head.input.reading, offsetof(awiwi_hand_input, reading_valid));
    show_numbers("log input", 0, record.input.reading, offsetof(awiwi_hand_input, reading_valid));
    show_numbers("log gains", 0, &head.gains.period, offsetof(awiwi_hand_gains, hold_ticks));
    show_numbers("log gains", 0, &record.gains.period, offsetof(awiwi_hand_gains, hold_ticks));
}

/* All scenarios with all kernels, and some of them with fewer kernels and with a larger finger. */
void try_hand(void)
{
    static void (*const scenarios[])(const scene *) = {
        demands, tips, ends, changes, reaches, try_protection, simulation, refusing_simulation, logs};
    static scene start;
    for (int law = 0; law < AWIWI_LAWS; law++) {
        start = moving(&stub_plant, law);
        for (size_t i = 0; i < sizeof scenarios / sizeof *scenarios; i++)
            scenarios[i](&start);
        start = moving(&plain_plant, law);
        reaches(&start);
        simulation(&start);
        start = moving(&whole_plant, law);
        tips(&start);
        ends(&start);
        try_slack(&start);
    }
    beginnings(&stub_plant);
}
