/* FMI 3.0.1 on one instance: from instantiation to the end, and saved states. */
#include <string.h>

#include "calls_fmi3.h"

static void write_message(const qo_instance *me, qo_answer status, const char *category, const char *message)
{
    fmi3LogMessageCallback log_message = (fmi3LogMessageCallback)me->callback;
    log_message(me->environment, (fmi3Status)status, category, message);
}

/* Offers the importer the outputs of an internal step and asks for its inputs; not zero where it asks to end the step
 * there. */
static int intermediate_update(qo_instance *me)
{
    fmi3IntermediateUpdateCallback update = (fmi3IntermediateUpdateCallback)me->intermediate;
    fmi3Boolean requested = fmi3False;
    fmi3Float64 return_time = me->now.time;
    update(me->environment, me->now.time, fmi3True, fmi3True, fmi3True, me->early_return != 0, &requested,
           &return_time);
    return me->early_return && requested;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    INSTANCE(fmi3SetDebugLogging, QO_READABLE)
    if (nCategories > 0) {
        GIVEN(categories)
    }
    return (fmi3Status)qo_set_logging(me, loggingOn, nCategories, categories);
}

static qo_instance *instantiate(qo_interface interface, fmi3String name, fmi3String token, fmi3Boolean logging,
                                fmi3InstanceEnvironment environment, fmi3LogMessageCallback log_message)
{
    qo_instance *me =
        qo_new(interface, name, logging, environment, (void (*)(void))log_message, write_message);
    if (me != NULL && (token == NULL || strcmp(token, qo_token) != 0)) {
        qo_tell(me, QO_ANSWER_ERROR, "The instantiation token is not that of this model: the description belongs to "
                                     "another FMU.");
        qo_free(me);
        return NULL;
    }
    return me;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    (void)resourcePath;
    (void)visible;
    return instantiate(QO_MODEL_EXCHANGE, instanceName, instantiationToken, loggingOn, instanceEnvironment,
                       logMessage);
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
    qo_instance *me = instantiate(QO_CO_SIMULATION, instanceName, instantiationToken, loggingOn, instanceEnvironment,
                                  logMessage);
    (void)resourcePath;
    (void)visible;
    (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables;
    if (me != NULL) {
        me->events_told = eventModeUsed;
        me->early_return = earlyReturnAllowed;
        me->intermediate = (void (*)(void))intermediateUpdate;
        me->between = intermediateUpdate == NULL ? NULL : intermediate_update;
    }
    return me;
}

/* The model has no clocks, so there is nothing to schedule. */
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instanceName;
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    if (logMessage != NULL) {
        logMessage(instanceEnvironment, fmi3Error, qo_category_names[0], "Scheduled execution is not supported.");
    }
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    qo_free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    qo_experiment experiment = {toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime};
    qo_answer answer;
    INSTANCE(fmi3EnterInitializationMode, QO_INSTANTIATED)
    answer = qo_set_up(me, &experiment);
    if (answer == QO_ANSWER_OK) {
        me->now.mode = QO_INITIALIZATION;
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    INSTANCE(fmi3ExitInitializationMode, QO_INITIALIZATION)
    return (fmi3Status)qo_exit_initialization(
        me, me->interface == QO_CO_SIMULATION && !me->events_told ? QO_STEP : QO_EVENT);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    INSTANCE(fmi3EnterEventMode, QO_EVENT | QO_CONTINUOUS_TIME | QO_STEP)
    if (me->interface == QO_CO_SIMULATION && !me->events_told) {
        return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "fmi3EnterEventMode needs eventModeUsed at instantiation.");
    }
    me->now.mode = QO_EVENT;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    INSTANCE(fmi3Terminate, QO_RUNNING)
    me->now.mode = QO_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    INSTANCE(fmi3Reset, QO_ANY_MODE)
    return (fmi3Status)qo_reset(me);
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    INSTANCE(fmi3GetFMUState, QO_ANY_MODE)
    return (fmi3Status)qo_save(me, FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    INSTANCE(fmi3SetFMUState, QO_ANY_MODE)
    return (fmi3Status)qo_restore(me, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    INSTANCE(fmi3FreeFMUState, QO_ANY_MODE)
    return (fmi3Status)qo_forget(me, FMUState);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    INSTANCE(fmi3SerializedFMUStateSize, QO_ANY_MODE)
    (void)FMUState;
    GIVEN(size)
    *size = qo_serialized_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size)
{
    INSTANCE(fmi3SerializeFMUState, QO_ANY_MODE)
    return (fmi3Status)qo_serialize(me, FMUState, (char *)serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    INSTANCE(fmi3DeserializeFMUState, QO_ANY_MODE)
    return (fmi3Status)qo_deserialize(me, (const char *)serializedState, size, FMUState);
}
