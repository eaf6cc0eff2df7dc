/* Random sequences of calls on both versions of the interface, with random parameters, inputs and step sizes.
 *
 * Compiled together with the sources of an FMU of each version, under the address and undefined-behaviour sanitizers.
 * Ends with 1 and a line that says what and how to repeat it, where
 *   - a call answers OK and gives a value that is not finite,
 *   - a call answers with an error and says nothing,
 *   - a value that is not finite is taken, or refused by a message that does not name the variable,
 *   - a refused call changes a variable.
 *
 * Usage: fuzz FIRST_SEED SEQUENCES */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "instance.h"

#include "fmi2Functions.h"
#include "fmi3Functions.h"

#define CALLS 40

static uint64_t seed_now;
static uint64_t random_state;
static int call_now;
static char last_message[1024];
static unsigned long taken[4];

static uint64_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state * 2685821657736338717ULL;
}

static unsigned below(unsigned n)
{
    return (unsigned)((random_bits() >> 32) % n);
}

static double uniform(void)
{
    return (double)(random_bits() >> 11) / 9007199254740992.0;
}

static void fail(const char *what)
{
    printf("%s (seed %llu, call %d, last message: %s)\n", what, (unsigned long long)seed_now, call_now, last_message);
    exit(1);
}

static void hear2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                  fmi2String message, ...)
{
    (void)environment, (void)name, (void)status, (void)category;
    if (strcmp(message, "%s") != 0) {
        fail("a message is used as a format");
    }
    {
        va_list arguments;
        va_start(arguments, message);
        vsnprintf(last_message, sizeof last_message, message, arguments);
        va_end(arguments);
    }
}

static void hear3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)status, (void)category;
    snprintf(last_message, sizeof last_message, "%s", message);
}

/* Mostly something a user could mean, sometimes anything. */
static double any_value(double usual)
{
    static const double extremes[] = {NAN, INFINITY, -INFINITY, 1e30, -1e30, 1e300, 1e-300, 0.0, -0.0, -1.0, 5e-324};
    switch (below(8)) {
    case 0: return extremes[below(sizeof extremes / sizeof extremes[0])];
    case 1: return usual * (4.0 * uniform() - 2.0);
    case 2: return (2.0 * uniform() - 1.0) * pow(10.0, 12.0 * uniform() - 6.0);
    default: return usual * (0.5 + uniform()) + (below(4) == 0 ? 2.0 * uniform() - 1.0 : 0.0);
    }
}

static double step_size(void)
{
    return below(12) == 0 ? any_value(1e-3) : pow(10.0, -9.0 + 10.0 * uniform());
}

/* The instance of this sequence, behind the version that it is used by. */
static struct {
    int is3;
    int is_cosimulation;
    void *instance;
    void *state; /* saved */
    double time;
} now;

/* An answer, with what must hold of every answer. */
static int check(int status)
{
    if (status < 0 || status > 3) {
        fail("an answer is none of the standard");
    }
    taken[status]++;
    if (status >= 2 && last_message[0] == '\0') {
        fail("an error without a message");
    }
    return status;
}

static int get(const unsigned references[], size_t n, double values[])
{
    last_message[0] = '\0';
    return check(now.is3 ? (int)fmi3GetFloat64(now.instance, references, n, values, n)
                         : (int)fmi2GetReal(now.instance, references, n, values));
}

static int set(const unsigned references[], size_t n, const double values[])
{
    last_message[0] = '\0';
    return check(now.is3 ? (int)fmi3SetFloat64(now.instance, references, n, values, n)
                         : (int)fmi2SetReal(now.instance, references, n, values));
}

static void get_some(void)
{
    unsigned references[8];
    double values[8];
    size_t n = 1 + below(8), i;
    for (i = 0; i < n; i++) {
        references[i] = below(QO_VARIABLES + (below(40) == 0 ? 3 : 0));
        values[i] = 0.0;
    }
    if (get(references, n, values) == 0) {
        for (i = 0; i < n; i++) {
            if (!isfinite(values[i])) {
                printf("%s: ", qo_variables[references[i]].name);
                fail("OK with a value that is not finite");
            }
        }
    }
}

/* Everything that has a value; none of it may be infinite while the answers are OK. */
static void get_everything(void)
{
    unsigned reference;
    for (reference = 0; reference < QO_VARIABLES; reference++) {
        double value = 0.0;
        if (qo_variables[reference].role != QO_DISCRETE && get(&reference, 1, &value) == 0 && !isfinite(value)) {
            printf("%s: ", qo_variables[reference].name);
            fail("OK with a value that is not finite");
        }
    }
}

static unsigned any_of_role(qo_role role)
{
    unsigned reference = below(QO_VARIABLES);
    while (qo_variables[reference].role != role) {
        reference = (reference + 1) % QO_VARIABLES;
    }
    return reference;
}

static void set_one(void)
{
    static const qo_role roles[] = {QO_INPUT, QO_INPUT, QO_PARAMETER, QO_PARAMETER, QO_STATE, QO_OUTPUT};
    unsigned reference = any_of_role(roles[below(6)]);
    double before = 0.0, after = 0.0, value;
    const int known = get(&reference, 1, &before) == 0;
    value = any_value(before);
    if (set(&reference, 1, &value) == 0) {
        if (!isfinite(value)) {
            fail("a value that is not finite is taken");
        }
    } else {
        if (strstr(last_message, qo_variables[reference].name) == NULL &&
            strstr(last_message, "may not be called") == NULL) {
            printf("%s: ", qo_variables[reference].name);
            fail("a refusal does not name the variable");
        }
        if (known && (get(&reference, 1, &after) != 0 || memcmp(&before, &after, sizeof before) != 0)) {
            fail("a refused call changes a variable");
        }
    }
}

/* An array of wheels: the same as its scalars, whoever is set; refused or taken whole. */
static void set_or_get_array(void)
{
    const unsigned number = below((unsigned)qo_array_count), reference = QO_VARIABLES + number;
    double values[QO_WHEELS], scalars[QO_WHEELS] = {0}, seed[QO_WHEELS], result[QO_WHEELS];
    int i, taken_whole = 1;
    if (!now.is3) {
        return;
    }
    for (i = 0; i < QO_WHEELS; i++) {
        values[i] = seed[i] = any_value(1.0);
    }
    last_message[0] = '\0';
    if (below(2) && check(fmi3SetFloat64(now.instance, &reference, 1, values, QO_WHEELS)) == 0) {
        for (i = 0; i < QO_WHEELS; i++) {
            taken_whole &= isfinite(values[i]) != 0;
        }
        if (!taken_whole || qo_variables[qo_arrays[number].members[0]].role != QO_INPUT) {
            fail("an array is taken that is not finite or no input");
        }
    }
    last_message[0] = '\0';
    if (check(fmi3GetFloat64(now.instance, &reference, 1, values, QO_WHEELS)) == 0 &&
        (get(qo_arrays[number].members, QO_WHEELS, scalars) != 0 || memcmp(values, scalars, sizeof values) != 0)) {
        fail("an array is not its scalars");
    }
    last_message[0] = '\0';
    check(fmi3GetDirectionalDerivative(now.instance, &reference, 1, &qo_arrays[0].members[0], 1, seed, 1, result,
                                       QO_WHEELS - (below(5) == 0)));
}

/* Between two internal steps: an input, or something that must not be set there. */
static void between3(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set_requested,
                     fmi3Boolean get_allowed, fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *requested,
                     fmi3Float64 *return_time)
{
    (void)environment, (void)get_allowed, (void)finished;
    if (set_requested && below(4) == 0) {
        const unsigned reference = any_of_role(below(4) ? QO_INPUT : QO_PARAMETER);
        const double value = any_value(1.0);
        last_message[0] = '\0';
        check(fmi3SetFloat64(now.instance, &reference, 1, &value, 1));
    }
    *requested = may_return && below(20) == 0;
    *return_time = time;
}

/* Rates of two inputs, or of something that has none. */
static void ramp(void)
{
    const unsigned references[2] = {any_of_role(QO_INPUT), any_of_role(below(10) ? QO_INPUT : QO_PARAMETER)};
    const double rates[2] = {any_value(10.0), any_value(10.0)};
    const int orders[2] = {1, below(20) == 0 ? 2 : 1};
    last_message[0] = '\0';
    check(fmi2SetRealInputDerivatives(now.instance, references, 2, orders, rates));
}

static void do_step(void)
{
    const double size = step_size();
    const double at = below(30) == 0 ? any_value(now.time) : now.time;
    int status;
    double end = at + size;
    if (!now.is3 && below(3) == 0) {
        ramp();
    }
    last_message[0] = '\0';
    if (now.is3) {
        fmi3Boolean event, terminate, early;
        status = check(fmi3DoStep(now.instance, at, size, fmi3True, &event, &terminate, &early, &end));
    } else {
        status = check(fmi2DoStep(now.instance, at, size, fmi2True));
    }
    if (status == 0) {
        now.time = end;
        if (!isfinite(end)) {
            fail("OK with a time that is not finite");
        }
        get_everything();
    }
}

static void solver_call(void)
{
    double values[QO_NX + 1];
    const size_t n = QO_NX + (below(30) == 0);
    int status, i, got = 1;
    last_message[0] = '\0';
    switch (below(4)) {
    case 0:
        status = now.is3 ? (int)fmi3GetContinuousStateDerivatives(now.instance, values, n)
                         : (int)fmi2GetDerivatives(now.instance, values, n);
        break;
    case 1:
        for (i = 0; i < QO_NX; i++) {
            values[i] = any_value(0.1);
        }
        status = now.is3 ? (int)fmi3SetContinuousStates(now.instance, values, n)
                         : (int)fmi2SetContinuousStates(now.instance, values, n);
        break;
    case 2:
        status = now.is3 ? (int)fmi3GetContinuousStates(now.instance, values, n)
                         : (int)fmi2GetContinuousStates(now.instance, values, n);
        break;
    default:
        got = 0;
        status = now.is3 ? (int)fmi3SetTime(now.instance, any_value(1.0)) : (int)fmi2SetTime(now.instance, any_value(1.0));
    }
    if (check(status) == 0 && got) {
        for (i = 0; i < QO_NX; i++) {
            if (!isfinite(values[i])) {
                fail("OK with a state or derivative that is not finite");
            }
        }
    }
}

static void differentiate(void)
{
    unsigned unknowns[4], knowns[3];
    double seed[4], result[4];
    const int adjoint = now.is3 && below(2);
    size_t i, n = adjoint ? 3 : 4;
    int status;
    for (i = 0; i < 4; i++) {
        unknowns[i] = any_of_role(below(2) ? QO_OUTPUT : QO_DERIVATIVE);
        seed[i] = any_value(1.0);
    }
    for (i = 0; i < 3; i++) {
        knowns[i] = any_of_role(below(20) == 0 ? QO_OUTPUT : below(2) ? QO_STATE : QO_PARAMETER);
    }
    last_message[0] = '\0';
    if (adjoint) {
        status = fmi3GetAdjointDerivative(now.instance, unknowns, 4, knowns, 3, seed, 4, result, 3);
    } else if (now.is3) {
        status = fmi3GetDirectionalDerivative(now.instance, unknowns, 4, knowns, 3, seed, 3, result, 4);
    } else {
        status = fmi2GetDirectionalDerivative(now.instance, unknowns, 4, knowns, 3, seed, result);
    }
    if (check(status) == 0) {
        for (i = 0; i < n; i++) {
            if (!isfinite(result[i])) {
                fail("OK with a derivative that is not finite");
            }
        }
    }
}

/* The checksum of a serialized state after its bytes, as somebody who means harm would set it. */
static void sum_up(unsigned char *bytes, size_t size)
{
    uint64_t sum = 14695981039346656037ULL;
    size_t i;
    for (i = 0; i + sizeof sum < size; i++) {
        sum = (sum ^ bytes[i]) * 1099511628211ULL;
    }
    memcpy(bytes + size - sizeof sum, &sum, sizeof sum);
}

static void save_or_restore(void)
{
    char *bytes;
    size_t size = 0;
    void *copy = NULL;
    int status, damaged = 0;
    last_message[0] = '\0';
    switch (below(4)) {
    case 0:
        check(now.is3 ? (int)fmi3GetFMUState(now.instance, &now.state) : (int)fmi2GetFMUstate(now.instance, &now.state));
        return;
    case 1:
        if (now.is3) {
            status = check(fmi3SetFMUState(now.instance, now.state));
        } else {
            status = check(fmi2SetFMUstate(now.instance, now.state));
        }
        if (status == 0) {
            const unsigned time = 0;
            get(&time, 1, &now.time);
        }
        return;
    case 2:
        if (now.is3) {
            check(fmi3FreeFMUState(now.instance, &now.state));
        } else {
            check(fmi2FreeFMUstate(now.instance, &now.state));
        }
        return;
    default: break;
    }
    if (now.is3) {
        fmi3SerializedFMUStateSize(now.instance, now.state, &size);
    } else {
        fmi2SerializedFMUstateSize(now.instance, now.state, &size);
    }
    bytes = calloc(size, 1);
    status = now.is3 ? (int)fmi3SerializeFMUState(now.instance, now.state, (fmi3Byte *)bytes, size)
                     : (int)fmi2SerializeFMUstate(now.instance, now.state, bytes, size);
    check(status);
    if (below(2)) {
        bytes[below((unsigned)size)] ^= (char)(1 << below(8));
        damaged = below(2);
        if (!damaged) {
            sum_up((unsigned char *)bytes, size);
        }
    }
    last_message[0] = '\0';
    status = now.is3 ? (int)fmi3DeserializeFMUState(now.instance, (fmi3Byte *)bytes, size, &copy)
                     : (int)fmi2DeSerializeFMUstate(now.instance, bytes, size, &copy);
    if (check(status) == 0) {
        if (damaged) {
            fail("a damaged state is taken");
        }
        if (now.is3) {
            fmi3FreeFMUState(now.instance, &copy);
        } else {
            fmi2FreeFMUstate(now.instance, &copy);
        }
    }
    free(bytes);
}

static void enter_initialization(void)
{
    const double start = below(20) == 0 ? any_value(1.0) : 0.0;
    const int has_stop = below(4) == 0, has_tolerance = below(4) == 0;
    const double stop = any_value(10.0), tolerance = below(4) == 0 ? any_value(1e-4) : 1e-4;
    int status;
    if (now.is3) {
        status = check(fmi3EnterInitializationMode(now.instance, has_tolerance, tolerance, start, has_stop, stop));
    } else {
        status = check(fmi2SetupExperiment(now.instance, has_tolerance, tolerance, start, has_stop, stop));
        last_message[0] = '\0';
        check(fmi2EnterInitializationMode(now.instance));
    }
    if (status == 0) {
        now.time = start;
    }
}

static void change_mode(void)
{
    fmi3Boolean flags[5];
    fmi3Float64 next;
    fmi2EventInfo info;
    fmi2Boolean enter, terminate;
    last_message[0] = '\0';
    switch (below(9)) {
    case 0:
    case 1: enter_initialization(); break;
    case 2:
    case 3:
        check(now.is3 ? (int)fmi3ExitInitializationMode(now.instance) : (int)fmi2ExitInitializationMode(now.instance));
        break;
    case 4: check(now.is3 ? (int)fmi3EnterEventMode(now.instance) : (int)fmi2EnterEventMode(now.instance)); break;
    case 5:
        check(now.is3 ? (int)fmi3UpdateDiscreteStates(now.instance, &flags[0], &flags[1], &flags[2], &flags[3],
                                                      &flags[4], &next)
                      : (int)fmi2NewDiscreteStates(now.instance, &info));
        break;
    case 6:
        if (now.is3 && now.is_cosimulation) {
            check(fmi3EnterStepMode(now.instance));
        } else {
            check(now.is3 ? (int)fmi3EnterContinuousTimeMode(now.instance)
                          : (int)fmi2EnterContinuousTimeMode(now.instance));
        }
        break;
    case 7:
        check(now.is3 ? (int)fmi3CompletedIntegratorStep(now.instance, fmi3True, &flags[0], &flags[1])
                      : (int)fmi2CompletedIntegratorStep(now.instance, fmi2True, &enter, &terminate));
        break;
    default:
        if (below(6) == 0) {
            check(now.is3 ? (int)fmi3Reset(now.instance) : (int)fmi2Reset(now.instance));
        } else if (below(6) == 0) {
            check(now.is3 ? (int)fmi3Terminate(now.instance) : (int)fmi2Terminate(now.instance));
        }
    }
}

static void begin(void)
{
    static fmi2CallbackFunctions callbacks = {hear2, calloc, free, NULL, NULL};
    const char *token = below(50) == 0 ? "another" : qo_token;
    const int logging = (int)below(2);
    memset(&now, 0, sizeof now);
    now.is3 = (int)below(2);
    now.is_cosimulation = below(3) > 0;
    if (!now.is3) {
        now.instance = fmi2Instantiate("fuzz", now.is_cosimulation ? fmi2CoSimulation : fmi2ModelExchange, token, "",
                                       &callbacks, fmi2False, logging);
    } else if (now.is_cosimulation) {
        now.instance = fmi3InstantiateCoSimulation("fuzz", token, "", fmi3False, logging, below(2), below(2), NULL, 0,
                                                   NULL, hear3, below(2) ? between3 : NULL);
    } else {
        now.instance = fmi3InstantiateModelExchange("fuzz", token, "", fmi3False, logging, NULL, hear3);
    }
    if ((now.instance == NULL) != (token != (const char *)qo_token && strcmp(token, qo_token) != 0)) {
        fail("the token decides whether there is an instance");
    }
}

static void sequence(void)
{
    begin();
    for (call_now = 0; now.instance != NULL && call_now < CALLS; call_now++) {
        last_message[0] = '\0';
        switch (below(13)) {
        case 0:
        case 1:
        case 2: change_mode(); break;
        case 3:
        case 4: set_one(); break;
        case 5: get_some(); break;
        case 6: differentiate(); break;
        case 7: save_or_restore(); break;
        case 8: solver_call(); break;
        case 9: set_or_get_array(); break;
        default: do_step();
        }
    }
    if (now.instance != NULL && now.is3) {
        fmi3FreeFMUState(now.instance, &now.state);
        fmi3FreeInstance(now.instance);
    } else if (now.instance != NULL) {
        fmi2FreeFMUstate(now.instance, &now.state);
        fmi2FreeInstance(now.instance);
    }
}

int main(int count, char *arguments[])
{
    unsigned long long first, sequences, i;
    if (count != 3) {
        return 2;
    }
    first = strtoull(arguments[1], NULL, 10);
    sequences = strtoull(arguments[2], NULL, 10);
    for (i = 0; i < sequences; i++) {
        seed_now = first + i;
        random_state = 0x9E3779B97F4A7C15ULL * (seed_now + 1);
        random_bits();
        sequence();
    }
    printf("%llu sequences: %lu OK, %lu discarded, %lu errors\n", sequences, taken[0], taken[2], taken[3]);
    return 0;
}
