/* FMI 2.0.4 on one instance: from instantiation to the end, its values, and saved states. */
#include <string.h>

#include "calls_fmi2.h"

static void write_message(const qo_instance *me, qo_answer status, const char *category, const char *message)
{
    fmi2CallbackLogger logger = (fmi2CallbackLogger)me->callback;
    logger(me->environment, me->name, (fmi2Status)status, category, "%s", message);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    INSTANCE(fmi2SetDebugLogging, QO_ANY_MODE)
    if (nCategories > 0) {
        GIVEN(categories)
    }
    return (fmi2Status)qo_set_logging(me, loggingOn, nCategories, categories);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    qo_instance *me;
    (void)fmuResourceLocation;
    (void)visible;
    if (functions == NULL || (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)) {
        return NULL;
    }
    me = qo_new(fmuType == fmi2CoSimulation ? QO_CO_SIMULATION : QO_MODEL_EXCHANGE, instanceName, loggingOn,
                functions->componentEnvironment, (void (*)(void))functions->logger, write_message);
    if (me == NULL) {
        return NULL;
    }
    if (fmuGUID == NULL || strcmp(fmuGUID, qo_token) != 0) {
        qo_tell(me, QO_ANSWER_ERROR, "The GUID is not that of this model: the description belongs to another FMU.");
        qo_free(me);
        return NULL;
    }
    return me;
}

void fmi2FreeInstance(fmi2Component c)
{
    qo_free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    qo_experiment experiment = {toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime};
    INSTANCE(fmi2SetupExperiment, QO_INSTANTIATED)
    return (fmi2Status)qo_set_up(me, &experiment);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    INSTANCE(fmi2EnterInitializationMode, QO_INSTANTIATED)
    me->now.mode = QO_INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    INSTANCE(fmi2ExitInitializationMode, QO_INITIALIZATION)
    return (fmi2Status)qo_exit_initialization(me, me->interface == QO_CO_SIMULATION ? QO_STEP : QO_EVENT);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    INSTANCE(fmi2Terminate, QO_RUNNING)
    me->now.mode = QO_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    INSTANCE(fmi2Reset, QO_ANY_MODE)
    return (fmi2Status)qo_reset(me);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    INSTANCE(fmi2GetReal, QO_ANY_MODE)
    return (fmi2Status)qo_get(me, vr, nvr, value, nvr);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    INSTANCE(fmi2GetInteger, QO_ANY_MODE)
    return (fmi2Status)qo_get_integers(me, vr, nvr, value, nvr);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    INSTANCE(fmi2GetBoolean, QO_ANY_MODE)
    (void)vr;
    (void)value;
    return (fmi2Status)qo_no_variables(me, "Boolean", nvr);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    INSTANCE(fmi2GetString, QO_ANY_MODE)
    (void)vr;
    (void)value;
    return (fmi2Status)qo_no_variables(me, "String", nvr);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    INSTANCE(fmi2SetReal, SETTABLE)
    return (fmi2Status)qo_set(me, vr, nvr, value, nvr);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    INSTANCE(fmi2SetInteger, SETTABLE)
    (void)vr;
    (void)value;
    return (fmi2Status)qo_no_variables(me, "settable Integer", nvr);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    INSTANCE(fmi2SetBoolean, SETTABLE)
    (void)vr;
    (void)value;
    return (fmi2Status)qo_no_variables(me, "Boolean", nvr);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    INSTANCE(fmi2SetString, SETTABLE)
    (void)vr;
    (void)value;
    return (fmi2Status)qo_no_variables(me, "String", nvr);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    INSTANCE(fmi2GetFMUstate, QO_ANY_MODE)
    return (fmi2Status)qo_save(me, FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    INSTANCE(fmi2SetFMUstate, QO_ANY_MODE)
    return (fmi2Status)qo_restore(me, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    INSTANCE(fmi2FreeFMUstate, QO_ANY_MODE)
    return (fmi2Status)qo_forget(me, FMUstate);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    INSTANCE(fmi2SerializedFMUstateSize, QO_ANY_MODE)
    (void)FMUstate;
    GIVEN(size)
    *size = qo_serialized_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    INSTANCE(fmi2SerializeFMUstate, QO_ANY_MODE)
    return (fmi2Status)qo_serialize(me, FMUstate, serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate)
{
    INSTANCE(fmi2DeSerializeFMUstate, QO_ANY_MODE)
    return (fmi2Status)qo_deserialize(me, serializedState, size, FMUstate);
}
