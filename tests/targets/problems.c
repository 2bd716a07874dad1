/* Problems that no kernel of the Awiwi hand poses, with every kind of degeneracy. `make mutants` runs this program; it
   prints all results. */
#include "problems.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PROBLEMS = 900, ARRAYS = 64 };

static uint32_t seed;
static void *arrays[ARRAYS];
static int array_count;

/* Random numbers that depend on no other problem. */
static void begin(int number, int kind)
{
    seed = 6 * (uint32_t)number + (uint32_t)kind;
    for (int i = 0; i < 4; i++)
        (void)random_in(0, 1);
}

double random_in(double low, double high)
{
    seed = seed * 1664525u + 1013904223u;
    return low + (high - low) * (seed >> 8) / 16777216.0;
}

double scaled(void)
{
    return pow(10, random_in(-6, 6));
}

static void *array(int count, size_t size)
{
    if (array_count == ARRAYS)
        abort();
    return arrays[array_count++] = malloc((size_t)count * size);
}

double *random_array(int count, double low, double high)
{
    double *x = array(count, sizeof *x);
    for (int i = 0; i < count; i++)
        x[i] = random_in(low, high);
    return x;
}

double *copy_of(const double *x, int count)
{
    return memcpy(array(count, sizeof *x), x, (size_t)count * sizeof *x);
}

double *output(int count)
{
    return random_array(count, -77, -77);
}

int *indices(int count, int first, int step)
{
    int *x = array(count, sizeof *x);
    for (int i = 0; i < count; i++)
        x[i] = first + step * i;
    return x;
}

void release(void)
{
    while (array_count > 0)
        free(arrays[--array_count]);
}

void coarsen(double *x, int count, double grid)
{
    for (int i = 0; i < count; i++)
        x[i] = grid * round(x[i] / grid);
}

void record(calls *c, const double *x, int count)
{
    c->count++;
    for (int i = 0; i < count; i++) {
        uint64_t bits = 1;
        if (!isnan(x[i]))
            memcpy(&bits, &x[i], sizeof bits);
        c->digest = (c->digest ^ bits) * 0x100000001B3u;
        c->digest ^= c->digest >> 32;
    }
}

void print(const char *name, int status, const double *x, int count)
{
    calls values = {0, 0};
    record(&values, x, count);
    printf("%s %d %llx\n", name, status, (unsigned long long)values.digest);
}

void print_calls(const calls *c)
{
    printf("calls %d %llx\n", c->count, (unsigned long long)c->digest);
}

int main(void)
{
    static void (*const tries[])(int) = {try_tendons, try_least_squares, try_regulator,
                                         try_joint, try_law, try_parts};
    for (int number = 0; number < PROBLEMS; number++) {
        for (int kind = 0; kind < 6; kind++) {
            begin(number, kind);
            tries[kind](number);
            release();
        }
    }
    try_files();
    try_hand();
    return 0;
}
