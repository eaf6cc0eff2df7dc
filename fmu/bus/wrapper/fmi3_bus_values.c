/* Numbers of devices on a bus: those of the plant, noise of the devices, frames that were lost. */
#include "fmi3_bus.h"

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
        return qb_refuse(&bus->plant, reference, "is set by the drives");
    }
    if (own == NULL) {
        return plant_SetFloat64(bus, &reference, 1, &value, 1);
    }
    if (!(value >= 0.0 && value <= 1e3)) {
        return qb_refuse(&bus->plant, reference, "must be from 0 to 1000");
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
            return qb_refuse(me, valueReferences[i], "is no settable Int32");
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
            return qb_refuse(me, valueReferences[i], "is no UInt32");
        }
        values[i] = bus->now.net.lost;
    }
    return nValues == nValueReferences ? fmi3OK : fmi3Error;
}
