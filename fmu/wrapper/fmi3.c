/* FMI 3.0.1 on one instance. */
#include <string.h>

#include "arrays.h"
#include "fmi3Functions.h"
#include "instance.h"

#define INSTANCE(function, modes)                                                                                    \
    qo_instance *me = instance;                                                                                      \
    if (me == NULL || !qo_allowed(me, #function, modes)) {                                                           \
        return fmi3Error;                                                                                            \
    }

#define INSTANCE_AS(function, interface, modes)                                                                      \
    qo_instance *me = instance;                                                                                      \
    if (me == NULL || !qo_allowed_as(me, #function, interface, modes)) {                                             \
        return fmi3Error;                                                                                            \
    }

/* A pointer that the importer must give. */
#define GIVEN(pointer)                                                                                               \
    if ((pointer) == NULL) {                                                                                         \
        return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "%s is a null pointer.", #pointer);                          \
    }

/* Scalars that value references stand for. */
#define SCALARS(found, references, orders, n)                                                                        \
    if (!qo_scalars_of(me, references, orders, n, &(found))) {                                                       \
        return fmi3Error;                                                                                            \
    }

#define SETTABLE (QO_INSTANTIATED | QO_INITIALIZATION | QO_RUNNING)
#define SOLVING (QO_INITIALIZATION | QO_EVENT | QO_CONTINUOUS_TIME | QO_TERMINATED)

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
    if (me != NULL && (token == NULL || strcmp(token, QO_TOKEN) != 0)) {
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

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    qo_scalars of;
    qo_answer answer;
    INSTANCE(fmi3GetFloat64, QO_READABLE)
    SCALARS(of, valueReferences, NULL, nValueReferences)
    answer = qo_get(me, of.references, of.n, values, nValues);
    qo_scalars_free(&of);
    return (fmi3Status)answer;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    qo_scalars of;
    qo_answer answer;
    INSTANCE(fmi3SetFloat64, SETTABLE | QO_UPDATING)
    if (!qo_settable_arrays(me, valueReferences, nValueReferences)) {
        return fmi3Error;
    }
    SCALARS(of, valueReferences, NULL, nValueReferences)
    answer = qo_set(me, of.references, of.n, values, nValues);
    qo_scalars_free(&of);
    return (fmi3Status)answer;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int32 values[], size_t nValues)
{
    INSTANCE(fmi3GetInt32, QO_READABLE)
    return (fmi3Status)qo_get_integers(me, valueReferences, nValueReferences, values, nValues);
}

/* Types that the model has no variables of, and those that nobody may set. */
#define NO_VARIABLES(Type, name)                                                                                     \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                      \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues)                           \
    {                                                                                                                \
        INSTANCE(fmi3Get##Type, QO_ANY_MODE)                                                                         \
        (void)valueReferences, (void)values, (void)nValues;                                                          \
        return (fmi3Status)qo_no_variables(me, name, nValueReferences);                                              \
    }                                                                                                                \
    CANNOT_SET(Type, name)

#define CANNOT_SET(Type, name)                                                                                       \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                      \
                             size_t nValueReferences, const fmi3##Type values[], size_t nValues)                     \
    {                                                                                                                \
        INSTANCE(fmi3Set##Type, SETTABLE)                                                                            \
        (void)valueReferences, (void)values, (void)nValues;                                                          \
        return (fmi3Status)qo_no_variables(me, name, nValueReferences);                                              \
    }

NO_VARIABLES(Float32, "Float32")
NO_VARIABLES(Int8, "Int8")
NO_VARIABLES(UInt8, "UInt8")
NO_VARIABLES(Int16, "Int16")
NO_VARIABLES(UInt16, "UInt16")
CANNOT_SET(Int32, "settable Int32")
NO_VARIABLES(UInt32, "UInt32")
NO_VARIABLES(Int64, "Int64")
NO_VARIABLES(UInt64, "UInt64")
NO_VARIABLES(Boolean, "Boolean")
NO_VARIABLES(String, "String")

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    INSTANCE(fmi3GetBinary, QO_ANY_MODE)
    (void)valueReferences, (void)valueSizes, (void)values, (void)nValues;
    return (fmi3Status)qo_no_variables(me, "Binary", nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    INSTANCE(fmi3SetBinary, SETTABLE)
    (void)valueReferences, (void)valueSizes, (void)values, (void)nValues;
    return (fmi3Status)qo_no_variables(me, "Binary", nValueReferences);
}

/* Clocks: there are none. */
#define NO_CLOCKS(function, parameters, unused)                                                                      \
    fmi3Status function parameters                                                                                   \
    {                                                                                                                \
        INSTANCE(function, QO_ANY_MODE)                                                                              \
        unused;                                                                                                      \
        return (fmi3Status)qo_no_variables(me, "clock", nValueReferences);                                           \
    }

#define REFERENCES fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences

NO_CLOCKS(fmi3GetClock, (REFERENCES, fmi3Clock values[]), ((void)valueReferences, (void)values))
NO_CLOCKS(fmi3SetClock, (REFERENCES, const fmi3Clock values[]), ((void)valueReferences, (void)values))
NO_CLOCKS(fmi3GetIntervalDecimal, (REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]),
          ((void)valueReferences, (void)intervals, (void)qualifiers))
NO_CLOCKS(fmi3GetIntervalFraction,
          (REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]),
          ((void)valueReferences, (void)counters, (void)resolutions, (void)qualifiers))
NO_CLOCKS(fmi3GetShiftDecimal, (REFERENCES, fmi3Float64 shifts[]), ((void)valueReferences, (void)shifts))
NO_CLOCKS(fmi3GetShiftFraction, (REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]),
          ((void)valueReferences, (void)counters, (void)resolutions))
NO_CLOCKS(fmi3SetIntervalDecimal, (REFERENCES, const fmi3Float64 intervals[]),
          ((void)valueReferences, (void)intervals))
NO_CLOCKS(fmi3SetIntervalFraction, (REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
          ((void)valueReferences, (void)counters, (void)resolutions))
NO_CLOCKS(fmi3SetShiftDecimal, (REFERENCES, const fmi3Float64 shifts[]), ((void)valueReferences, (void)shifts))
NO_CLOCKS(fmi3SetShiftFraction, (REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
          ((void)valueReferences, (void)counters, (void)resolutions))

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime)
{
    INSTANCE(fmi3ActivateModelPartition, QO_ANY_MODE)
    (void)clockReference, (void)activationTime;
    return (fmi3Status)qo_no_variables(me, "clock", 1);
}

/* The description tells the dependencies, and they never change. */
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies)
{
    INSTANCE(fmi3GetNumberOfVariableDependencies, QO_ANY_MODE)
    (void)valueReference, (void)nDependencies;
    return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "Dependencies are those of the model description.");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies)
{
    INSTANCE(fmi3GetVariableDependencies, QO_ANY_MODE)
    (void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents;
    (void)dependencyKinds, (void)nDependencies;
    return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "Dependencies are those of the model description.");
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

typedef qo_answer (*derivative)(qo_instance *me, const unsigned unknowns[], size_t n_unknowns,
                                const unsigned knowns[], size_t n_knowns, const double seed[], size_t n_seed,
                                double result[], size_t n_result);

/* Derivatives of one kind between variables that may be arrays. */
static fmi3Status between(qo_instance *me, derivative function, const fmi3ValueReference unknowns[], size_t n_unknowns,
                          const fmi3ValueReference knowns[], size_t n_knowns, const double seed[], size_t n_seed,
                          double result[], size_t n_result)
{
    qo_scalars of, by;
    qo_answer answer;
    SCALARS(of, unknowns, NULL, n_unknowns)
    if (!qo_scalars_of(me, knowns, NULL, n_knowns, &by)) {
        qo_scalars_free(&of);
        return fmi3Error;
    }
    answer = function(me, of.references, of.n, by.references, by.n, seed, n_seed, result, n_result);
    qo_scalars_free(&of);
    qo_scalars_free(&by);
    return (fmi3Status)answer;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    INSTANCE(fmi3GetDirectionalDerivative, QO_INITIALIZATION | QO_RUNNING | QO_UPDATING | QO_TERMINATED)
    return between(me, qo_directional, unknowns, nUnknowns, knowns, nKnowns, seed, nSeed, sensitivity, nSensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    INSTANCE(fmi3GetAdjointDerivative, QO_INITIALIZATION | QO_RUNNING | QO_UPDATING | QO_TERMINATED)
    return between(me, qo_adjoint, unknowns, nUnknowns, knowns, nKnowns, seed, nSeed, sensitivity, nSensitivity);
}

/* There are no structural parameters. */
fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    INSTANCE(fmi3EnterConfigurationMode, 0)
    return fmi3Error;
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    INSTANCE(fmi3ExitConfigurationMode, 0)
    return fmi3Error;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    INSTANCE(fmi3EvaluateDiscreteStates, QO_INITIALIZATION | QO_EVENT)
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    int changed;
    INSTANCE(fmi3UpdateDiscreteStates, QO_EVENT)
    GIVEN(discreteStatesNeedUpdate)
    GIVEN(terminateSimulation)
    GIVEN(nominalsOfContinuousStatesChanged)
    GIVEN(valuesOfContinuousStatesChanged)
    GIVEN(nextEventTimeDefined)
    GIVEN(nextEventTime)
    *discreteStatesNeedUpdate = *terminateSimulation = *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0.0;
    return (fmi3Status)qo_update(me, &changed);
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    INSTANCE_AS(fmi3EnterContinuousTimeMode, QO_MODEL_EXCHANGE, QO_EVENT)
    me->now.mode = QO_CONTINUOUS_TIME;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    INSTANCE_AS(fmi3CompletedIntegratorStep, QO_MODEL_EXCHANGE, QO_CONTINUOUS_TIME)
    (void)noSetFMUStatePriorToCurrentPoint;
    GIVEN(enterEventMode)
    GIVEN(terminateSimulation)
    *enterEventMode = *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    INSTANCE_AS(fmi3SetTime, QO_MODEL_EXCHANGE, QO_EVENT | QO_CONTINUOUS_TIME)
    return (fmi3Status)qo_set_time(me, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    INSTANCE_AS(fmi3SetContinuousStates, QO_MODEL_EXCHANGE, QO_CONTINUOUS_TIME)
    return (fmi3Status)qo_set_states(me, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates)
{
    INSTANCE_AS(fmi3GetContinuousStateDerivatives, QO_MODEL_EXCHANGE, SOLVING)
    return (fmi3Status)qo_get_derivatives(me, derivatives, nContinuousStates);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    INSTANCE_AS(fmi3GetEventIndicators, QO_MODEL_EXCHANGE, SOLVING)
    return (fmi3Status)qo_get_indicators(me, eventIndicators, nEventIndicators);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    INSTANCE_AS(fmi3GetContinuousStates, QO_MODEL_EXCHANGE, SOLVING)
    return (fmi3Status)qo_get_states(me, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    INSTANCE_AS(fmi3GetNominalsOfContinuousStates, QO_MODEL_EXCHANGE, QO_ANY_MODE)
    return (fmi3Status)qo_get_nominals(me, nominals, nContinuousStates);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    INSTANCE_AS(fmi3GetNumberOfEventIndicators, QO_MODEL_EXCHANGE, QO_ANY_MODE)
    GIVEN(nEventIndicators)
    *nEventIndicators = QO_NZ;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    INSTANCE_AS(fmi3GetNumberOfContinuousStates, QO_MODEL_EXCHANGE, QO_ANY_MODE)
    GIVEN(nContinuousStates)
    *nContinuousStates = QO_NX;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    INSTANCE_AS(fmi3EnterStepMode, QO_CO_SIMULATION, QO_EVENT)
    me->now.mode = QO_STEP;
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues)
{
    qo_scalars of;
    qo_answer answer;
    INSTANCE_AS(fmi3GetOutputDerivatives, QO_CO_SIMULATION, QO_STEP | QO_UPDATING | QO_TERMINATED)
    SCALARS(of, valueReferences, orders, nValueReferences)
    answer = qo_output_derivatives(me, of.references, of.n, of.orders, values, nValues);
    qo_scalars_free(&of);
    return (fmi3Status)answer;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime)
{
    qo_step_end end;
    qo_answer answer;
    INSTANCE_AS(fmi3DoStep, QO_CO_SIMULATION, QO_STEP)
    (void)noSetFMUStatePriorToCurrentPoint;
    GIVEN(eventHandlingNeeded)
    GIVEN(terminateSimulation)
    GIVEN(earlyReturn)
    GIVEN(lastSuccessfulTime)
    answer = qo_do_step(me, currentCommunicationPoint, communicationStepSize, &end);
    *eventHandlingNeeded = end.event != 0;
    *terminateSimulation = fmi3False;
    *earlyReturn = end.early != 0;
    *lastSuccessfulTime = end.time;
    return (fmi3Status)answer;
}
