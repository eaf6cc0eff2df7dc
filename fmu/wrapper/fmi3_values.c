/* FMI 3.0.1 on one instance: values of its variables, and all types that it has none of. */
#include "calls_fmi3.h"

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
