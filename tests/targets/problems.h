/* What the programs of problems share: random numbers, arrays of exactly the size that a function may use, so that the
   address sanitizer sees a step beyond, and the printing of all that comes out. */
#ifndef PROBLEMS_H
#define PROBLEMS_H

#include <stdint.h>

#include "awiwi.h"
#include "dense.h"

double random_in(double low, double high);

/* A number of any size: 1e-6 to 1e6. */
double scaled(void);

/* Arrays on the heap, until release(). */
double *random_array(int count, double low, double high);
double *copy_of(const double *x, int count);
double *output(int count); /* filled with a number that no function gives */
int *indices(int count, int first, int step);
void release(void);

/* x on a grid of a few numbers, so that equal ones occur. */
void coarsen(double *x, int count, double grid);

/* A line with the status and a digest of all bits of x. */
void print(const char *name, int status, const double *x, int count);

/* What a function asks a callback for: how often, and a digest of where. */
typedef struct calls {
    int count;
    uint64_t digest;
} calls;

void record(calls *c, const double *x, int count);
void print_calls(const calls *c);

/* One problem of every kind. */
void try_tendons(int number);
void try_least_squares(int number);
void try_regulator(int number);
void try_joint(int number);
void try_law(int number);
void try_parts(int number);
void try_files(void);
void try_hand(void);

#endif
