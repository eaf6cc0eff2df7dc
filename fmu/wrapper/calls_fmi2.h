/* What the functions of FMI 2.0 begin with: whether they may be called now, and what they must be given. */
#ifndef QO_FMI2_CALLS_H
#define QO_FMI2_CALLS_H

#include "fmi2Functions.h"
#include "instance.h"

#define INSTANCE(function, modes)                                                                                    \
    qo_instance *me = c;                                                                                             \
    if (me == NULL || !qo_allowed(me, #function, modes)) {                                                           \
        return fmi2Error;                                                                                            \
    }

#define INSTANCE_AS(function, interface, modes)                                                                      \
    qo_instance *me = c;                                                                                             \
    if (me == NULL || !qo_allowed_as(me, #function, interface, modes)) {                                             \
        return fmi2Error;                                                                                            \
    }

/* A pointer that the importer must give. */
#define GIVEN(pointer)                                                                                               \
    if ((pointer) == NULL) {                                                                                         \
        return (fmi2Status)qo_tell(me, QO_ANSWER_ERROR, "%s is a null pointer.", #pointer);                          \
    }

#define SETTABLE (QO_INSTANTIATED | QO_INITIALIZATION | QO_RUNNING)

#endif
