/* The functions of FMI 3.0 of the plant. Those that the bus puts its own in place of are reached under other names. */
#include "fmi3Functions.h"

#include "plant_names.h"

#include "plant_fmi3.h"
#include "plant_fmi3_solving.h"
#include "plant_fmi3_values.h"
