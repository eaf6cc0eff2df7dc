/* FMI 3.0.1 on one instance: derivatives, events, the importer's solver, and steps of its own. */
#include "calls_fmi3.h"

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
