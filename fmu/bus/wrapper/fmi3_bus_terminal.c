/* The bus terminal: its binary variables and their clocks, and what happens where they tick. */
#include <string.h>

#include "fmi3_bus.h"

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
            return qb_refuse(me, valueReferences[i], "is no Binary");
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
            return qb_refuse(me, valueReferences[i], "is no settable Binary");
        }
        if (valueSizes[i] > QB_BYTES || (valueSizes[i] > 0 && values[i] == NULL)) {
            return qb_refuse(me, valueReferences[i], "takes no null pointer and no more than its maxSize");
        }
        if (valueSizes[i] > 0 && !bus->now.rx_ticks) {
            return qb_refuse(me, valueReferences[i], "is set while its clock ticks");
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
            return qb_refuse(me, valueReferences[i], "is no clock");
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
            return qb_refuse(me, valueReferences[i], "is no clock that an importer sets");
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
            return qb_refuse(me, valueReferences[i], "is no countdown clock");
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
