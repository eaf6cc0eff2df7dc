/* What core.c, solver.c and the generated table share. */
#ifndef QO_INTERNAL_H
#define QO_INTERNAL_H

#include "core.h"

/* A variable that has a value of its own: a row of the table. */
typedef struct {
    const char *name;
    double start, minimum, maximum, nominal;
    int positive; /* zero is refused */
} qo_row;

extern const qo_row qo_states[QO_NX];
extern const qo_row qo_inputs[QO_NU];
extern const qo_row qo_parameters[QO_NP];
extern const char *const qo_outputs_by_name[QO_NY];

/* Writes the message kind + name + what; returns status. */
qo_status qo_fail(qo_model *model, qo_status status, const char *kind, const char *name, const char *what);

/* y, then mode, after a step: states and inputs have changed since qo_check, parameters are not asked again. */
qo_status qo_outputs_after_step(qo_model *model);
qo_status qo_mode_after_step(qo_model *model, int *changed);

/* Index of the first value that is not finite, -1 where all are. */
int qo_first_not_finite(const double *values, int count);

#endif
