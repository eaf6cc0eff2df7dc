/* Drives an FMU (2.0, co-simulation) through every mode with torques that are exact in binary, and prints what comes
 * out in hexadecimal floating point. On Windows it loads the library that it is given; elsewhere it is linked with the
 * sources.
 *
 * Usage: trajectory [LIBRARY] */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2Functions.h"
#include "variables.h"

#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define LOAD(name) name##TYPE *name = (name##TYPE *)(void *)GetProcAddress(library, #name);
#else
#define LOAD(name)
#endif

#define CYCLES 1500
#define STEP 0.001953125

static void hear(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    va_list arguments;
    (void)environment, (void)name, (void)status, (void)category;
    va_start(arguments, message);
    vprintf(message, arguments);
    va_end(arguments);
}

static unsigned reference_of(const char *name)
{
    unsigned reference;
    for (reference = 0; reference < QO_VARIABLES; reference++) {
        if (strcmp(qo_variables[reference].name, name) == 0) {
            return reference;
        }
    }
    printf("no variable %s\n", name);
    exit(1);
}

int main(int count, char *arguments[])
{
    static const char *const commands[] = {"torque_fl", "torque_rl", "torque_fr", "torque_rr"};
    static const char *const outputs[] = {"pose_x", "pose_y", "gamma", "alpha_l", "alpha_r", "beta_fl", "x_dot"};
    fmi2CallbackFunctions callbacks = {hear, calloc, free, NULL, NULL};
    unsigned inputs[4], watched[7];
    double torques[4], values[7];
    fmi2Component vehicle;
    int cycle, i;
#ifdef _WIN32
    HMODULE library = count > 1 ? LoadLibraryA(arguments[1]) : NULL;
    if (library == NULL) {
        printf("the library cannot be loaded\n");
        return 1;
    }
#endif
    LOAD(fmi2Instantiate)
    LOAD(fmi2SetupExperiment)
    LOAD(fmi2EnterInitializationMode)
    LOAD(fmi2ExitInitializationMode)
    LOAD(fmi2SetReal)
    LOAD(fmi2GetReal)
    LOAD(fmi2DoStep)
    LOAD(fmi2FreeInstance)
    (void)count, (void)arguments;
    for (i = 0; i < 4; i++) {
        inputs[i] = reference_of(commands[i]);
    }
    for (i = 0; i < 7; i++) {
        watched[i] = reference_of(outputs[i]);
    }
    vehicle = fmi2Instantiate("vehicle", fmi2CoSimulation, qo_token, "", &callbacks, fmi2False, fmi2False);
    if (vehicle == NULL || fmi2SetupExperiment(vehicle, fmi2False, 0.0, 0.0, fmi2False, 0.0) != fmi2OK ||
        fmi2EnterInitializationMode(vehicle) != fmi2OK || fmi2ExitInitializationMode(vehicle) != fmi2OK) {
        return 1;
    }
    for (cycle = 0; cycle < CYCLES; cycle++) {
        const double drive = cycle % 600 < 300 ? 1.0 : -0.75, steer = cycle % 1000 < 500 ? 0.75 : -0.5;
        torques[0] = drive - steer;
        torques[1] = drive + steer;
        torques[2] = drive + 0.5 * steer;
        torques[3] = drive - 0.5 * steer;
        if (fmi2SetReal(vehicle, inputs, 4, torques) != fmi2OK ||
            fmi2DoStep(vehicle, cycle * STEP, STEP, fmi2True) != fmi2OK) {
            return 1;
        }
        if (cycle % 100 == 99) {
            fmi2GetReal(vehicle, watched, 7, values);
            for (i = 0; i < 7; i++) {
                printf("%a ", values[i]);
            }
            printf("\n");
        }
    }
    fmi2FreeInstance(vehicle);
    return 0;
}
