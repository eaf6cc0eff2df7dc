/* What core.c and solver.c share. */
#ifndef QO_INTERNAL_H
#define QO_INTERNAL_H

#include "core.h"

/* Writes the message kind + name + what; returns status. */
qo_status qo_fail(qo_model *model, qo_status status, const char *kind, const char *name, const char *what);

/* Index of the first value that is not finite, -1 where all are. */
int qo_first_not_finite(const double *values, int count);

#endif
