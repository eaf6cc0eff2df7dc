/* After the header of FMI 3.0, before the functions of the plant: what they call these is reached under other names. */
#undef fmi3InstantiateModelExchange
#define fmi3InstantiateModelExchange plant_InstantiateModelExchange
#undef fmi3InstantiateCoSimulation
#define fmi3InstantiateCoSimulation plant_InstantiateCoSimulation
#undef fmi3ExitInitializationMode
#define fmi3ExitInitializationMode plant_ExitInitializationMode
#undef fmi3Reset
#define fmi3Reset plant_Reset
#undef fmi3GetFloat64
#define fmi3GetFloat64 plant_GetFloat64
#undef fmi3SetFloat64
#define fmi3SetFloat64 plant_SetFloat64
#undef fmi3GetInt32
#define fmi3GetInt32 plant_GetInt32
#undef fmi3SetInt32
#define fmi3SetInt32 plant_SetInt32
#undef fmi3GetUInt32
#define fmi3GetUInt32 plant_GetUInt32
#undef fmi3GetBinary
#define fmi3GetBinary plant_GetBinary
#undef fmi3SetBinary
#define fmi3SetBinary plant_SetBinary
#undef fmi3GetClock
#define fmi3GetClock plant_GetClock
#undef fmi3SetClock
#define fmi3SetClock plant_SetClock
#undef fmi3GetIntervalDecimal
#define fmi3GetIntervalDecimal plant_GetIntervalDecimal
#undef fmi3UpdateDiscreteStates
#define fmi3UpdateDiscreteStates plant_UpdateDiscreteStates
#undef fmi3GetFMUState
#define fmi3GetFMUState plant_GetFMUState
#undef fmi3SetFMUState
#define fmi3SetFMUState plant_SetFMUState
#undef fmi3FreeFMUState
#define fmi3FreeFMUState plant_FreeFMUState
#undef fmi3SerializedFMUStateSize
#define fmi3SerializedFMUStateSize plant_SerializedFMUStateSize
#undef fmi3SerializeFMUState
#define fmi3SerializeFMUState plant_SerializeFMUState
#undef fmi3DeserializeFMUState
#define fmi3DeserializeFMUState plant_DeserializeFMUState
#undef fmi3DoStep
#define fmi3DoStep plant_DoStep
