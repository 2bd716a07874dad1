/* A sampled loop of kernels: a plant in continuous time, a law on a clock, sensors and actuators between them. Bounded
   work, no heap; reentrant. All quantities live in one vector of signals; kernels are wired by places in it. */
#ifndef AWIWI_SIMULATE_H
#define AWIWI_SIMULATE_H

#include "awiwi_solvers.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { AWIWI_MOST_RATES = 64, AWIWI_MOST_ARGUMENTS = 512 };

/* A kernel whose inputs lie one after the other, and its outputs likewise; returns an awiwi_status. */
typedef int (*awiwi_flat)(const awiwi_real *in, awiwi_real *out);

/* A kernel in its place: inputs are read from the signals `from`, outputs written to the signals `to`; at most
   AWIWI_MOST_ARGUMENTS of each. */
typedef struct awiwi_block {
    awiwi_flat kernel;
    int inputs;
    int outputs;
    const int *from;
    const int *to;
} awiwi_block;

/* Shows one signal to the law: with normal noise, then rounded to whole steps. Neither where they are 0. */
typedef struct awiwi_sensor {
    int from;
    int to;
    awiwi_real noise;
    awiwi_real step;
} awiwi_sensor;

/* Takes what the law commands to the plant, within its limit; one sample later if it is late. */
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
    awiwi_real period; /* s */
    int substeps;      /* steps of integration in a period */
    unsigned seed;     /* of the noise */
} awiwi_loop;

/* What drives a run and what is kept of it: in tick i the signals `input` take the values of row i of inputs[ticks][],
   and every so many ticks the signals `watch` become a row of record[], before the plant moves on. */
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

/* The rates of the plant's states, and all that its kernels tell besides; AWIWI_OK or AWIWI_OUT_OF_DOMAIN. */
int awiwi_rates(const awiwi_loop *loop, awiwi_real *signals);

/* One period: sense, act on what was commanded, think, and integrate by Runge and Kutta's method. Where a block of the
   law has no result, its signals stay as they were, and in this period nothing is commanded: 0. Returns
   AWIWI_OK             all went well;
   AWIWI_NOT_CONVERGED  the law refused;
   AWIWI_OUT_OF_DOMAIN  a kernel of the plant has no result there;
   AWIWI_NOT_FINITE     a state is not a number any more. */
int awiwi_tick(const awiwi_loop *loop, unsigned tick, awiwi_real *signals);

/* Ticks until all are done or the plant fails: returns how many were done. `refused` counts those without a command,
   `status` is the last tick's. */
int awiwi_simulate(const awiwi_loop *loop, const awiwi_run *run, awiwi_real *signals, int *refused, int *status);

#ifdef __cplusplus
}
#endif

#endif
