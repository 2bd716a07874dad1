/* Faults and limits of the small hand: sensors, slack tendons, modes, hot motors, and kernels that refuse. */
#include "problems_stub.h"

#include <math.h>
#include <string.h>

static void faults(const scene *start)
{
    static const double odd[] = {NAN, INFINITY, 80, 84.5, 95, 101, 103, 930, 1000};
    for (int i = 0; i < 24; i++) {
        const int k = i % HAND_TENDONS, ticks = 1 + i % 7;
        now = *start;
        for (int tick = 0; tick < ticks; tick++) {
            sense();
            if (i % 4 == 0)
                now.input.reading_valid[k] = 0;
            if (i % 4 == 1)
                now.input.theta_valid[k] = 0;
            if (i % 4 == 2)
                now.input.reading[k] = odd[i / 4 + 3 * (i > 12)];
            if (i % 4 == 3)
                now.input.theta[k] = i < 8    ? NAN
                                     : i < 12 ? 2.6
                                     : i < 16 ? -2.6
                                              : now.input.theta[k] + 0.05 + 0.1 * (tick % 4);
            step("fault");
        }
        run("after", 14);
        now.input.enable = i % 3 != 0;
        now.input.reset = i % 2;
        run("reset", 4);
        now.input.enable = 1;
        run("again", 3);
    }
}

/* Readings of one sensor near its ends, in fine steps. */
static void sensors(const scene *start)
{
    static const double shares[] = {-0.021, -0.02, -0.019, -0.001, 0, 0.0019, 0.002, 0.0021, 0.01,
                                    0.99, 1, 1.001, 1.019, 1.02, 1.021};
    for (int i = 0; i < (int)(2 * sizeof shares / sizeof *shares); i++) {
        const int k = i % 2 ? 0 : 1 + i % 5;
        const double slack = now.plant->hand->sensor_slack[k], taut = now.plant->hand->sensor_taut[k];
        now = *start;
        sense();
        now.input.reading[k] = slack + shares[i / 2] * (taut - slack);
        step("share");
        now.input.reset = 1;
        step("share at reset");
    }
    now = *start;
    now.input.reading[0] = 2; /* where each limit is, exactly */
    step("at loose");
    now.input.reset = 1;
    step("at loose and reset");
    now.input.reading[0] = -20;
    step("at low");
    now.input.reading[0] = 1020;
    step("at high");
    now.state.theta[1] = 0;
    now.input.theta[1] = 0.08;
    step("at fastest");
}

void try_slack(const scene *start)
{
    for (int ticks = 3; ticks < 9; ticks++) {
        now = *start;
        for (int tick = 0; tick < ticks; tick++) {
            sense();
            now.input.reading[ticks % HAND_TENDONS] = now.plant->hand->sensor_slack[ticks % HAND_TENDONS];
            now.input.reset = ticks == 8 && tick == 5;
            step("slack");
        }
        run("taut", 12);
        now.gains.slack_ticks = 0;
        run("at once", 5);
    }
}

/* Faults while a finger is off, ramps or is in a fault; fades to and fro. */
static void modes(const scene *start)
{
    for (int i = 0; i < 40; i++) {
        now = *start;
        now.gains.hold_ticks = i % 4 * 3;
        now.gains.ramp_ticks = 1 + i * 2 % 9;
        for (int tick = 0; tick < 24; tick++) {
            sense();
            now.input.enable = !(i >> 1 & tick >> 2 & 1);
            now.input.reset = i > 20 && tick % 5 == 4;
            now.input.reading_valid[1] = !(i % 8 && tick % (4 + i % 8) < i % 8 - 1);
            now.input.theta_valid[5] = !(i % 5 == 4 && tick % 11 < 6);
            step("mode");
        }
    }
}

static void heat(const scene *start)
{
    static const double lasting[] = {0.002, 0.008, 0.02, 0.2, 0.3, 1e-200};
    for (int i = 0; i < 6; i++) {
        now = *start;
        now.gains.continuous_torque = lasting[i];
        now.gains.heating_time = 0.02;
        run("heat", 12);
        now.input.torque[0] = 0.05;
        now.input.enable = 0;
        run("cool", 10);
        now.gains.continuous_torque = 0.3;
        run("strong", 3);
    }
}

static void travel(const scene *start)
{
    for (int i = 0; i < 4; i++) {
        now = *start;
        const double shift = (i % 2 ? 1 : -1) * 2.46 - now.state.theta[i]; /* of the motor's zero */
        now.state.theta[i] += shift;
        now.state.offset[i] -= shift;
        for (int tick = 0; tick < 12; tick++) {
            sense();
            now.input.theta[i] += shift;
            step("travel");
        }
    }
}

/* Every kernel refuses, or has a result that is no number, at each of its calls. */
static void refusals(const scene *start)
{
    for (int kernel = 0; kernel < HAND_KERNELS; kernel++)
        for (int i = 0; i < 10; i++) {
            now = *start;
            sense();
            if ((i + 1) & 2 || i == 9)
                now.input.reading[3] = now.plant->hand->sensor_slack[3];
            refuse_call(kernel, i < 7 ? i : 0, i == 7 ? AWIWI_NOT_CONVERGED : i == 8 ? AWIWI_OK : AWIWI_OUT_OF_DOMAIN);
            step("refusal");
            run("refusal", 1);
            refuse_nothing();
            run("then", 2);
        }
}

static void singular(const scene *start)
{
    now = *start;
    refuse_call(JOINT_ESTIMATE, 100, 0);
    now.state.q[2] = 0.7;
    now.state.motion[0][0] = 0.7;
    run("singular", 5);
    refuse_nothing();
}

void try_protection(const scene *start)
{
    faults(start);
    sensors(start);
    try_slack(start);
    modes(start);
    heat(start);
    travel(start);
    refusals(start);
    singular(start);
}
