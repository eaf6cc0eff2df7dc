/* After fmi3.c: the functions of the standard by their names again. */
#undef fmi3InstantiateModelExchange
#define fmi3InstantiateModelExchange fmi3FullName(fmi3InstantiateModelExchange)
#undef fmi3InstantiateCoSimulation
#define fmi3InstantiateCoSimulation fmi3FullName(fmi3InstantiateCoSimulation)
#undef fmi3ExitInitializationMode
#define fmi3ExitInitializationMode fmi3FullName(fmi3ExitInitializationMode)
#undef fmi3Reset
#define fmi3Reset fmi3FullName(fmi3Reset)
#undef fmi3GetFloat64
#define fmi3GetFloat64 fmi3FullName(fmi3GetFloat64)
#undef fmi3SetFloat64
#define fmi3SetFloat64 fmi3FullName(fmi3SetFloat64)
#undef fmi3GetInt32
#define fmi3GetInt32 fmi3FullName(fmi3GetInt32)
#undef fmi3SetInt32
#define fmi3SetInt32 fmi3FullName(fmi3SetInt32)
#undef fmi3GetUInt32
#define fmi3GetUInt32 fmi3FullName(fmi3GetUInt32)
#undef fmi3GetBinary
#define fmi3GetBinary fmi3FullName(fmi3GetBinary)
#undef fmi3SetBinary
#define fmi3SetBinary fmi3FullName(fmi3SetBinary)
#undef fmi3GetClock
#define fmi3GetClock fmi3FullName(fmi3GetClock)
#undef fmi3SetClock
#define fmi3SetClock fmi3FullName(fmi3SetClock)
#undef fmi3GetIntervalDecimal
#define fmi3GetIntervalDecimal fmi3FullName(fmi3GetIntervalDecimal)
#undef fmi3UpdateDiscreteStates
#define fmi3UpdateDiscreteStates fmi3FullName(fmi3UpdateDiscreteStates)
#undef fmi3GetFMUState
#define fmi3GetFMUState fmi3FullName(fmi3GetFMUState)
#undef fmi3SetFMUState
#define fmi3SetFMUState fmi3FullName(fmi3SetFMUState)
#undef fmi3FreeFMUState
#define fmi3FreeFMUState fmi3FullName(fmi3FreeFMUState)
#undef fmi3SerializedFMUStateSize
#define fmi3SerializedFMUStateSize fmi3FullName(fmi3SerializedFMUStateSize)
#undef fmi3SerializeFMUState
#define fmi3SerializeFMUState fmi3FullName(fmi3SerializeFMUState)
#undef fmi3DeserializeFMUState
#define fmi3DeserializeFMUState fmi3FullName(fmi3DeserializeFMUState)
#undef fmi3DoStep
#define fmi3DoStep fmi3FullName(fmi3DoStep)
