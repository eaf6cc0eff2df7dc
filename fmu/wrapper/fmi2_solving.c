/* FMI 2.0.4 on one instance: derivatives, events, the importer's solver, and steps of its own. */
#include <string.h>

#include "calls_fmi2.h"

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
