/* Systems (shift I - J) k = r at one Jacobian. */
#ifndef QO_LINEAR_H
#define QO_LINEAR_H

#include "qo_sizes.h"

typedef struct {
    double jacobian[QO_NJ];       /* what is not zero of it */
    double factors[QO_NF];        /* of the states that are eliminated */
    double matrix[QO_NV][QO_NV];  /* of the others, decomposed */
    int pivot[QO_NV];
} qo_linear;

/* For a shift, at the Jacobian that it has; whether there is a solution. */
int qo_prepare(qo_linear *system, double shift);

/* k (QO_NX) from r (QO_NX). */
void qo_solve(const qo_linear *system, const double *right, double *solution);

#endif
