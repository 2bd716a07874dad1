/* A simulated control loop: a plant in continuous time, a law on a clock, sensors and actuators between them. Bounded
   work, no heap; reentrant. All quantities are in one vector of signals; kernels are wired by indices into it. */
#ifndef AWIWI_SIMULATE_H
#define AWIWI_SIMULATE_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { AWIWI_MOST_RATES = 64, AWIWI_MOST_ARGUMENTS = 512 };

/* A kernel with all inputs in one array and all outputs in another; returns an awiwi_status. */
typedef int (*awiwi_flat)(const awiwi_real *in, awiwi_real *out);

/* A kernel in a loop: it reads its inputs from the signals `from` and writes its outputs to the signals `to`; at most
   AWIWI_MOST_ARGUMENTS of each. Without a kernel (NULL) a block adds products: for n outputs, output i is
   in[i] * in[n + i] + in[2 n + i] * in[3 n + i] + ... */
typedef struct awiwi_block {
    awiwi_flat kernel;
    int inputs;
    int outputs;
    const int *from;
    const int *to;
} awiwi_block;

/* Measures one signal for the law: adds normal noise of this standard deviation, then rounds to whole steps; 0 for none. */
typedef struct awiwi_sensor {
    int from;
    int to;
    awiwi_real noise;
    awiwi_real step;
} awiwi_sensor;

/* Applies a command of the law to the plant, within +-limit; one period later if `late`. */
typedef struct awiwi_actuator {
    int from;
    int to;
    awiwi_real limit;
    int late;
} awiwi_actuator;

/* Signals 0 to states - 1 are the plant's states, at most AWIWI_MOST_RATES, the next as many their rates, which the
   plant's blocks compute in their order. The law's blocks run once in a period. */
typedef struct awiwi_loop {
    int states;
    int plant_blocks;
    int law_blocks;
    int sensors;
    int actuators;
    const awiwi_block *plant;
    const awiwi_block *law;
    const awiwi_sensor *sensor;
    const awiwi_actuator *actuator;
    awiwi_real period;    /* s */
    int substeps;         /* steps of integration in a period */
    awiwi_real tolerance; /* of every state in a step; with one, a period has fewer steps where these keep it */
    unsigned seed;        /* of the noise */
} awiwi_loop;

/* Inputs and record of a run: in tick i the signals `input` take the values of row i of values[ticks][inputs], and in
   every `every`-th tick the signals `watch` are written to the next row of record[], before the plant moves. */
typedef struct awiwi_run {
    int ticks;
    int inputs;
    int watched;
    int every;
    const int *input;
    const awiwi_real *values;
    const int *watch;
    awiwi_real *record;
} awiwi_run;

/* Compute the rates of the plant's states and all other outputs of its blocks. AWIWI_OK or AWIWI_OUT_OF_DOMAIN. */
int awiwi_rates(const awiwi_loop *loop, awiwi_real *signals);

/* One period: read sensors, apply delayed commands, run the law, apply the other commands, and integrate by Runge and
   Kutta's method of fourth order. Where a block of the law fails, its outputs stay as they were and all commands are 0. Returns
   AWIWI_OK             success;
   AWIWI_NOT_CONVERGED  a block of the law failed;
   AWIWI_OUT_OF_DOMAIN  a block of the plant failed;
   AWIWI_NOT_FINITE     a state is infinite or not a number. */
int awiwi_tick(const awiwi_loop *loop, unsigned tick, awiwi_real *signals);

/* Run ticks until all are done or the plant fails; returns their number. `refused` counts the ticks in which the law
   failed; `status` is that of the last tick. */
int awiwi_simulate(const awiwi_loop *loop, const awiwi_run *run, awiwi_real *signals, int *refused, int *status);

#ifdef __cplusplus
}
#endif

#endif
