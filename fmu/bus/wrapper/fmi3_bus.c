/* FMI 3.0.1 co-simulation of devices on a bus: instances and steps. What is not here and beside it is the plant's. */
#include <math.h>
#include <stdlib.h>

#include "fmi3_bus.h"

#define SAME_INSTANT 1e-6 /* share of a step: importers add up rounding errors */

fmi3Status qb_refuse(const qo_instance *me, fmi3ValueReference reference, const char *why)
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
