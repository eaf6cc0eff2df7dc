/* FMI 3.0.1 co-simulation of devices on a bus: the functions of the plant, and in place of some of them those below. */
#include "fmi3Functions.h"

#include "plant_names.h"
#include "plant_fmi3.h"
#include "own_names.h"

#include <math.h>
#include <stdlib.h>

#include "bus.h"

/* The instance as the plant sees it, and as a whole. */
#define BUS(function, modes)                                                                                         \
    INSTANCE(function, modes)                                                                                        \
    qb_bus *bus = instance;

#define MANY(values)                                                                                                 \
    if (nValueReferences > 0) {                                                                                      \
        GIVEN(valueReferences)                                                                                       \
        GIVEN(values)                                                                                                \
    }

#define SAME_INSTANT 1e-6 /* share of a step: importers add up rounding errors */

static fmi3Status refuse(const qo_instance *me, fmi3ValueReference reference, const char *why)
{
    return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "The variable with value reference %u %s.", reference, why);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    if (logMessage != NULL) {
        logMessage(instanceEnvironment, fmi3Error, qo_category_names[0], "Devices on a bus are for co-simulation only.");
    }
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    qo_instance *plant = plant_InstantiateCoSimulation(
        instanceName, instantiationToken, resourcePath, visible, loggingOn, eventModeUsed, earlyReturnAllowed,
        requiredIntermediateVariables, nRequiredIntermediateVariables, instanceEnvironment, logMessage, NULL);
    qb_bus *bus;
    (void)intermediateUpdate;
    if (plant == NULL) {
        return NULL;
    }
    bus = realloc(plant, sizeof *bus);
    if (bus == NULL) {
        qo_free(plant);
        return NULL;
    }
    qb_plant_reset(bus);
    return bus;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    const fmi3Status status = plant_ExitInitializationMode(instance);
    if (status == fmi3OK) {
        qb_plant_start(instance);
    }
    return status;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    const fmi3Status status = plant_Reset(instance);
    if (status == fmi3OK) {
        qb_plant_reset(instance);
    }
    return status;
}

/* Values */

static double *own_real(qb_bus *bus, fmi3ValueReference reference)
{
    switch (reference) {
    case QB_TORQUE_NOISE: return &bus->now.noise.torque;
    case QB_ENCODER_NOISE: return &bus->now.noise.encoder;
    default: return NULL;
    }
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    size_t i;
    BUS(fmi3GetFloat64, QO_READABLE)
    MANY(values)
    if (nValues != nValueReferences) {
        return plant_GetFloat64(instance, valueReferences, nValueReferences, values, nValues);
    }
    for (i = 0; i < nValues; i++) {
        const double *own = own_real(bus, valueReferences[i]);
        const fmi3Status status = own == NULL ? plant_GetFloat64(instance, &valueReferences[i], 1, &values[i], 1) : fmi3OK;
        if (status != fmi3OK) {
            return status;
        }
        values[i] = own == NULL ? values[i] : *own;
    }
    return fmi3OK;
}

static fmi3Status set_real(qb_bus *bus, fmi3ValueReference reference, double value)
{
    double *own = own_real(bus, reference);
    if (qb_is_driven(reference)) {
        return refuse(&bus->plant, reference, "is set by the drives");
    }
    if (own == NULL) {
        return plant_SetFloat64(bus, &reference, 1, &value, 1);
    }
    if (!(value >= 0.0 && value <= 1e3)) {
        return refuse(&bus->plant, reference, "must be from 0 to 1000");
    }
    *own = value;
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    size_t i;
    qo_snapshot plant_before;
    qb_noise noise_before;
    BUS(fmi3SetFloat64, SETTABLE)
    MANY(values)
    if (nValues != nValueReferences) {
        return plant_SetFloat64(instance, valueReferences, nValueReferences, values, nValues);
    }
    plant_before = me->now;
    noise_before = bus->now.noise;
    for (i = 0; i < nValues; i++) {
        const fmi3Status status = set_real(bus, valueReferences[i], values[i]);
        if (status != fmi3OK) {
            me->now = plant_before;
            bus->now.noise = noise_before;
            return status;
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int32 values[], size_t nValues)
{
    size_t i;
    BUS(fmi3GetInt32, QO_READABLE)
    MANY(values)
    for (i = 0; i < nValues && nValues == nValueReferences; i++) {
        if (valueReferences[i] == QB_SEED) {
            values[i] = bus->now.noise.seed;
        } else if (plant_GetInt32(instance, &valueReferences[i], 1, &values[i], 1) != fmi3OK) {
            return fmi3Error;
        }
    }
    return nValues == nValueReferences ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int32 values[], size_t nValues)
{
    size_t i;
    BUS(fmi3SetInt32, QO_INSTANTIATED | QO_INITIALIZATION)
    MANY(values)
    for (i = 0; i < nValues && nValues == nValueReferences; i++) {
        if (valueReferences[i] != QB_SEED) {
            return refuse(me, valueReferences[i], "is no settable Int32");
        }
    }
    if (nValues > 0 && nValues == nValueReferences) {
        bus->now.noise.seed = values[nValues - 1];
    }
    return nValues == nValueReferences ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3UInt32 values[], size_t nValues)
{
    size_t i;
    BUS(fmi3GetUInt32, QO_ANY_MODE)
    MANY(values)
    for (i = 0; i < nValues && nValues == nValueReferences; i++) {
        if (valueReferences[i] != QB_FRAMES_LOST) {
            return refuse(me, valueReferences[i], "is no UInt32");
        }
        values[i] = bus->now.net.lost;
    }
    return nValues == nValueReferences ? fmi3OK : fmi3Error;
}

/* The bus terminal */

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    size_t i;
    BUS(fmi3GetBinary, QO_ANY_MODE)
    MANY(values)
    for (i = 0; i < nValueReferences && i < nValues; i++) {
        const int sends = valueReferences[i] == QB_TX_DATA;
        GIVEN(valueSizes)
        if (!sends && valueReferences[i] != QB_RX_DATA) {
            return refuse(me, valueReferences[i], "is no Binary");
        }
        values[i] = sends ? bus->now.tx : bus->now.rx;
        valueSizes[i] = sends ? (bus->now.tx_ticks ? bus->now.tx_size : 0) : bus->now.rx_size;
    }
    return nValues == nValueReferences ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    size_t i;
    BUS(fmi3SetBinary, QO_INSTANTIATED | QO_INITIALIZATION | QO_EVENT)
    MANY(values)
    for (i = 0; i < nValueReferences && i < nValues; i++) {
        GIVEN(valueSizes)
        if (valueReferences[i] != QB_RX_DATA) {
            return refuse(me, valueReferences[i], "is no settable Binary");
        }
        if (valueSizes[i] > QB_BYTES || (valueSizes[i] > 0 && values[i] == NULL)) {
            return refuse(me, valueReferences[i], "takes no null pointer and no more than its maxSize");
        }
        if (valueSizes[i] > 0 && !bus->now.rx_ticks) {
            return refuse(me, valueReferences[i], "is set while its clock ticks");
        }
        if (valueSizes[i] > 0) {
            memcpy(bus->now.rx, values[i], valueSizes[i]);
        }
        bus->now.rx_size = valueSizes[i];
    }
    return nValues == nValueReferences ? fmi3OK : fmi3Error;
}

/* From now on Tx_Data holds what there is to send. */
static void tick(qb_bus *bus)
{
    if (!bus->now.tx_ticks) {
        qb_give_operations(bus);
        bus->now.tx_ticks = 1;
    }
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[])
{
    size_t i;
    BUS(fmi3GetClock, QO_EVENT)
    MANY(values)
    for (i = 0; i < nValueReferences; i++) {
        if (valueReferences[i] != QB_RX_CLOCK && valueReferences[i] != QB_TX_CLOCK) {
            return refuse(me, valueReferences[i], "is no clock");
        }
        if (QB_TRIGGERED && valueReferences[i] == QB_TX_CLOCK && qb_has_news(bus)) {
            tick(bus);
        }
        values[i] = valueReferences[i] == QB_RX_CLOCK ? bus->now.rx_ticks : bus->now.tx_ticks;
    }
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[])
{
    size_t i;
    BUS(fmi3SetClock, QO_EVENT)
    MANY(values)
    for (i = 0; i < nValueReferences; i++) {
        if (valueReferences[i] == QB_RX_CLOCK) {
            bus->now.rx_ticks = values[i];
        } else if (valueReferences[i] == QB_TX_CLOCK && !QB_TRIGGERED) {
            if (values[i]) {
                tick(bus);
            }
            bus->now.tx_ticks = values[i];
        } else {
            return refuse(me, valueReferences[i], "is no clock that an importer sets");
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    size_t i;
    BUS(fmi3GetIntervalDecimal, QO_INITIALIZATION | QO_EVENT | QO_STEP)
    MANY(intervals)
    for (i = 0; i < nValueReferences; i++) {
        const int64_t due = me->now.mode == QO_INITIALIZATION ? QB_NEVER : qb_next_tick(bus);
        GIVEN(qualifiers)
        if (valueReferences[i] != QB_TX_CLOCK || QB_TRIGGERED) {
            return refuse(me, valueReferences[i], "is no countdown clock");
        }
        intervals[i] = due == QB_NEVER ? 0.0 : (double)(due - bus->now.net.now) / 1e9;
        qualifiers[i] = due == QB_NEVER                 ? fmi3IntervalNotYetKnown
                        : due == bus->now.announced ? fmi3IntervalUnchanged
                                                    : fmi3IntervalChanged;
        bus->now.announced = due;
    }
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    qb_bus *bus = instance;
    const fmi3Status status =
        plant_UpdateDiscreteStates(instance, discreteStatesNeedUpdate, terminateSimulation,
                                   nominalsOfContinuousStatesChanged, valuesOfContinuousStatesChanged,
                                   nextEventTimeDefined, nextEventTime);
    if (status != fmi3OK) {
        return status;
    }
    if (bus->now.tx_ticks) {
        bus->now.tx_size = 0;
        bus->now.announced = QB_NEVER;
    }
    if (bus->now.rx_ticks) {
        qb_take_operations(bus);
    }
    bus->now.rx_ticks = bus->now.tx_ticks = 0;
    bus->now.rx_size = 0;
    *discreteStatesNeedUpdate = QB_TRIGGERED && qb_has_news(bus);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime)
{
    const double time = currentCommunicationPoint, size = communicationStepSize, end = time + size;
    qo_model model_before;
    qb_network net_before;
    BUS(fmi3DoStep, QO_STEP)
    (void)noSetFMUStatePriorToCurrentPoint;
    GIVEN(eventHandlingNeeded)
    GIVEN(terminateSimulation)
    GIVEN(earlyReturn)
    GIVEN(lastSuccessfulTime)
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = me->now.time;
    /* A step that takes no time does nothing: importers take one where Tx_Clock is to tick at once. */
    if (!(size >= 0.0 && fabs(end) < 1e9 && fabs(time - me->now.time) <= SAME_INSTANT * size + 1e-12 * fabs(time))) {
        return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR,
                                   "A step must begin where the last one ended, at %.17g, go forward, and end before 1e9 s.",
                                   me->now.time);
    }
    model_before = me->now.model;
    net_before = bus->now.net;
    if (!qb_advance(&bus->now.net, llround((end - bus->now.start_time) * 1e9), qb_plant_move, bus)) {
        me->now.model = model_before;
        bus->now.net = net_before;
        return fmi3Discard;
    }
    me->now.time = *lastSuccessfulTime = end;
    *eventHandlingNeeded = me->events_told && bus->now.net.queued > 0;
    return fmi3OK;
}

/* Saved states are copies; what has been saved as bytes could not be trusted, so there is none. */
typedef struct {
    unsigned char mark[QO_MARK_SIZE];
    qo_snapshot plant;
    qb_state bus;
} saved_bus;

static int is_saved_bus(const qo_instance *me, const saved_bus *state)
{
    if (state == NULL || memcmp(state->mark, qo_mark, QO_MARK_SIZE) != 0) {
        qo_tell(me, QO_ANSWER_ERROR, "That is no saved state of this model.");
        return 0;
    }
    return 1;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    saved_bus *copy;
    BUS(fmi3GetFMUState, QO_ANY_MODE)
    GIVEN(FMUState)
    if (*FMUState != NULL && !is_saved_bus(me, *FMUState)) {
        return fmi3Error;
    }
    copy = *FMUState == NULL ? malloc(sizeof *copy) : *FMUState;
    if (copy == NULL) {
        return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "There is no memory for a saved state.");
    }
    memcpy(copy->mark, qo_mark, QO_MARK_SIZE);
    copy->plant = me->now;
    copy->bus = bus->now;
    *FMUState = copy;
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    const saved_bus *copy = FMUState;
    BUS(fmi3SetFMUState, QO_ANY_MODE)
    if (!is_saved_bus(me, copy)) {
        return fmi3Error;
    }
    me->now = copy->plant;
    bus->now = copy->bus;
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    INSTANCE(fmi3FreeFMUState, QO_ANY_MODE)
    if (FMUState != NULL && *FMUState != NULL) {
        if (!is_saved_bus(me, *FMUState)) {
            return fmi3Error;
        }
        free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}

static fmi3Status no_bytes(const qo_instance *me)
{
    return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "States of this model are not saved as bytes.");
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    INSTANCE(fmi3SerializedFMUStateSize, QO_ANY_MODE)
    (void)FMUState, (void)size;
    return no_bytes(me);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    INSTANCE(fmi3SerializeFMUState, QO_ANY_MODE)
    (void)FMUState, (void)serializedState, (void)size;
    return no_bytes(me);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    INSTANCE(fmi3DeserializeFMUState, QO_ANY_MODE)
    (void)FMUState, (void)serializedState, (void)size;
    return no_bytes(me);
}
