/* Time of each co-simulation step of an FMU (2.0), inputs included, with nothing but C around it. Built as a library. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

static void hear(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)environment, (void)name, (void)status, (void)category, (void)message;
}

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Between -1 and 1, by xorshift. */
static double noise(unsigned long long *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (double)(*state >> 11) / 4503599627370496.0 - 1.0;
}

#define LOAD(name) name##TYPE *name = (name##TYPE *)dlsym(library, #name);

/* Seconds of each of `steps` steps of `size`; the inputs alternate between `values` and their negatives,
 * every `period` steps, and to each is added up to `ripple`, another number each step. The first
 * `n_start` of `references` get `start`. Gives 0, or the status that stopped it. */
int measure(const char *path, const char *guid, const char *resources, const unsigned start_references[],
            const double start[], int n_start, const unsigned references[], const double values[], int n, double ripple,
            double size, int steps, int period, double seconds[])
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    fmi2CallbackFunctions callbacks = {hear, calloc, free, NULL, NULL};
    fmi2Component instance;
    double inputs[8];
    int step, i, status = 0;
    unsigned long long state = 88172645463325252ULL;
    if (library == NULL || n > 8) {
        return -1;
    }
    LOAD(fmi2Instantiate)
    LOAD(fmi2SetupExperiment)
    LOAD(fmi2EnterInitializationMode)
    LOAD(fmi2ExitInitializationMode)
    LOAD(fmi2SetReal)
    LOAD(fmi2DoStep)
    LOAD(fmi2FreeInstance)
    instance = fmi2Instantiate("timed", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2False);
    if (instance == NULL) {
        return -2;
    }
    fmi2SetupExperiment(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(instance);
    status = fmi2SetReal(instance, start_references, (size_t)n_start, start);
    fmi2ExitInitializationMode(instance);
    for (step = 0; step < steps && status == 0; step++) {
        double begin;
        for (i = 0; i < n; i++) {
            inputs[i] = (step / period % 2 ? -values[i] : values[i]) + ripple * noise(&state);
        }
        begin = now();
        status = fmi2SetReal(instance, references, (size_t)n, inputs);
        status = status ? status : fmi2DoStep(instance, step * size, size, fmi2True);
        seconds[step] = now() - begin;
    }
    fmi2FreeInstance(instance);
    return status;
}
