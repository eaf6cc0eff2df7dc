/* The fastest time constant of the model: how short a step an explicit method needs. */
#include <math.h>
#include <string.h>

#include "core.h"
#include "qo_equations.h"
#include "qo_internal.h"

/* Iterations until the fastest direction is the one that is left, and those that its growth is the mean of: a mean
   because two directions that swing into each other grow by turns. */
#define SETTLING 150
#define AVERAGED 100

/* Length of a direction, its parts in units of the nominal values; it is left with length one. */
static double normalize(double *direction) {
    double sum = 0.0, length;
    int index;
    for (index = 0; index < QO_NX; ++index) {
        double part = direction[index] / qo_states[index].nominal;
        sum += part * part;
    }
    length = sqrt(sum);
    for (index = 0; index < QO_NX && length > 0.0; ++index) {
        direction[index] /= length;
    }
    return length;
}

/* Power iteration with the Jacobian where friction and contacts are steepest: at rest, straight ahead, unloaded. */
qo_status qo_fastest(qo_model *model, double *seconds) {
    static const double zero[QO_NX + QO_NU + QO_NP];
    double direction[QO_NX], growth = 0.0;
    int index, count;
    qo_status status = qo_check(model);
    if (status != QO_OK) {
        return status;
    }
    for (index = 0; index < QO_NX; ++index) {
        direction[index] = qo_states[index].nominal / (1.0 + index);
    }
    for (count = -SETTLING; count < AVERAGED; ++count) {
        double grown[QO_NX], outputs[QO_NY], length;
        qo_eq_jacobian_vector(zero, zero, model->p, direction, zero, zero, grown, outputs);
        length = normalize(grown);
        if (!(length > 0.0) || !isfinite(length)) {
            return qo_fail(model, QO_ERROR, "Output ", "fastest_time_constant", " is not finite.");
        }
        growth += count < 0 ? 0.0 : log(length);
        memcpy(direction, grown, sizeof direction);
    }
    *seconds = exp(-growth / AVERAGED);
    return QO_OK;
}
