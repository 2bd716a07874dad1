/* A control law on a clock, and a plant in continuous time: loops of kernels, simulated. */
#include "numerics.h"
#include "noise.h"
#include "awiwi_simulate.h"

#include <string.h>

static int finite(awiwi_real x)
{
    return x >= -AWIWI_REAL_MAX && x <= AWIWI_REAL_MAX;
}

static int all_finite(const awiwi_real *x, int n)
{
    awiwi_real sum = 0; /* of zeros; infinity and NaN times zero are NaN */
    for (int i = 0; i < n; i++)
        sum += x[i] * 0;
    return sum >= 0;
}

/* Output i is the sum of in[i] * in[n + i], in[2 n + i] * in[3 n + i] and so on, for n outputs. */
static int sum_of_products(const awiwi_block *block, const awiwi_real *in, awiwi_real *out)
{
    const int n = block->outputs;
    for (int i = 0; i < n; i++) {
        out[i] = 0;
        for (int j = i; j + n < block->inputs; j += 2 * n)
            out[i] += in[j] * in[j + n];
    }
    return AWIWI_OK;
}

/* Run a block on its signals; `out` receives its outputs. */
static int call(const awiwi_block *block, const awiwi_real *signals, awiwi_real *out)
{
    awiwi_real in[AWIWI_MOST_ARGUMENTS];
    for (int i = 0; i < block->inputs; i++)
        in[i] = signals[block->from[i]];
    return block->kernel ? block->kernel(in, out) : sum_of_products(block, in, out);
}

static void put(const awiwi_block *block, const awiwi_real *out, awiwi_real *signals)
{
    for (int i = 0; i < block->outputs; i++)
        signals[block->to[i]] = out[i];
}

int awiwi_rates(const awiwi_loop *loop, awiwi_real *signals)
{
    awiwi_real out[AWIWI_MOST_ARGUMENTS];
    for (int i = 0; i < loop->plant_blocks; i++) {
        const int status = call(loop->plant + i, signals, out);
        if (status)
            return AWIWI_OUT_OF_DOMAIN;
        put(loop->plant + i, out, signals);
    }
    return AWIWI_OK;
}

/* One step of Runge and Kutta's method of fourth order. */
static int advance(const awiwi_loop *loop, awiwi_real h, awiwi_real *signals)
{
    static const int reach[4] = {0, 1, 1, 2}, share[4] = {1, 2, 2, 1}; /* in halves, in sixths */
    const int n = loop->states;
    awiwi_real start[AWIWI_MOST_RATES], sum[AWIWI_MOST_RATES];
    awiwi_real *x = signals;
    const awiwi_real *rate = signals + n;
    for (int i = 0; i < n; i++) {
        start[i] = x[i];
        sum[i] = 0;
    }
    for (int stage = 0; stage < 4; stage++) {
        const awiwi_real ahead = h * (awiwi_real)reach[stage] / 2, weight = (awiwi_real)share[stage];
        for (int i = 0; stage && i < n; i++)
            x[i] = start[i] + ahead * rate[i];
        const int status = awiwi_rates(loop, signals);
        if (status)
            return status;
        for (int i = 0; i < n; i++)
            sum[i] += weight * rate[i];
    }
    for (int i = 0; i < n; i++)
        x[i] = start[i] + h / 6 * sum[i];
    return AWIWI_OK;
}

static void sense(const awiwi_loop *loop, unsigned tick, awiwi_real *signals)
{
    for (int i = 0; i < loop->sensors; i++) {
        const awiwi_sensor *sensor = loop->sensor + i;
        awiwi_real x = signals[sensor->from];
        if (sensor->noise > 0)
            x += sensor->noise * awiwi_normal((uint32_t)loop->seed, (uint32_t)tick, (uint32_t)i);
        signals[sensor->to] = sensor->step > 0 ? awiwi_rounded(x, sensor->step) : x;
    }
}

static void act(const awiwi_loop *loop, int late, awiwi_real *signals)
{
    for (int i = 0; i < loop->actuators; i++) {
        const awiwi_actuator *actuator = loop->actuator + i;
        const awiwi_real u = signals[actuator->from], limit = actuator->limit;
        if (!actuator->late == !late)
            signals[actuator->to] = !finite(u) ? 0 : u < -limit ? -limit : u > limit ? limit : u;
    }
}

static int run_law(const awiwi_loop *loop, awiwi_real *signals)
{
    awiwi_real out[AWIWI_MOST_ARGUMENTS];
    int refused = 0;
    for (int i = 0; i < loop->law_blocks; i++) {
        const awiwi_block *block = loop->law + i;
        const int status = call(block, signals, out);
        if ((status == AWIWI_OK || status == AWIWI_NOT_CONVERGED) && all_finite(out, block->outputs))
            put(block, out, signals);
        else
            refused = 1;
    }
    for (int i = 0; refused && i < loop->actuators; i++)
        signals[loop->actuator[i].from] = 0;
    return refused;
}

/* Everything in a tick but the motion of the plant. */
static int control(const awiwi_loop *loop, unsigned tick, awiwi_real *signals)
{
    if (awiwi_rates(loop, signals)) /* so that sensors see the present state */
        return AWIWI_OUT_OF_DOMAIN;
    sense(loop, tick, signals);
    act(loop, 1, signals);
    const int refused = run_law(loop, signals);
    act(loop, 0, signals);
    return refused ? AWIWI_NOT_CONVERGED : AWIWI_OK;
}

/* Whether a plant is one kernel whose first outputs are the rates, in their order. */
static int is_alone(const awiwi_loop *loop)
{
    int alone = loop->plant_blocks == 1 && loop->plant->kernel && loop->plant->outputs >= loop->states;
    for (int i = 0; alone && i < loop->states; i++)
        alone = loop->plant->to[i] == loop->states + i;
    for (int i = 0; alone && i < loop->plant->inputs; i++) /* none reads what it writes */
        for (int k = 0; alone && k < loop->plant->outputs; k++)
            alone = loop->plant->from[i] != loop->plant->to[k];
    return alone;
}

/* The same steps with the same bits for such a plant: of its inputs only the states change in a period. */
static int integrate_alone(const awiwi_loop *loop, awiwi_real h, awiwi_real *signals)
{
    static const int reach[4] = {0, 1, 1, 2}, share[4] = {1, 2, 2, 1}; /* in halves, in sixths */
    const awiwi_block *plant = loop->plant;
    const int n = loop->states;
    awiwi_real in[AWIWI_MOST_ARGUMENTS], out[AWIWI_MOST_ARGUMENTS], sum[AWIWI_MOST_RATES];
    int port[AWIWI_MOST_ARGUMENTS], state[AWIWI_MOST_ARGUMENTS], moving = 0;
    for (int i = 0; i < plant->inputs; i++) {
        in[i] = signals[plant->from[i]];
        if (plant->from[i] < n) {
            port[moving] = i;
            state[moving++] = plant->from[i];
        }
    }
    for (int step = 0; step < loop->substeps; step++) {
        for (int i = 0; i < n; i++)
            sum[i] = 0;
        for (int stage = 0; stage < 4; stage++) {
            const awiwi_real ahead = h * (awiwi_real)reach[stage] / 2, weight = (awiwi_real)share[stage];
            for (int i = 0; i < moving; i++)
                in[port[i]] = stage ? signals[state[i]] + ahead * out[state[i]] : signals[state[i]];
            if (plant->kernel(in, out))
                return AWIWI_OUT_OF_DOMAIN;
            for (int i = 0; i < n; i++)
                sum[i] += weight * out[i];
        }
        for (int i = 0; i < n; i++)
            signals[i] += h / 6 * sum[i];
    }
    put(plant, out, signals);
    return AWIWI_OK;
}

static int integrate(const awiwi_loop *loop, int alone, awiwi_real *signals)
{
    const awiwi_real h = loop->period / (awiwi_real)loop->substeps;
    if (alone && integrate_alone(loop, h, signals))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; !alone && i < loop->substeps; i++)
        if (advance(loop, h, signals))
            return AWIWI_OUT_OF_DOMAIN;
    return all_finite(signals, loop->states) ? AWIWI_OK : AWIWI_NOT_FINITE;
}

int awiwi_tick(const awiwi_loop *loop, unsigned tick, awiwi_real *signals)
{
    const int controlled = control(loop, tick, signals);
    if (controlled == AWIWI_OUT_OF_DOMAIN)
        return controlled;
    const int moved = integrate(loop, is_alone(loop), signals);
    return moved ? moved : controlled;
}

int awiwi_simulate(const awiwi_loop *loop, const awiwi_run *run, awiwi_real *signals, int *refused, int *status)
{
    const int alone = is_alone(loop);
    awiwi_real *row = run->record;
    *refused = 0;
    *status = all_finite(signals, loop->states) ? AWIWI_OK : AWIWI_NOT_FINITE;
    for (int tick = 0; tick < run->ticks; tick++) {
        if (*status == AWIWI_OUT_OF_DOMAIN || *status == AWIWI_NOT_FINITE)
            return tick;
        for (int i = 0; i < run->inputs; i++)
            signals[run->input[i]] = run->values[tick * run->inputs + i];
        const int controlled = control(loop, (unsigned)tick, signals);
        for (int i = 0; tick % run->every == 0 && i < run->watched; i++)
            *row++ = signals[run->watch[i]];
        *refused += controlled == AWIWI_NOT_CONVERGED;
        const int moved = controlled == AWIWI_OUT_OF_DOMAIN ? controlled : integrate(loop, alone, signals);
        *status = moved ? moved : controlled;
    }
    return run->ticks;
}
