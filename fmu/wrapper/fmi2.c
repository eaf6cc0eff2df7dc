/* FMI 2.0.4 on one instance. */
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "instance.h"

#define INSTANCE(function, modes)                                                                                    \
    qo_instance *me = c;                                                                                             \
    if (me == NULL || !qo_allowed(me, #function, modes)) {                                                           \
        return fmi2Error;                                                                                            \
    }

#define INSTANCE_AS(function, interface, modes)                                                                      \
    qo_instance *me = c;                                                                                             \
    if (me == NULL || !qo_allowed_as(me, #function, interface, modes)) {                                             \
        return fmi2Error;                                                                                            \
    }

/* A pointer that the importer must give. */
#define GIVEN(pointer)                                                                                               \
    if ((pointer) == NULL) {                                                                                         \
        return (fmi2Status)qo_tell(me, QO_ANSWER_ERROR, "%s is a null pointer.", #pointer);                          \
    }

#define SETTABLE (QO_INSTANTIATED | QO_INITIALIZATION | QO_RUNNING)

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
    if (fmuGUID == NULL || strcmp(fmuGUID, QO_TOKEN) != 0) {
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

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    INSTANCE(fmi2GetDirectionalDerivative, QO_INITIALIZATION | QO_RUNNING | QO_TERMINATED)
    return (fmi2Status)qo_directional(me, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, nKnown, dvUnknown,
                                      nUnknown);
}

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    INSTANCE_AS(fmi2EnterEventMode, QO_MODEL_EXCHANGE, QO_EVENT | QO_CONTINUOUS_TIME)
    me->now.mode = QO_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo)
{
    int changed;
    INSTANCE_AS(fmi2NewDiscreteStates, QO_MODEL_EXCHANGE, QO_EVENT)
    GIVEN(eventInfo)
    memset(eventInfo, 0, sizeof *eventInfo);
    return (fmi2Status)qo_update(me, &changed);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    INSTANCE_AS(fmi2EnterContinuousTimeMode, QO_MODEL_EXCHANGE, QO_EVENT)
    me->now.mode = QO_CONTINUOUS_TIME;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    INSTANCE_AS(fmi2CompletedIntegratorStep, QO_MODEL_EXCHANGE, QO_CONTINUOUS_TIME)
    (void)noSetFMUStatePriorToCurrentPoint;
    GIVEN(enterEventMode)
    GIVEN(terminateSimulation)
    *enterEventMode = *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    INSTANCE_AS(fmi2SetTime, QO_MODEL_EXCHANGE, QO_EVENT | QO_CONTINUOUS_TIME)
    return (fmi2Status)qo_set_time(me, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    INSTANCE_AS(fmi2SetContinuousStates, QO_MODEL_EXCHANGE, QO_CONTINUOUS_TIME)
    return (fmi2Status)qo_set_states(me, x, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    INSTANCE_AS(fmi2GetDerivatives, QO_MODEL_EXCHANGE, QO_INITIALIZATION | QO_EVENT | QO_CONTINUOUS_TIME | QO_TERMINATED)
    return (fmi2Status)qo_get_derivatives(me, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    INSTANCE_AS(fmi2GetEventIndicators, QO_MODEL_EXCHANGE,
                QO_INITIALIZATION | QO_EVENT | QO_CONTINUOUS_TIME | QO_TERMINATED)
    return (fmi2Status)qo_get_indicators(me, eventIndicators, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    INSTANCE_AS(fmi2GetContinuousStates, QO_MODEL_EXCHANGE,
                QO_INITIALIZATION | QO_EVENT | QO_CONTINUOUS_TIME | QO_TERMINATED)
    return (fmi2Status)qo_get_states(me, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    INSTANCE_AS(fmi2GetNominalsOfContinuousStates, QO_MODEL_EXCHANGE, QO_ANY_MODE)
    return (fmi2Status)qo_get_nominals(me, x_nominal, nx);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    INSTANCE_AS(fmi2SetRealInputDerivatives, QO_CO_SIMULATION, QO_INSTANTIATED | QO_INITIALIZATION | QO_STEP)
    return (fmi2Status)qo_set_input_rates(me, vr, nvr, order, value);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    INSTANCE_AS(fmi2GetRealOutputDerivatives, QO_CO_SIMULATION, QO_STEP | QO_TERMINATED)
    return (fmi2Status)qo_output_derivatives(me, vr, nvr, order, value, nvr);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    qo_step_end end;
    INSTANCE_AS(fmi2DoStep, QO_CO_SIMULATION, QO_STEP)
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)qo_do_step(me, currentCommunicationPoint, communicationStepSize, &end);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    INSTANCE_AS(fmi2CancelStep, QO_CO_SIMULATION, 0)
    return fmi2Error;
}

/* Steps are never pending: what remains is the time that was reached, and whether the simulation goes on. */
static fmi2Status no_status(const qo_instance *me)
{
    return (fmi2Status)qo_tell(me, QO_ANSWER_DISCARD, "There is no such status: steps are never pending.");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    INSTANCE_AS(fmi2GetStatus, QO_CO_SIMULATION, QO_STEP | QO_TERMINATED)
    (void)s;
    (void)value;
    return no_status(me);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    INSTANCE_AS(fmi2GetRealStatus, QO_CO_SIMULATION, QO_STEP | QO_TERMINATED)
    GIVEN(value)
    if (s != fmi2LastSuccessfulTime) {
        return no_status(me);
    }
    *value = me->now.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    INSTANCE_AS(fmi2GetIntegerStatus, QO_CO_SIMULATION, QO_STEP | QO_TERMINATED)
    (void)s;
    (void)value;
    return no_status(me);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    INSTANCE_AS(fmi2GetBooleanStatus, QO_CO_SIMULATION, QO_STEP | QO_TERMINATED)
    GIVEN(value)
    if (s != fmi2Terminated) {
        return no_status(me);
    }
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    INSTANCE_AS(fmi2GetStringStatus, QO_CO_SIMULATION, QO_STEP | QO_TERMINATED)
    (void)s;
    (void)value;
    return no_status(me);
}
