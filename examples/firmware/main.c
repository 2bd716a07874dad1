/* The index finger at 3 kHz: joint angles from tendon lengths, gravity and a joint stiffness, tendon forces that give both.
   The tick counts its own overruns. Build and run with `make run`; needs the kernels of `--only 'index_*'`. */
#include "awiwi.h"
#include "board.h"

#ifndef LOAD
#define LOAD 1 /* how often the tick does its work */
#endif

enum { RATE_HZ = 3000, TICKS = 60, JOINTS = 4, TENDONS = 8, PERIOD = BOARD_CLOCK_HZ / RATE_HZ };

static volatile int ticks, overruns, refusals;
static volatile uint32_t longest; /* periods of the timer's clock that a tick took */
static awiwi_real angles[JOINTS]; /* the last estimate is where the next one starts */
static awiwi_real forces[TENDONS];

/* What encoders would say: the lengths of the tendons in a slow motion. */
static void measure(int tick_number, awiwi_real lengths[TENDONS])
{
    awiwi_real q[JOINTS];
    for (int i = 0; i < JOINTS; i++)
        q[i] = (awiwi_real)0.002 * (awiwi_real)(tick_number + i);
    awiwi_index_tendon_lengths(q, lengths);
}

static void control(int tick_number)
{
    static const awiwi_real down[3] = {0, 0, (awiwi_real)-9.81};
    static const awiwi_real lowest[1] = {15}, highest[1] = {90};
    static const awiwi_real stiffness[JOINTS * JOINTS] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    awiwi_real lengths[TENDONS], start[JOINTS], torque[JOINTS];
    int status;

    measure(tick_number, lengths);
    for (int i = 0; i < JOINTS; i++)
        start[i] = angles[i]; /* inputs and outputs must not overlap */
    awiwi_index_joint_estimate(lengths, start, angles);
    awiwi_index_gravity(angles, down, torque);
    status = awiwi_index_tendon_distribution(angles, torque, stiffness, lowest, highest, forces);
    if (status != AWIWI_OK)
        refusals++; /* forces are within their limits all the same */
}

void tick(void)
{
    if (ticks == TICKS)
        return;
    for (int i = 0; i < LOAD; i++)
        control(ticks);
    if (INTERRUPT_STATE & SYSTICK_PENDING) { /* the next period has begun: this one was too short */
        overruns++;
    } else {
        const uint32_t spent = PERIOD - 1 - SYSTICK_VALUE;
        longest = spent > longest ? spent : longest;
    }
    ticks++;
}

static void print_number(const char *before, uint32_t value, const char *after)
{
    char text[11], *digit = text + sizeof text - 1;
    *digit = 0;
    do
        *--digit = (char)('0' + value % 10);
    while (value /= 10);
    board_print(before);
    board_print(digit);
    board_print(after);
}

int main(void)
{
    board_start_timer(PERIOD, 1);
    while (ticks < TICKS) {
        /* a real program sleeps here */
    }
    print_number("", (uint32_t)ticks, " ticks, ");
    print_number("", (uint32_t)refusals, " refused, ");
    print_number("", (uint32_t)overruns, " overruns");
    print_number(", longest ", 100 * longest / PERIOD, " % of its period\n");
    if (overruns)
        board_print("overloaded: the tick does not end within its period\n");
    return overruns ? 1 : 0;
}
