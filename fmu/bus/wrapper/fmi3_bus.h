/* What the functions of FMI 3.0 of devices on a bus have in common. */
#ifndef QB_FMI3_BUS_H
#define QB_FMI3_BUS_H

#include "bus.h"
#include "calls_fmi3.h"
#include "plant_functions.h"

/* The instance as the plant sees it, and as a whole. */
#define BUS(function, modes)                                                                                         \
    INSTANCE(function, modes)                                                                                        \
    qb_bus *bus = instance;

#define MANY(values)                                                                                                 \
    if (nValueReferences > 0) {                                                                                      \
        GIVEN(valueReferences)                                                                                       \
        GIVEN(values)                                                                                                \
    }

/* An error that names a variable. */
fmi3Status qb_refuse(const qo_instance *me, fmi3ValueReference reference, const char *why);

#endif
