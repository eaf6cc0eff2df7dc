/* Directional and adjoint derivatives by variables, from those of the model by blocks. */
#include <string.h>

#include "instance.h"

/* What is differentiated, and with respect to what; time does not enter the equations. */
typedef struct {
    double x[QO_NX], u[QO_NU], p[QO_NP];
} knowns_of_model;

typedef struct {
    double xd[QO_NX], y[QO_NY];
} unknowns_of_model;

/* Where a known has its place; the independent variable has one that nothing reads. */
static double *known(const qo_instance *me, unsigned reference, knowns_of_model *of, double *nowhere)
{
    const qo_variable *variable = qo_find(me, reference);
    if (variable == NULL) {
        return NULL;
    }
    switch (variable->role) {
    case QO_STATE: return of->x + variable->index;
    case QO_INPUT: return of->u + variable->index;
    case QO_PARAMETER: return of->p + variable->index;
    case QO_TIME: return nowhere;
    default: qo_tell(me, QO_ANSWER_ERROR, "Nothing is differentiated with respect to %s.", variable->name); return NULL;
    }
}

/* Where an unknown has its place; a state that is an output depends on itself alone. */
static double *unknown(const qo_instance *me, unsigned reference, unknowns_of_model *of, double *x)
{
    const qo_variable *variable = qo_find(me, reference);
    if (variable == NULL) {
        return NULL;
    }
    switch (variable->role) {
    case QO_DERIVATIVE: return of->xd + variable->index;
    case QO_OUTPUT: return of->y + variable->index;
    case QO_STATE: return x + variable->index;
    default: qo_tell(me, QO_ANSWER_ERROR, "%s has no derivatives.", variable->name); return NULL;
    }
}

static int given(const qo_instance *me, const void *references, size_t n, const void *values, size_t n_values)
{
    if (n == n_values && (n == 0 || (references != NULL && values != NULL))) {
        return 1;
    }
    qo_tell(me, QO_ANSWER_ERROR, "Value references and values of derivatives do not fit each other.");
    return 0;
}

static int finite_seed(const qo_instance *me, const double seed[], size_t n)
{
    size_t i;
    for (i = 0; i < n; i++) {
        if (seed[i] - seed[i] != 0.0) {
            qo_tell(me, QO_ANSWER_ERROR, "seed[%lu] is not a finite number.", (unsigned long)i);
            return 0;
        }
    }
    return 1;
}

qo_answer qo_directional(qo_instance *me, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[],
                         size_t n_knowns, const double seed[], size_t n_seed, double result[], size_t n_result)
{
    knowns_of_model direction;
    unknowns_of_model response;
    double nowhere = 0.0;
    qo_answer answer;
    size_t i;
    if (!given(me, unknowns, n_unknowns, result, n_result) || !given(me, knowns, n_knowns, seed, n_seed) ||
        !finite_seed(me, seed, n_seed)) {
        return QO_ANSWER_ERROR;
    }
    memset(&direction, 0, sizeof direction);
    for (i = 0; i < n_knowns; i++) {
        double *place = known(me, knowns[i], &direction, &nowhere);
        if (place == NULL) {
            return QO_ANSWER_ERROR;
        }
        *place += seed[i];
    }
    answer = qo_trial(me, qo_jacobian_vector(&me->now.model, direction.x, direction.u, direction.p, response.xd,
                                              response.y));
    for (i = 0; answer == QO_ANSWER_OK && i < n_unknowns; i++) {
        const double *place = unknown(me, unknowns[i], &response, direction.x);
        if (place == NULL) {
            return QO_ANSWER_ERROR;
        }
        result[i] = *place;
    }
    return answer;
}

qo_answer qo_adjoint(qo_instance *me, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[],
                     size_t n_knowns, const double seed[], size_t n_seed, double result[], size_t n_result)
{
    knowns_of_model gradient;
    unknowns_of_model weights;
    double own[QO_NX], nowhere = 0.0;
    qo_answer answer;
    size_t i;
    if (!given(me, unknowns, n_unknowns, seed, n_seed) || !given(me, knowns, n_knowns, result, n_result) ||
        !finite_seed(me, seed, n_seed)) {
        return QO_ANSWER_ERROR;
    }
    memset(&weights, 0, sizeof weights);
    memset(own, 0, sizeof own);
    for (i = 0; i < n_unknowns; i++) {
        double *place = unknown(me, unknowns[i], &weights, own);
        if (place == NULL) {
            return QO_ANSWER_ERROR;
        }
        *place += seed[i];
    }
    answer = qo_trial(me, qo_vector_jacobian(&me->now.model, weights.xd, weights.y, gradient.x, gradient.u,
                                              gradient.p));
    for (i = 0; answer == QO_ANSWER_OK && i < QO_NX; i++) {
        gradient.x[i] += own[i];
    }
    for (i = 0; answer == QO_ANSWER_OK && i < n_knowns; i++) {
        const double *place = known(me, knowns[i], &gradient, &nowhere);
        if (place == NULL) {
            return QO_ANSWER_ERROR;
        }
        result[i] = *place;
    }
    return answer;
}

qo_answer qo_output_derivatives(qo_instance *me, const unsigned references[], size_t n, const int orders[],
                                double values[], size_t n_values)
{
    static const double held_inputs[QO_NU], held_parameters[QO_NP];
    double rates[QO_NX], nowhere[QO_NX];
    unknowns_of_model response;
    qo_answer answer;
    size_t i;
    if (!given(me, references, n, values, n_values) || !given(me, references, n, orders, n)) {
        return QO_ANSWER_ERROR;
    }
    answer = qo_trial(me, qo_derivatives(&me->now.model, rates));
    if (answer == QO_ANSWER_OK) {
        answer = qo_trial(me, qo_jacobian_vector(&me->now.model, rates, held_inputs, held_parameters, response.xd,
                                                  response.y));
    }
    memcpy(nowhere, rates, sizeof nowhere);
    for (i = 0; answer == QO_ANSWER_OK && i < n; i++) {
        const double *place = unknown(me, references[i], &response, nowhere);
        if (place == NULL) {
            return QO_ANSWER_ERROR;
        }
        if (orders[i] != 1) {
            return qo_tell(me, QO_ANSWER_ERROR, "%s has derivatives of order 1 only.",
                           qo_variables[references[i]].name);
        }
        values[i] = *place;
    }
    return answer;
}
