/* What the functions of FMI 3.0 begin with: whether they may be called now, and what they must be given. */
#ifndef QO_FMI3_CALLS_H
#define QO_FMI3_CALLS_H

#include "arrays.h"
#include "fmi3Functions.h"
#include "instance.h"

#define INSTANCE(function, modes)                                                                                    \
    qo_instance *me = instance;                                                                                      \
    if (me == NULL || !qo_allowed(me, #function, modes)) {                                                           \
        return fmi3Error;                                                                                            \
    }

#define INSTANCE_AS(function, interface, modes)                                                                      \
    qo_instance *me = instance;                                                                                      \
    if (me == NULL || !qo_allowed_as(me, #function, interface, modes)) {                                             \
        return fmi3Error;                                                                                            \
    }

/* A pointer that the importer must give. */
#define GIVEN(pointer)                                                                                               \
    if ((pointer) == NULL) {                                                                                         \
        return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "%s is a null pointer.", #pointer);                          \
    }

/* Scalars that value references stand for. */
#define SCALARS(found, references, orders, n)                                                                        \
    if (!qo_scalars_of(me, references, orders, n, &(found))) {                                                       \
        return fmi3Error;                                                                                            \
    }

#define SETTABLE (QO_INSTANTIATED | QO_INITIALIZATION | QO_RUNNING)
#define SOLVING (QO_INITIALIZATION | QO_EVENT | QO_CONTINUOUS_TIME | QO_TERMINATED)

#endif
