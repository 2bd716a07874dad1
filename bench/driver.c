/* Calls kernels of many shared objects in one process.
 *
 *   driver check|time|count ROUNDS SAMPLES PLAN RESULT
 *
 * PLAN has a line per kernel: GROUP OBJECT FUNCTION INPUT_SIZE OUTPUT_SIZE INPUTS. INPUTS is a file of SAMPLES records.
 * check  writes the outputs of all samples, kernel after kernel, as raw doubles.
 * time   runs the kernels of a group in turns, ROUNDS times, starting with another one each time; writes the median
 *        and the quartiles of the time of one call [ns], one line per kernel.
 * count  runs every kernel over SAMPLES once: for tools that count instructions.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef void loop(long n, const double *in, double *out, long step);

struct kernel {
    int group;
    char object[512], function[128], inputs[512];
    int input_size, output_size;
    loop *run;
    double *in, *out, *times;
};

static void *need(void *pointer, const char *what)
{
    if (pointer == NULL) {
        const char *why = dlerror();
        fprintf(stderr, "driver: %s%s%s\n", what, why ? ": " : "", why ? why : "");
        exit(1);
    }
    return pointer;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct kernel *read_plan(const char *path, long samples, long rounds, int *count)
{
    FILE *file = need(fopen(path, "r"), path);
    struct kernel *kernels = NULL, k;
    memset(&k, 0, sizeof k);
    *count = 0;
    while (fscanf(file, "%d %511s %127s %d %d %511s", &k.group, k.object, k.function, &k.input_size, &k.output_size,
                  k.inputs) == 6) {
        void *object = need(dlopen(k.object, RTLD_NOW | RTLD_LOCAL), k.object);
        *(void **)&k.run = need(dlsym(object, k.function), k.function);
        const size_t size = (size_t)samples * (size_t)k.input_size;
        FILE *inputs = need(fopen(k.inputs, "rb"), k.inputs);
        k.in = need(malloc(size * sizeof(double)), "memory");
        if (fread(k.in, sizeof(double), size, inputs) != size) {
            need(NULL, "too few inputs");
        }
        fclose(inputs);
        k.out = need(calloc((size_t)samples * (size_t)k.output_size, sizeof(double)), "memory");
        k.times = need(calloc((size_t)rounds, sizeof(double)), "memory");
        kernels = need(realloc(kernels, (size_t)(*count + 1) * sizeof k), "memory");
        kernels[(*count)++] = k;
    }
    fclose(file);
    return kernels;
}

/* All kernels of a group share one input, so that no kernel finds it colder than another does. */
static void time_group(struct kernel *first, int count, long rounds, long samples)
{
    for (long round = 0; round < rounds; round++) {
        for (int turn = 0; turn < count; turn++) {
            struct kernel *k = first + (round % 2 ? count - 1 - turn : turn) % count;
            k = first + ((k - first) + 7 * round) % count;
            k->run(samples / 4, first->in, first->out, 0); /* code, data and branches of this kernel into the caches */
            const double start = now();
            k->run(samples, first->in, first->out, 0);
            k->times[round] = (now() - start) / (double)samples;
        }
    }
}

int main(int argc, char **argv)
{
    if (argc != 6) {
        fprintf(stderr, "usage: driver check|time|count ROUNDS SAMPLES PLAN RESULT\n");
        return 2;
    }
    const long rounds = atol(argv[2]), samples = atol(argv[3]);
    int count;
    struct kernel *kernels = read_plan(argv[4], samples, rounds, &count);
    FILE *result = need(fopen(argv[5], "wb"), argv[5]);
    if (strcmp(argv[1], "time") == 0) {
        for (int first = 0, next; first < count; first = next) {
            for (next = first; next < count && kernels[next].group == kernels[first].group; next++) {}
            time_group(kernels + first, next - first, rounds, samples);
        }
    }
    for (int i = 0; i < count; i++) {
        struct kernel *k = kernels + i;
        if (strcmp(argv[1], "time") == 0) {
            qsort(k->times, (size_t)rounds, sizeof(double), ascending);
            fprintf(result, "%.3f %.3f %.3f\n", k->times[rounds / 2], k->times[rounds / 4], k->times[3 * rounds / 4]);
        } else {
            k->run(samples, k->in, k->out, k->output_size);
            if (strcmp(argv[1], "check") == 0) {
                fwrite(k->out, sizeof(double), (size_t)samples * (size_t)k->output_size, result);
            }
        }
    }
    return fclose(result) != 0;
}
