/* The functions of FMI 3.0 of the plant that the bus puts its own in place of, by the names of plant_names.h. */
#ifndef QB_PLANT_FUNCTIONS_H
#define QB_PLANT_FUNCTIONS_H

#include "fmi3Functions.h"

fmi3ExitInitializationModeTYPE plant_ExitInitializationMode;
fmi3GetFloat64TYPE plant_GetFloat64;
fmi3GetInt32TYPE plant_GetInt32;
fmi3InstantiateCoSimulationTYPE plant_InstantiateCoSimulation;
fmi3ResetTYPE plant_Reset;
fmi3SetFloat64TYPE plant_SetFloat64;
fmi3UpdateDiscreteStatesTYPE plant_UpdateDiscreteStates;

#endif
