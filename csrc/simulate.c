/* A control law on a clock, and a plant in continuous time: loops of kernels, simulated. */
#include "numerics.h"
#include "dense.h"
#include "noise.h"
#include "awiwi_simulate.h"

#include <string.h>

static void put(const awiwi_real *out, const int *to, int n, awiwi_real *signals)
{
    AWIWI_UNROLLED for (int i = 0; i < n; i++)
        signals[to[i]] = out[i];
}

/* Without a kernel a block adds products of its inputs: see awiwi_block. */
static void add_products(const awiwi_block *block, const awiwi_real *signals, awiwi_real *out)
{
    const int n = block->outputs;
    for (int i = 0; i < n; i++) {
        out[i] = 0;
        for (const int *from = block->from + i; from + n < block->from + block->inputs; from += 2 * n)
            out[i] += signals[from[0]] * signals[from[n]];
    }
}

/* Run a block on its signals; `out` receives its outputs. */
static int call(const awiwi_block *block, const awiwi_real *signals, awiwi_real *out)
{
    awiwi_real in[AWIWI_MOST_ARGUMENTS];
    if (!block->kernel) {
        add_products(block, signals, out);
        return AWIWI_OK;
    }
    AWIWI_UNROLLED for (int i = 0; i < block->inputs; i++)
        in[i] = signals[block->from[i]];
    return block->kernel(in, out);
}

int awiwi_rates(const awiwi_loop *loop, awiwi_real *signals)
{
    awiwi_real out[AWIWI_MOST_ARGUMENTS];
    for (int i = 0; i < loop->plant_blocks; i++) {
        const awiwi_block *block = loop->plant + i;
        if (call(block, signals, out))
            return AWIWI_OUT_OF_DOMAIN;
        put(out, block->to, block->outputs, signals);
    }
    return AWIWI_OK;
}

/* One step of Runge and Kutta's method of fourth order, from states and rates at its start to those at its end. `error`
 * is how far, in any state, it is from the method of third order that has the last rates for those of the fourth stage. */
static int advance(const awiwi_loop *loop, awiwi_real h, const awiwi_real *start, awiwi_real *signals, awiwi_real *error)
{
    static const awiwi_real reach[3] = {(awiwi_real)0.5, (awiwi_real)0.5, 1}, share[3] = {2, 2, 1};
    const int n = loop->states;
    awiwi_real sum[AWIWI_MOST_RATES], fourth[AWIWI_MOST_RATES], most = 0;
    awiwi_real *x = signals;
    const awiwi_real *rate = signals + n;
    memcpy(sum, start + n, sizeof(awiwi_real) * (size_t)n);
    for (int stage = 0; stage < 3; stage++) {
        const awiwi_real ahead = h * reach[stage], weight = share[stage];
        for (int i = 0; i < n; i++)
            x[i] = start[i] + ahead * rate[i];
        if (awiwi_rates(loop, signals))
            return AWIWI_OUT_OF_DOMAIN;
        for (int i = 0; i < n; i++)
            sum[i] += weight * rate[i];
    }
    for (int i = 0; i < n; i++) {
        fourth[i] = rate[i];
        x[i] = start[i] + h / 6 * sum[i];
    }
    if (awiwi_rates(loop, signals))
        return AWIWI_OUT_OF_DOMAIN;
    for (int i = 0; i < n; i++) {
        const awiwi_real apart = awiwi_size(rate[i] - fourth[i]);
        most = apart > most ? apart : most;
    }
    *error = h / 6 * most;
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
            signals[actuator->to] = awiwi_is_number(u) ? awiwi_clamp(u, -limit, limit) : 0;
    }
}

static int run_law(const awiwi_loop *loop, awiwi_real *signals)
{
    awiwi_real out[AWIWI_MOST_ARGUMENTS];
    int refused = 0;
    for (int i = 0; i < loop->law_blocks; i++) {
        const awiwi_block *block = loop->law + i;
        const int status = call(block, signals, out);
        if ((status == AWIWI_OK || status == AWIWI_NOT_CONVERGED) && awiwi_all_finite(out, block->outputs))
            put(out, block->to, block->outputs, signals);
        else
            refused = 1;
    }
    for (int i = 0; refused && i < loop->actuators; i++)
        signals[loop->actuator[i].from] = 0;
    return refused;
}

/* Everything in a tick but the motion of the plant. Sensors see its present outputs, computed anew if they are old. */
static int control(const awiwi_loop *loop, unsigned tick, int old, awiwi_real *signals)
{
    if (old && awiwi_rates(loop, signals))
        return AWIWI_OUT_OF_DOMAIN;
    sense(loop, tick, signals);
    act(loop, 1, signals);
    const int refused = run_law(loop, signals);
    act(loop, 0, signals);
    return refused ? AWIWI_NOT_CONVERGED : AWIWI_OK;
}

/* Move the plant for a period: in equal steps, or with a tolerance in as few as keep it, by halves. */
static int integrate(const awiwi_loop *loop, awiwi_real *signals)
{
    const size_t size = sizeof(awiwi_real) * 2 * (size_t)loop->states;
    awiwi_real before[2 * AWIWI_MOST_RATES], error = 0;
    int parts = loop->tolerance > 0 ? 1 : loop->substeps;
    if (awiwi_rates(loop, signals))
        return AWIWI_OUT_OF_DOMAIN;
    for (int done = 0; done < parts;) {
        memcpy(before, signals, size);
        const int status = advance(loop, loop->period / (awiwi_real)parts, before, signals, &error);
        if (parts < loop->substeps && (status || error > loop->tolerance)) {
            memcpy(signals, before, size);
            parts *= 2;
            done *= 2;
        } else if (status) {
            return status;
        } else {
            done++;
        }
    }
    return awiwi_all_finite(signals, loop->states) ? AWIWI_OK : AWIWI_NOT_FINITE;
}

int awiwi_tick(const awiwi_loop *loop, unsigned tick, awiwi_real *signals)
{
    const int controlled = control(loop, tick, 1, signals);
    if (controlled == AWIWI_OUT_OF_DOMAIN)
        return controlled;
    const int moved = integrate(loop, signals);
    return moved ? moved : controlled;
}

int awiwi_simulate(const awiwi_loop *loop, const awiwi_run *run, awiwi_real *signals, int *refused, int *status)
{
    awiwi_real *row = run->record;
    *refused = 0;
    *status = awiwi_all_finite(signals, loop->states) ? AWIWI_OK : AWIWI_NOT_FINITE;
    for (int tick = 0; tick < run->ticks; tick++) {
        if (*status == AWIWI_OUT_OF_DOMAIN || *status == AWIWI_NOT_FINITE)
            return tick;
        int old = !tick;
        for (int i = 0; i < run->inputs; i++) {
            const awiwi_real value = run->values[tick * run->inputs + i];
            old |= !(signals[run->input[i]] == value);
            signals[run->input[i]] = value;
        }
        const int controlled = control(loop, (unsigned)tick, old, signals);
        for (int i = 0; tick % run->every == 0 && i < run->watched; i++)
            *row++ = signals[run->watch[i]];
        *refused += controlled == AWIWI_NOT_CONVERGED;
        const int moved = controlled == AWIWI_OUT_OF_DOMAIN ? controlled : integrate(loop, signals);
        *status = moved ? moved : controlled;
    }
    return run->ticks;
}
